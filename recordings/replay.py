"""Feed a recorded base motion to the live twin again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from recordings.errors import RecordingError
from twin.live import LiveTwin
from twin.provenance import same_arithmetic
from twin.run_report import LYING, SENSOR_SLACK

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from devices.clock import Clock
    from recordings.run import Run

LARGEST_DIFFERENCE = 1e-9
"""What predictions may differ by where versions or processors do, rad."""


@dataclass(frozen=True)
class Replay:
    """A replayed run.

    Attributes
    ----------
    predicted_rotation, predicted_angular_velocity : ndarray, shape (n,)
        What the live code predicts now, rad and rad/s.
    differs : list of str
        What is not the same as when it was recorded and could change a bit.
    identical : bool
        Whether every prediction equals the recorded one bit for bit.
    largest_change : float
        Largest |prediction now - prediction then|, rad.
    predicted_peak, measured_peak : float
        Largest |rotation|, rad; NaN for the measured one where no sensor was on.
    largest_difference : float
        Largest |predicted - measured| while neither block lay on its side, rad.
    """

    predicted_rotation: NDArray[np.float64]
    predicted_angular_velocity: NDArray[np.float64]
    differs: list[str]
    identical: bool
    largest_change: float
    predicted_peak: float
    measured_peak: float
    largest_difference: float

    @property
    def bits_checked(self) -> bool:
        """Whether bit identity was asked of it (equal versions and processor), or `LARGEST_DIFFERENCE`."""
        return not self.differs

    @property
    def agrees(self) -> bool:
        """Whether it is what was asked of it."""
        return self.identical if self.bits_checked else self.largest_change <= LARGEST_DIFFERENCE


def replay(
    run: Run,
    twin: LiveTwin,
    *,
    clock: Clock | None = None,
    speed: float = 1.0,
    each: Callable[[float, float, float], None] | None = None,
) -> Replay:
    """Drive `twin` with the measured base acceleration of `run`.

    Parameters
    ----------
    run : Run
    twin : LiveTwin
        Fresh, of the run's scene.
    clock : Clock, optional
        Paces the replay at `speed` times real time; None: as fast as it goes.
    each : callable, optional
        Called with time s, predicted and measured rotation rad of every cycle.

    Raises
    ------
    RecordingError
        The run has no cycles, or its times or accelerations are not finite or not in order.
    """
    cycles = run.cycles
    if not len(cycles):
        raise RecordingError(f"{run.path} has no cycles to replay")
    if not (np.all(np.isfinite(cycles.acceleration)) and np.all(np.isfinite(cycles.time))):
        raise RecordingError(f"{run.path} has times or accelerations that are not finite")
    if np.any(np.diff(cycles.time) <= 0.0):
        raise RecordingError(f"{run.path} has times that do not increase")
    rotation = np.empty(len(cycles))
    rate = np.empty(len(cycles))
    begin = clock.now() if clock is not None else 0.0
    first = float(cycles.time[0])
    rows = zip(cycles.time.tolist(), cycles.acceleration.tolist(), cycles.rotation.tolist(), strict=True)
    for k, (time, acceleration, measured) in enumerate(rows):
        if clock is not None:
            clock.wait_until(begin + (time - first) / speed)
        rotation[k] = twin.measure(time, acceleration)
        rate[k] = twin.block.angular_velocity
        if each is not None:
            each(time, float(rotation[k]), measured)
    return _compare(run, rotation, rate)


def _compare(run: Run, rotation: NDArray[np.float64], rate: NDArray[np.float64]) -> Replay:
    cycles = run.cycles
    identical = bool(
        np.array_equal(rotation.view(np.uint64), cycles.predicted_rotation.view(np.uint64))
        and np.array_equal(rate.view(np.uint64), cycles.predicted_angular_velocity.view(np.uint64))
    )
    measured = cycles.rotation[np.isfinite(cycles.rotation)]
    standing = np.isfinite(cycles.rotation)
    down = np.nonzero((np.abs(rotation) >= LYING) | (np.abs(cycles.rotation) >= LYING - SENSOR_SLACK))[0]
    if down.size:
        standing[down[0] :] = False
    apart = np.abs(rotation - cycles.rotation)[standing]
    change = np.abs(rotation - cycles.predicted_rotation)
    return Replay(
        predicted_rotation=rotation,
        predicted_angular_velocity=rate,
        differs=same_arithmetic(dict(run.metadata.get("versions", {})), dict(run.metadata.get("processor", {}))),
        identical=identical,
        largest_change=float(np.max(change)) if np.all(np.isfinite(change)) else math.inf,
        predicted_peak=float(np.max(np.abs(rotation))),
        measured_peak=float(np.max(np.abs(measured))) if measured.size else math.nan,
        largest_difference=float(np.max(apart)) if apart.size else math.nan,
    )
