"""Every cycle: what becomes of the block if the planned motion goes on, and if the table is ramped down now."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from twin.forecast.advice import Advice, advise
from twin.forecast.course import COLUMNS, LONGEST, START, lay_course
from twin.forecast.ensemble import FUTURES, GROUPS, deviates
from twin.forecast.futures import RESULTS
from twin.forecast.job import ALL_GROUPS, BRANCHES, OUTLOOK, begin, fan, proceed, renew
from twin.forecast.loop import TableLoop
from twin.forecast.observer import Observer
from twin.forecast.ramp import RAMP_ROWS, RampDown, interval_at, lay_ramp
from twin.forecast.step import ROWS
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.block import Block
from twin.rocking.response import Outcome

if TYPE_CHECKING:
    from twin.rocking.compiled import FloatArray

STEPS_A_CYCLE = 1000
"""Steps of sixteen futures that a cycle takes on a forecast: some 60 us."""
LONGEST_AGE = 20
"""Cycles a forecast is spread over. Where one took longer, the next looks at less of the plan."""
MOST_INTERVALS = LONGEST_AGE * STEPS_A_CYCLE // 3
"""Intervals of the plan that are looked at: two groups of futures cross each, and a third is for impacts and ramp."""
TOO_CLOSE = 1e-3
"""A margin below this is within what the forecast's own error may change."""


@dataclass(frozen=True, slots=True)
class Branch:
    """One course of the base, and what becomes of the block on it.

    Attributes
    ----------
    outcome : Outcome
        Of the estimate itself; UNDECIDED where its margin is within the forecast's own error.
    margin : float
        Energy the estimate misses, once the base is still, to the barrier that decides, over the barrier's height: 1 at
        rest, 0 on the barrier, negative where it overturns, -1 at least; see `twin.forecast.futures.energy_margins`.
    probability : float
        Share of the 32 futures that overturn.
    overturning : float
        Time from the forecast's cycle until the estimate lies at pi/2, s; NaN where it does not.
    earliest, latest : float
        The same of the first and the last of the futures that overturn, s; NaN where none does.
    """

    outcome: Outcome
    margin: float
    probability: float
    overturning: float
    earliest: float
    latest: float


@dataclass(frozen=True, slots=True)
class Forecast:
    """What will happen next, seen from one instant.

    Attributes
    ----------
    time : float
        The instant, on the caller's clock, s.
    going_on, stopping : Branch
        The rest of the planned motion; a ramp-down decided at `time`.
    advice : Advice
    seen : float
        Time up to which the plan was looked at, s: its end, unless that is too far.
    age : float
        Time since `time`, s: 0 where the forecast was made within its cycle.
    """

    time: float
    going_on: Branch
    stopping: Branch
    advice: Advice
    seen: float
    age: float

    @property
    def no_return(self) -> bool:
        """Whether the last instant to save the block by ramping down has passed: it overturns either way."""
        return self.going_on.outcome is Outcome.OVERTURNED and self.stopping.outcome is Outcome.OVERTURNED


class Forecaster:
    """Forecasts along one planned motion, a call a cycle.

    Contract: no clock and no randomness beyond the seed, equal calls give equal bits; a call takes at most about
    `STEPS_A_CYCLE` steps of sixteen futures. A plan that needs more is spread over the following calls, at most
    `LONGEST_AGE`, and each then returns the last forecast that was finished, with its age.

    Parameters
    ----------
    block : Block
        The size of the estimated block; its slenderness and restitution come with each estimate.
    pieces : ndarray, shape (n, 7)
        The planned motion, see `excitation.Pulse.pieces`; no rows where the table stands still.
    stop : RampDown
    loop : TableLoop, optional
        How the table follows. None: exactly and at once.
    begins : float
        Time on the caller's clock at which the plan begins, s; nothing is expected to happen before.
    seed : int
        Of the futures' deviates.
    """

    def __init__(
        self,
        block: Block,
        pieces: FloatArray,
        stop: RampDown,
        *,
        loop: TableLoop | None = None,
        begins: float = 0.0,
        seed: int = 1,
    ) -> None:
        loop = TableLoop() if loop is None else loop
        self.stop = stop
        self._p = block.frequency_parameter
        self._gravity = block.gravity
        self._begins = begins
        self._acts = stop.reaction + loop.delay
        self._course = lay_course(pieces, loop, self._p, self._gravity)
        self._loop = np.array([loop.angular_frequency, loop.damping])
        limit = math.inf if stop.limit is None else stop.limit
        self._stop = np.array([stop.deceleration, limit, stop.steepest])
        self._deviates = deviates(seed)
        self._root = np.zeros((4, 4))
        self._row = np.zeros(COLUMNS)
        self._futures = np.zeros((GROUPS, ROWS, WIDTH))
        self._groups = np.zeros((ALL_GROUPS, ROWS, WIDTH))
        self._ramp = np.zeros((len(self._course) + RAMP_ROWS, COLUMNS))
        self._at = np.zeros(ALL_GROUPS + 2, dtype=np.int64)
        self._results = np.zeros((BRANCHES * FUTURES, RESULTS))
        self._outlooks = np.zeros((BRANCHES, OUTLOOK))
        self._most = MOST_INTERVALS
        self._cycles = 0
        self._busy = False
        self._drawn = False
        self._started = math.nan
        self._seen = math.nan
        self._last: Forecast | None = None

    def update(self, observer: Observer) -> Forecast | None:
        """Return the latest forecast from the observer's estimate; None until the first is finished.

        To be called once after each of the observer's updates.
        """
        self.follow(observer)
        time = observer.time
        if math.isnan(time):
            return None
        if not self._busy:
            self._begin(time)
        begun = self._p * (self._started - self._begins)
        left = proceed(
            begun,
            self._course,
            self._ramp,
            self._groups,
            self._at,
            STEPS_A_CYCLE,
            self._results,
            self._outlooks,
        )
        self._busy = left < 0
        self._cycles += 1
        if not self._busy:
            if self._cycles > LONGEST_AGE:
                self._most = self._most * LONGEST_AGE // (self._cycles + 1)
            self._last = self._finished(time)
        elif self._last is not None:
            last = self._last
            self._last = Forecast(last.time, last.going_on, last.stopping, last.advice, last.seen, time - last.time)
        return self._last

    def follow(self, observer: Observer) -> None:
        """Bring the futures to the observer's estimate, without a forecast; `update` does it by itself."""
        if math.isnan(observer.time):
            return
        renew(
            observer.estimate(),
            observer.covariance,
            self._deviates,
            observer.corrected or not self._drawn,
            self._p * (observer.time - self._begins),
            observer.sample,
            self._p,
            self._gravity,
            self._root,
            self._row,
            self._futures,
        )
        self._drawn = True

    def ramp_down(self, time: float) -> None:
        """Take a ramp-down that was decided at `time` (s) for the plan from now on; what was in work is dropped."""
        now, act = self._p * (time - self._begins), self._acting(time)
        if math.isinf(act):
            return
        first = interval_at(self._course, now)
        rows = lay_ramp(self._course, first, now, act, self._loop, self._stop, self._p, self._gravity, self._ramp)
        self._course = self._ramp[:rows].copy()
        self._busy = False

    def fan(self, observer: Observer, horizon: float = 3.0) -> tuple[FloatArray, FloatArray]:
        """Return how the futures go on with the plan after the last `follow`: for a picture, not for the cycle.

        Returns
        -------
        times : ndarray, shape (n,)
            s, on the caller's clock, as far apart as the forecast's intervals, at most 0.2 / p.
        rotations : ndarray, shape (32, n)
            rad, signed; the first row is the estimate's own.
        """
        p = self._p
        now = p * (observer.time - self._begins)
        room = len(self._course) + math.ceil(p * horizon / LONGEST) + 1
        times = np.zeros(room)
        rotations = np.zeros((room, FUTURES))
        rows = fan(self._futures.copy(), now, now + p * horizon, self._course, times, rotations)
        return times[:rows] / p + self._begins, np.ascontiguousarray(rotations[:rows].T)

    def _acting(self, time: float) -> float:
        """Return when a stop that is decided at `time` (s) acts, 1/p; infinite where nothing stops the table."""
        now, until = self._p * (time - self._begins), self.stop.until
        if until is None:
            return now + self._p * self._acts
        # A machine that is stopped before its release is not released.
        return min(now + self._p * self._acts, self._p * until) if now < self._p * until else math.inf

    def _begin(self, time: float) -> None:
        now, act = self._p * (time - self._begins), self._acting(time)
        begin(
            self._futures,
            now,
            max(now, float(self._course[-1, START])) if math.isinf(act) else act,
            self._course,
            self._loop,
            self._stop,
            self._p,
            self._gravity,
            self._groups,
            self._ramp,
            self._at,
            self._most,
        )
        self._cycles = 0
        self._started = time
        self._seen = float(self._course[self._at[ALL_GROUPS], START]) / self._p + self._begins

    def _finished(self, time: float) -> Forecast:
        going_on, stopping = map(self._branch, self._outlooks.tolist())
        advice = advise(going_on.probability, stopping.probability)
        return Forecast(self._started, going_on, stopping, advice, self._seen, time - self._started)

    def _branch(self, outlook: list[float]) -> Branch:
        margin, rocks, when, falling, earliest, latest = outlook
        p, offset = self._p, self._begins - self._started
        outcome = Outcome.OVERTURNED if margin < 0.0 else Outcome.ROCKED if rocks else Outcome.STAYED
        if abs(margin) < TOO_CLOSE:
            outcome = Outcome.UNDECIDED
        return Branch(outcome, margin, falling / FUTURES, when / p + offset, earliest / p + offset, latest / p + offset)


def warm_up() -> None:
    """Compile, or load, the machine code now rather than in the first cycle."""
    block = Block(0.06, 0.27)
    observer = Observer(block, initial_rotation=0.01)
    pieces = np.array([[0.0, 0.01, 3.0, 0.0, 0.0, 0.0, 0.0]])
    forecaster = Forecaster(block, pieces, RampDown(1.0, 0.1), loop=TableLoop(frequency=30.0, damping=0.8))
    for k in range(3):
        observer.update(1e-3 * k, 0.0, 0.01)
        forecaster.update(observer)
    forecaster.ramp_down(observer.time)
    forecaster.fan(observer, 0.1)
