"""What a table makes of the asked acceleration: as it was measured while tuning, or as its linear model has it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excitation import Record
from excitation.accelerogram import MAX_SAMPLES
from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Response
from twin.simulation import simulate
from twin.tuned import Errors, TunedCommand
from twin.tuning.transfer import TransferFunction
from twin.tuning.window import window_of

FrequencyResponse = Callable[[float], complex]
"""Frequency, Hz -> achieved over asked acceleration."""


@dataclass(frozen=True, slots=True)
class Achieved:
    """The base acceleration a table is known, or expected, to make of one pulse.

    Attributes
    ----------
    source : str
        Where it comes from, in words.
    errors : Errors
        Against the asked acceleration.
    start : float
        Time of the first sample after the start of the pulse, s: negative.
    cycle_time : float
        Between samples, s.
    acceleration : FloatArray, shape (n,)
        m/s2.
    response : Response or None
        The block predicted under it; None for a block that is let go from a tilt at the start of the run, and for a
        pulse of more samples than a record may have.
    """

    source: str
    errors: Errors
    start: float
    cycle_time: float
    acceleration: FloatArray
    response: Response | None

    @property
    def label(self) -> str:
        """Short, for a picture: "achieved, as asked"."""
        return f"achieved, {self.source.partition(' (')[0]}"

    def line(self, slenderness: float) -> str:
        """Return source, error and what it does to the block."""
        line = f"{self.source}: error {self.errors} of the asked peak"
        if self.response is None:
            return line
        peak = self.response.peak_rotation
        return f"{line}; block {self.response.outcome.value}, peak {peak:.4f} rad ({peak / slenderness:.2f} of alpha)"

    def data(self) -> dict[str, object]:
        """Return the same for `--json`."""
        response = self.response
        return {
            "source": self.source,
            **self.errors.model_dump(),
            "outcome": None if response is None else response.outcome.value,
            "peak_rotation_rad": None if response is None else response.peak_rotation,
        }


def as_measured(command: TunedCommand, rehearsal: Rehearsal) -> tuple[Achieved, Achieved]:
    """Return what the table made of the command as asked, and of the corrected one."""
    where = f"measured by twin tune on {command.made[:10]}, {command.purpose.machine}"
    return (
        _achieved(f"as asked ({where})", command.before, command, command.achieved_before, rehearsal),
        _achieved(f"corrected ({where})", command.after, command, command.achieved, rehearsal),
    )


def predicted(model: FrequencyResponse, source: str, rehearsal: Rehearsal) -> Achieved:
    """Return what a linear table would make of the command as asked."""
    scene = rehearsal.scene
    cycle_time = 1.0 / scene.twin.cycle_hz
    window = window_of(rehearsal.motion, cycle_time, scene.table.settle_s)
    transfer = TransferFunction(window.size, cycle_time)
    answer = np.array([model(f) for f in transfer.frequencies.tolist()])
    made = transfer.samples(answer * transfer.spectrum(window.asked_curvature), window.size)
    error = (window.acceleration - made)[window.judged] / window.peak
    errors = Errors(rms=float(np.sqrt(np.mean(error**2))), peak=float(np.max(np.abs(error))), noise=0.0)
    return Achieved(source, errors, window.start, cycle_time, made, _response(made, cycle_time, rehearsal))


def _achieved(
    source: str, errors: Errors, command: TunedCommand, samples: tuple[float, ...], rehearsal: Rehearsal
) -> Achieved:
    acceleration, cycle_time = np.array(samples), command.purpose.cycle_time
    response = _response(acceleration, cycle_time, rehearsal)
    return Achieved(source, errors, command.start, cycle_time, acceleration, response)


def _response(acceleration: FloatArray, cycle_time: float, rehearsal: Rehearsal) -> Response | None:
    if initial_rotation(rehearsal.scene) != 0.0 or acceleration.size > MAX_SAMPLES:
        return None
    return simulate(rehearsal.block, Record(acceleration, cycle_time, "achieved"), restitution=rehearsal.restitution)
