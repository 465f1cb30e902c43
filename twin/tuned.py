"""The corrected command of one pulse on one table: what it is for, what it came to, and how it is played."""

from __future__ import annotations

import hashlib
import math
from typing import Annotated, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from excitation import Capacity
from excitation.table_run import TableRun
from twin.errors import InputError
from twin.rocking.compiled import FloatArray

LARGEST_CORRECTION = 1.0
"""m; no table here moves further."""

_Share = Annotated[float, Field(ge=0.0, le=1e6)]
_Samples = Annotated[tuple[float, ...], Field(min_length=2, max_length=10_000_000)]


class _Kept(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, strict=True)


class Purpose(_Kept):
    """What a command was corrected for: anything else needs another one.

    Attributes
    ----------
    device : str
        Name in the catalogue.
    machine : str
        "table", or "emulator": the emulated one is another machine.
    capacity : str
        Its numbers, as JSON.
    cycle_time : float
        s.
    payload : float
        The specimen's mass, kg: 0 where nothing is known of it.
    emulator : str
        Fingerprint of the numbers the emulated table is made of; empty for a real one.
    pulse : str
        Fingerprint of pulse, coast and brake.
    """

    device: str
    machine: Literal["table", "emulator"]
    capacity: str
    cycle_time: Annotated[float, Field(gt=0.0, le=1.0)]
    payload: Annotated[float, Field(ge=0.0)]
    emulator: str
    pulse: str

    @property
    def key(self) -> str:
        """Sixteen hexadecimal digits; equal for equal purposes."""
        return hashlib.sha256(self.model_dump_json().encode()).hexdigest()[:16]

    def differences(self, other: Purpose) -> list[str]:
        """Return what another purpose has different, in the user's words."""
        words = {"cycle_time": "cycle time", "emulator": "set of the emulator's numbers"}
        names = [name for name in type(self).model_fields if getattr(self, name) != getattr(other, name)]
        return [words.get(name, name) for name in names]


class Errors(_Kept):
    """Of the base acceleration over the pulse, as shares of the asked peak; `noise` is that in `rms`, if known."""

    rms: _Share
    peak: _Share
    noise: _Share

    def __str__(self) -> str:
        noise = f" (noise {self.noise:.2%})" if self.noise else ""
        return f"{self.rms:.2%} rms{noise}, {self.peak:.1%} at most"


class TunedCommand(_Kept):
    """A corrected command, as it is kept in a file.

    Attributes
    ----------
    version : int
        Of this layout.
    purpose : Purpose
    scene, excitation : str
        For whom and what it was made, in words.
    payload : float
        Mass that was on the table meanwhile, kg.
    identity : str
        Who the machine said it was.
    made : str
        Date and time, ISO 8601, UTC.
    reason : str
        Why the iteration ended.
    corrections, runs : int
        Commands that were tried, and all runs together.
    asked_peak : float
        Largest asked |acceleration|, m/s2.
    before, after : Errors
        Of the command as asked and of the corrected one, each measured.
    start : float
        Time of the first sample after the start of the pulse, s: negative.
    correction : tuple of float
        m, added to the asked position, a value a cycle; 0 at both ends.
    achieved_before, achieved : tuple of float
        Measured base acceleration at the same instants, mean of several runs, m/s2.
    """

    version: Literal[1] = 1
    purpose: Purpose
    scene: str
    excitation: str
    payload: Annotated[float, Field(ge=0.0)]
    identity: str
    made: str
    reason: str
    corrections: Annotated[int, Field(ge=1)]
    runs: Annotated[int, Field(ge=1)]
    asked_peak: Annotated[float, Field(gt=0.0)]
    before: Errors
    after: Errors
    start: Annotated[float, Field(le=0.0)]
    correction: _Samples
    achieved_before: _Samples
    achieved: _Samples

    @property
    def end(self) -> float:
        """Time of the last sample after the start of the pulse, s."""
        return self.start + (len(self.correction) - 1) * self.purpose.cycle_time

    def corrected(self, positions: FloatArray, motion: TableRun) -> FloatArray:
        """Return the set-points of a run of `motion` with the correction in them.

        Parameters
        ----------
        positions : FloatArray, shape (n,)
            Of the motion at the end of cycles 0 to n - 1, m.
        motion : TableRun
            Around the same pulse; the cycles may lie otherwise about its start than they did when the command was made.

        Raises
        ------
        InputError
            Where the pauses beside the pulse are too short for the correction.
        """
        self._fits(motion)
        h = self.purpose.cycle_time
        places = (np.arange(1, positions.size + 1) * h - motion.pulse_start - self.start) / h
        grid = np.arange(len(self.correction))
        inside = (places >= 0.0) & (places <= grid[-1])
        # A fifth of a second to import: only where there is a correction.
        from scipy.interpolate import CubicSpline  # pyright: ignore[reportMissingTypeStubs]

        spline = CubicSpline(grid, np.array(self.correction), bc_type="clamped")
        result = positions.copy()
        result[inside] += spline(places[inside])
        return result

    def _fits(self, motion: TableRun) -> None:
        gap = max(map(abs, self.correction))
        if gap > LARGEST_CORRECTION:
            raise InputError(f"tuned command: a correction of {gap:.3g} m is none")
        before, after = pauses(motion)
        h = self.purpose.cycle_time
        for where, has, needs in (
            ("before", before, -self.start),
            ("behind", after, self.end - (motion.shaking_end - motion.pulse_start)),
        ):
            if needs > has + h:
                raise InputError(
                    f"tuned command: it takes {needs:.3f} s {where} the pulse, where this run pauses for {has:.3f} s: "
                    f"give the scene a longer table.settle_s, or `twin tune` it again"
                )


def pauses(motion: TableRun) -> tuple[float, float]:
    """Return how long the table stands before the pulse and behind what shakes, s."""
    start, end = motion.pulse_start, motion.shaking_end
    before = max((p.end - p.start for p in motion.phases if math.isclose(p.end, start, abs_tol=1e-9)), default=0.0)
    after = max((p.end - p.start for p in motion.phases if math.isclose(p.start, end, abs_tol=1e-9)), default=0.0)
    return before, after


def purpose_of(
    device: str,
    capacity: Capacity,
    motion: TableRun,
    cycle_time: float,
    payload: float | None,
    *,
    emulator: str | None,
) -> Purpose:
    """Return what a command for this run has to be corrected for; the run has a pulse.

    `emulator` are the numbers the emulated table is made of, as text; None for a real table.
    """
    # Twelve digits: the pulse is the same where another version of a library rounds its last bit the other way.
    pieces: list[list[float]] = [] if motion.pulse is None else motion.pulse.pieces.tolist()
    rows = [",".join(f"{value:.12g}" for value in row) for row in pieces]
    rows += [f"{p.name} {p.end - p.start:.9f}" for p in motion.phases if p.name in ("pulse", "coast", "brake")]
    return Purpose(
        device=device,
        machine="table" if emulator is None else "emulator",
        capacity=capacity.model_dump_json(exclude={"provenance"}),
        cycle_time=cycle_time,
        payload=payload or 0.0,
        emulator=_fingerprint(emulator) if emulator else "",
        pulse=_fingerprint(";".join(rows)),
    )


def _fingerprint(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()[:32]
