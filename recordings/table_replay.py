"""Recorded set-points performed again on a table, and what it measures beside what was measured then."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from devices.errors import DeviceError
from recordings.pacing import Unpaced
from recordings.replay import check_replayable
from recordings.run import Cycles
from twin.cycle import CycleRecord

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

    from devices.sample import Sample
    from devices.table import ShakeTable
    from recordings.pacing import Pace
    from recordings.run import Run
    from twin.live_twin import LiveTwin
    from twin.rocking.track import BlockEvent

SIGNALS = {"position": "m", "acceleration": "m/s2", "rotation": "rad"}
"""What is measured, and its unit."""


@dataclass(frozen=True, eq=False)
class TableReplay:
    """What came of it.

    Attributes
    ----------
    cycles : Cycles
        Measured and predicted now; times of the host's clock are those of the original.
    then : Cycles
        The same cycles as recorded.
    events : tuple of BlockEvent
        Of the predicted block now, on the table's clock.
    ended : str or None
        Why it did not go to the end, one sentence.
    """

    cycles: Cycles
    then: Cycles
    events: tuple[BlockEvent, ...]
    ended: str | None

    def apart(self, signal: str) -> tuple[float, float]:
        """Return root mean square and largest |now - then| of a signal of `SIGNALS`; NaN where one is missing."""
        now: NDArray[np.float64] = getattr(self.cycles, signal)
        then: NDArray[np.float64] = getattr(self.then, signal)
        change = now - then
        change = change[np.isfinite(change)]
        if not change.size:
            return math.nan, math.nan
        return float(np.sqrt(np.mean(change**2))), float(np.max(np.abs(change)))


def play_on_table(
    run: Run,
    table: ShakeTable,
    twin: LiveTwin,
    *,
    release: Callable[[], None] = lambda: None,
    pace: Pace | None = None,
    each: Callable[[float, float, float], None] | None = None,
) -> TableReplay:
    """Send the recorded targets to an enabled `table`, cycle by cycle; missed cycles stay missed.

    Where the recorded run was stopped by the drive's own ramp, which has no targets, so is this one. A table that
    refuses a target or gives up ends it; the caller closes the table.

    Parameters
    ----------
    run : Run
    table : ShakeTable
        Enabled where the run began.
    twin : LiveTwin
        Fresh.
    release : callable
        Called once, after the first sample: lets go of a block held at its initial tilt.
    pace, each
        As of `recordings.replay.replay`.
    """
    check_replayable(run)
    wait = (pace or Unpaced()).wait
    player = _Player(run, twin, each)
    ended: str | None = None
    try:
        for row, (cycle, target) in enumerate(
            zip(run.cycles.cycle.tolist(), run.cycles.target_position.tolist(), strict=True)
        ):
            if not wait(float(run.cycles.time[row])):
                ended = f"it was stopped at {run.cycles.time[row]:.3f} s"
                break
            if not math.isfinite(target):
                table.quick_stop(player.take)
                break
            player.take(table.exchange(cycle, target), target)
            if row == 0:
                release()
    except DeviceError as error:
        ended = f"the table gave up in cycle {int(run.cycles.cycle[len(player.records)])}: {error}"
    return player.result(ended)


class _Player:
    """Takes samples in the order of the recorded rows."""

    def __init__(self, run: Run, twin: LiveTwin, each: Callable[[float, float, float], None] | None) -> None:
        self.records: list[CycleRecord] = []
        self._run = run
        self._twin = twin
        self._each = each
        self._events: list[BlockEvent] = []

    def take(self, sample: Sample, target: float = math.nan) -> None:
        """Predict from a sample and keep it; what comes after the last recorded cycle is not kept."""
        row = len(self.records)
        then = self._run.cycles
        if row >= len(then):
            return
        predicted = self._twin.measure(sample.time, sample.acceleration)
        first = float(then.time[0])
        self._events += [event._replace(time=first + event.time) for event in self._twin.block.events]
        self.records.append(
            CycleRecord(
                sample.cycle,
                sample.time,
                int(then.host_time_ns[row]),
                math.nan,
                target,
                sample.position,
                sample.acceleration,
                sample.rotation,
                predicted,
                self._twin.block.angular_velocity,
                sample.status,
            )
        )
        if self._each is not None:
            self._each(sample.time, predicted, sample.rotation)

    def result(self, ended: str | None) -> TableReplay:
        now = Cycles.of(self.records)
        return TableReplay(now, self._run.cycles.between(0, len(now)), tuple(self._events), ended)
