"""Two predictions side by side: what was predicted, and what would have been with other parameters."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import takewhile
from typing import TYPE_CHECKING, Literal

import numpy as np

from twin.run_report import LYING

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.replay import Replay
    from recordings.run import Cycles
    from twin.rocking.track import BlockEvent

OutcomeName = Literal["stayed", "rocked", "overturned"]


@dataclass(frozen=True, eq=False)
class Prediction:
    """A predicted rotation and its events: times s on the table's clock, rotations rad."""

    time: NDArray[np.float64]
    rotation: NDArray[np.float64]
    events: tuple[BlockEvent, ...]

    @property
    def peak(self) -> float:
        """Largest |rotation|, rad."""
        return float(np.max(np.abs(self.rotation), initial=0.0))

    @property
    def outcome(self) -> OutcomeName:
        """How it ended for the block, as far as the run goes."""
        return "overturned" if self.peak >= LYING else "rocked" if self.peak > 0.0 else "stayed"

    @property
    def impacts(self) -> list[BlockEvent]:
        """The impacts, in order."""
        return [event for event in self.events if event.name == "impact"]


@dataclass(frozen=True, eq=False)
class Differences:
    """What a change did to a prediction.

    Attributes
    ----------
    before, after : Prediction
    rms, largest, largest_time : float
        Of after - before while neither block lies: root mean square and largest size, rad, and when that is, s; NaN
        where they have no time in common.
    same_impacts : int
        How many impacts of both are the same ones: the first of each, the second, ... as long as they go the same way.
    """

    before: Prediction
    after: Prediction
    rms: float
    largest: float
    largest_time: float
    same_impacts: int


def prediction_of(again: Replay, cycles: Cycles) -> Prediction:
    """Return what a replay predicted."""
    return Prediction(cycles.time[: again.played], again.predicted_rotation, again.events)


def differences(before: Prediction, after: Prediction) -> Differences:
    """Compare two predictions on one clock; the second is taken at the times of the first, linearly in between."""
    other = np.interp(before.time, after.time, after.rotation)
    inside = (before.time >= after.time[0]) & (before.time <= after.time[-1])
    down = np.flatnonzero((np.abs(before.rotation) >= LYING) | (np.abs(other) >= LYING))
    if down.size:
        inside[down[0] :] = False
    apart = np.where(inside, np.abs(other - before.rotation), 0.0)
    same = _same_impacts(before.impacts, after.impacts)
    if not np.any(inside):
        return Differences(before, after, math.nan, math.nan, math.nan, same)
    peak = int(np.argmax(apart))
    rms = float(np.sqrt(np.mean(apart[inside] ** 2)))
    return Differences(before, after, rms, float(apart[peak]), float(before.time[peak]), same)


def _same_impacts(before: list[BlockEvent], after: list[BlockEvent]) -> int:
    """Return how many go the same way from the first on: a prediction misses no impact, so their order is enough."""
    pairs = zip(before, after, strict=False)
    return sum(1 for _ in takewhile(lambda pair: (pair[0].rate > 0.0) == (pair[1].rate > 0.0), pairs))
