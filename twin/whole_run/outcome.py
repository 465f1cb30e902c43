"""What becomes of the block in every stop of a run, against what becomes of it if the run goes on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.rocking.run import initial_state
from twin.rocking.series import scratch
from twin.rocking.state import ALPHA, PHI, RESTITUTION, STATE_SIZE, STRIDE, TOLERANCE, P
from twin.whole_run.marching import DOUBTFUL, FALLS, STANDS, UNDECIDED, Codes, stop_outcomes, visit
from twin.whole_run.stops import How, Stop, laid

Comparison = Literal["stands either way", "stopping topples it", "stopping saves it", "falls either way", "undecided"]
STANDS_EITHER_WAY: Comparison = "stands either way"
TOPPLES: Comparison = "stopping topples it"
SAVES: Comparison = "stopping saves it"
FALLS_EITHER_WAY: Comparison = "falls either way"
UNCERTAIN: Comparison = "undecided"
WORDS: dict[int, str] = {STANDS: "stands", FALLS: "falls", UNDECIDED: "undecided"}


@dataclass(frozen=True, slots=True)
class Interval:
    """Neighbouring moments at which stops compare in one way with going on: the first and the last, s."""

    comparison: Comparison
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Asked:
    """What the contact has to bear at worst in the stops, as shares of m g, and when that stop is decided, s."""

    friction: float
    friction_time: float
    normal: float
    normal_time: float


@dataclass(frozen=True, slots=True)
class StopStudy:
    """Every stop of one sort.

    Attributes
    ----------
    how : str
        "ramp-down", "power cut", or "run broken off" on a machine that was released.
    times : ndarray, shape (m,)
        When each is decided, s.
    stops : tuple of Stop
    outcomes : ndarray of uint8, shape (m,)
        0 the block stands, 1 it falls, 2 undecided.
    going_on : int
        The same, if the run goes on to its end.
    spacing : float
        Time between two moments, s.
    asked : Asked
    """

    how: How
    times: FloatArray
    stops: tuple[Stop, ...]
    outcomes: Codes
    going_on: int
    spacing: float
    asked: Asked

    @property
    def comparisons(self) -> list[Comparison]:
        """How each stop compares with going on."""
        return [_compare(self.going_on, int(code)) for code in self.outcomes]

    @property
    def intervals(self) -> list[Interval]:
        """The run cut into stretches of one comparison, in order."""
        found: list[Interval] = []
        for comparison, time in zip(self.comparisons, self.times.tolist(), strict=True):
            if found and found[-1].comparison == comparison:
                found[-1] = Interval(comparison, found[-1].start, time)
            else:
                found.append(Interval(comparison, time, time))
        return found

    def of(self, comparison: Comparison) -> list[Interval]:
        """Return the stretches of one comparison."""
        return [interval for interval in self.intervals if interval.comparison == comparison]

    @property
    def longest(self) -> tuple[float, Stop]:
        """When the stop that takes most time is decided, s, and the stop."""
        k = max(range(len(self.stops)), key=lambda k: self.stops[k].duration)
        return float(self.times[k]), self.stops[k]

    @property
    def furthest(self) -> tuple[float, Stop]:
        """When the stop that ends furthest out is decided, s, and the stop."""
        k = max(range(len(self.stops)), key=lambda k: self.stops[k].furthest)
        return float(self.times[k]), self.stops[k]

    @property
    def hardest(self) -> tuple[float, Stop]:
        """When the stop with the largest acceleration is decided, s, and the stop."""
        k = max(range(len(self.stops)), key=lambda k: self.stops[k].strongest)
        return float(self.times[k]), self.stops[k]

    @property
    def fastest_beyond(self) -> tuple[float, Stop]:
        """When the stop that passes its limit fastest is decided, s, and the stop."""
        k = max(range(len(self.stops)), key=lambda k: self.stops[k].beyond)
        return float(self.times[k]), self.stops[k]


def _compare(going_on: int, stopping: int) -> Comparison:
    if UNDECIDED in (going_on, stopping):
        return UNCERTAIN
    if going_on == STANDS:
        return STANDS_EITHER_WAY if stopping == STANDS else TOPPLES
    return SAVES if stopping == STANDS else FALLS_EITHER_WAY


class Checkpoints:
    """The block's states along a run of pieces, how the run ends for it, and how each stop of it would.

    An outcome in doubt is asked for again with other steps, and with every number of the block one rounding larger:
    where the answers differ it is undecided.

    Parameters
    ----------
    body : ndarray, shape (7,)
        See `twin.rocking.run.parameters`.
    rotation : float
        At which the block is let go at time 0, rad.
    pieces : ndarray, shape (n, 7)
    times : ndarray, shape (m,)
        Rising, s.
    """

    def __init__(self, body: FloatArray, rotation: float, pieces: FloatArray, times: FloatArray) -> None:
        self.times = times
        self._courses = [_Course(changed, rotation, pieces, times) for changed in (body, *_neighbours(body))]
        ends = [course.end % DOUBTFUL for course in self._courses]
        sure = self._courses[0].end < DOUBTFUL or len(set(ends)) == 1
        self.going_on = ends[0] if sure else UNDECIDED

    @property
    def lying(self) -> float | None:
        """First of the times at which the block lies on its side, s."""
        down = np.flatnonzero(self._courses[0].states[:, PHI] >= 0.5 * np.pi)
        return float(self.times[down[0]]) if down.size else None

    def study(self, how: How, stops: Iterable[Stop], spacing: float) -> StopStudy:
        """Return what the stops, one for each time, do to the block."""
        every = list(stops)
        asked, codes = self._courses[0].ask(every, np.arange(len(every)))
        doubtful = np.flatnonzero(codes >= DOUBTFUL)
        codes %= DOUBTFUL
        for course in self._courses[1:] if doubtful.size else ():
            _, again = course.ask([every[k] for k in doubtful.tolist()], doubtful)
            codes[doubtful[again % DOUBTFUL != codes[doubtful]]] = UNDECIDED
        return StopStudy(how, self.times, tuple(every), codes, self.going_on, spacing, asked)


class _Course:
    """One block's way through the run."""

    def __init__(self, body: FloatArray, rotation: float, pieces: FloatArray, times: FloatArray) -> None:
        self.body = body
        self.states = np.zeros((times.size, STATE_SIZE))
        self.end = visit(body, initial_state(body, rotation), pieces, times, self.states, *scratch())

    def ask(self, stops: list[Stop], which: NDArray[np.intp]) -> tuple[Asked, Codes]:
        """Return what the contact has to bear in the stops decided at times `which`, and their outcomes."""
        rows, offsets = laid(stops)
        outcomes: Codes = np.zeros(len(stops), dtype=np.uint8)
        contact = np.zeros(4)
        stop_outcomes(self.body, self.states[which], rows, offsets, outcomes, contact, *scratch())
        return Asked(*map(float, contact.tolist())), outcomes


def _neighbours(body: FloatArray) -> tuple[FloatArray, FloatArray]:
    finer, larger = body.copy(), body.copy()
    finer[TOLERANCE], finer[STRIDE] = 1e-16, 0.53
    larger[[ALPHA, P, RESTITUTION]] *= 1.0 + 2.0**-52
    larger[RESTITUTION] = min(larger[RESTITUTION], 1.0)
    return finer, larger
