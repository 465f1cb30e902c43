"""Feed a recorded base motion to the live twin again."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from recordings.errors import RecordingError
from recordings.pacing import Unpaced
from twin.live_twin import LiveTwin
from twin.provenance import same_arithmetic
from twin.run_report import LYING, SENSOR_SLACK

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from recordings.pacing import Pace
    from recordings.run import Run
    from twin.rocking.track import BlockEvent

LARGEST_DIFFERENCE = 1e-9
"""What predictions may differ by where versions or processors do, rad."""


@dataclass(frozen=True)
class Replay:
    """A replayed run.

    Attributes
    ----------
    played : int
        How many cycles were fed to it; fewer than recorded where the pace ended it.
    predicted_rotation, predicted_angular_velocity : ndarray, shape (n,)
        What the live code predicts now for each cycle played, rad and rad/s.
    events : tuple of BlockEvent
        Uplift, impacts, rest and fall of the predicted block, on the table's clock.
    differs : list of str
        What is not the same as when it was recorded and could change a bit.
    identical : bool
        Whether every prediction equals the recorded one bit for bit, and every estimate where both have an observer.
    estimates : int
        Recorded estimates that were compared.
    largest_change, largest_change_time : float
        Largest |prediction now - prediction then|, or of the estimates, rad; and when that of the predictions is, s.
    predicted_peak, measured_peak : float
        Largest |rotation|, rad; NaN for the measured one where no sensor was on.
    largest_difference : float
        Largest |predicted - measured| while neither block lay on its side, rad.
    """

    played: int
    predicted_rotation: NDArray[np.float64]
    predicted_angular_velocity: NDArray[np.float64]
    events: tuple[BlockEvent, ...]
    differs: list[str]
    identical: bool
    estimates: int
    largest_change: float
    largest_change_time: float
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
    pace: Pace | None = None,
    each: Callable[[float, float, float], None] | None = None,
) -> Replay:
    """Drive `twin` with the measured base acceleration of `run`.

    Parameters
    ----------
    run : Run
    twin : LiveTwin
        Fresh, of the run's scene.
    pace : Pace, optional
        Holds it back, or ends it early; None: as fast as it goes.
    each : callable, optional
        Called with time s, predicted and measured rotation rad of every cycle.

    Raises
    ------
    RecordingError
        The run has no cycles, or its times or accelerations are not finite or not in order.
    """
    check_replayable(run)
    cycles = run.cycles
    wait = (pace or Unpaced()).wait
    rotation = np.empty(len(cycles))
    rate = np.empty(len(cycles))
    estimated = np.full(len(cycles), np.nan)
    events: list[BlockEvent] = []
    # The block's own clock begins with the first sample.
    first = float(cycles.time[0])
    rows = zip(cycles.time.tolist(), cycles.acceleration.tolist(), cycles.rotation.tolist(), strict=True)
    played = 0
    for time, acceleration, measured in rows:
        if not wait(time):
            break
        rotation[played] = twin.measure(time, acceleration, measured)
        if twin.foresight is not None:
            estimated[played] = twin.foresight.observer.rotation
        rate[played] = twin.block.angular_velocity
        if twin.block.events:
            events += [event._replace(time=first + event.time) for event in twin.block.events]
        played += 1
        if each is not None:
            each(time, twin.block.rotation, measured)
    return _compared(run, rotation[:played], rate[:played], estimated[:played], tuple(events))


def check_replayable(run: Run) -> None:
    """Raise RecordingError where a run cannot be fed to the live code."""
    cycles = run.cycles
    if not len(cycles):
        raise RecordingError(f"{run.path} has no cycles to replay")
    if not (np.all(np.isfinite(cycles.acceleration)) and np.all(np.isfinite(cycles.time))):
        raise RecordingError(f"{run.path} has times or accelerations that are not finite")
    if np.any(np.diff(cycles.time) <= 0.0):
        raise RecordingError(f"{run.path} has times that do not increase")


def _compared(
    run: Run,
    rotation: NDArray[np.float64],
    rate: NDArray[np.float64],
    estimated: NDArray[np.float64],
    events: tuple[BlockEvent, ...],
) -> Replay:
    cycles = run.cycles.between(0, rotation.size)
    identical = bool(
        np.array_equal(rotation.view(np.uint64), cycles.predicted_rotation.view(np.uint64))
        and np.array_equal(rate.view(np.uint64), cycles.predicted_angular_velocity.view(np.uint64))
    )
    again, then = _estimates(run, cycles.cycle, estimated)
    identical = identical and np.array_equal(again.view(np.uint64), then.view(np.uint64))
    estimate_change = float(np.max(np.abs(again - then), initial=0.0))
    measured = cycles.rotation[np.isfinite(cycles.rotation)]
    standing = np.isfinite(cycles.rotation)
    down = np.nonzero((np.abs(rotation) >= LYING) | (np.abs(cycles.rotation) >= LYING - SENSOR_SLACK))[0]
    if down.size:
        standing[down[0] :] = False
    apart = np.abs(rotation - cycles.rotation)[standing]
    change = np.abs(rotation - cycles.predicted_rotation)
    return Replay(
        played=rotation.size,
        predicted_rotation=rotation,
        predicted_angular_velocity=rate,
        events=events,
        differs=same_arithmetic(dict(run.metadata.get("versions", {})), dict(run.metadata.get("processor", {}))),
        identical=identical,
        estimates=again.size,
        largest_change=float(np.max(change, initial=estimate_change)) if np.all(np.isfinite(change)) else math.inf,
        largest_change_time=float(cycles.time[int(np.argmax(change))]) if change.size else math.nan,
        predicted_peak=float(np.max(np.abs(rotation), initial=0.0)),
        measured_peak=float(np.max(np.abs(measured))) if measured.size else math.nan,
        largest_difference=float(np.max(apart)) if apart.size else math.nan,
    )


def _estimates(
    run: Run, numbers: NDArray[np.int64], estimated: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the estimates made now and those recorded, of the cycles that have both."""
    series = run.series.get("/estimate")
    if series is None or not np.any(np.isfinite(estimated)):
        return np.zeros(0), np.zeros(0)
    # A message's sequence is its cycle's number modulo 2**32.
    low = (numbers & 0xFFFF_FFFF).astype(np.uint32)
    _, place, which = np.intersect1d(low, series.sequence, return_indices=True)
    return estimated[place], np.ascontiguousarray(series.columns["rotation_rad"][which])
