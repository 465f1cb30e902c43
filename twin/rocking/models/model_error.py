"""A bound of how far a simpler model's run is from the nonlinear one, found without solving the nonlinear equation.

The run is gone through contact by contact: the difference of the two is carried over each flight and through the
contact that ends it (`flight_error`), and from the first contact on a still base down to rest in one go
(`free_tail`). A run that cannot be shown to go the same way, with the same contacts in the same order and
without overturning, has no bound; `Unbounded` says why.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import LINEARISED, QUASI_LINEAR, Problem, Solution
from twin.rocking.models.defect import HIGHEST, LOWEST, PADDING
from twin.rocking.models.flight_error import Contact, Unbounded, carry_flight
from twin.rocking.models.free_tail import SLOWEST, free_tail
from twin.rocking.series import base_acceleration
from twin.rocking.uplift import first_uplift

STILL = 1e-12
"""A base motion below this share of g tan(alpha) is rounding."""
MOST_CONTACTS = 400


@dataclass(frozen=True, slots=True)
class ModelError:
    """Bounds of relative errors: of the peak rotation; of the times of all impacts and of rest, from uplift on."""

    peak: float
    times: float

    @property
    def largest(self) -> float:
        """The larger of the two."""
        return max(self.peak, self.times)


def percent(value: float) -> str:
    """Return a share as text: two digits."""
    return "more than 100 %" if value > 1.0 else f"{100.0 * value:.2g} %"


def model_error(problem: Problem, solution: Solution, allowed: float = math.inf) -> ModelError:
    """Return bounds of the relative errors of `solution`, of a simpler model, against the nonlinear motion.

    Parameters
    ----------
    problem : Problem
        With `model` the simpler one, and no `end`.
    solution : Solution
        The simpler model's answer to it.
    allowed : float
        Relative error beyond which nothing more is looked at.

    Raises
    ------
    Unbounded
        Where the two runs may differ in kind, or in their times by more than `allowed`.
    ValueError
        Where the model is not a simpler one.
    """
    if problem.model not in (LINEARISED, QUASI_LINEAR):
        raise ValueError(f"{problem.model} is no simpler model")
    if solution.overturned is not False:
        raise Unbounded("overturns, or nearly does, and a fall is no small rotation")
    if solution.uplift_time is None:
        raise Unbounded("never lifts")
    pieces = np.vstack([problem.pieces, [[problem.shaking, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0]]])
    lengths = np.append(pieces[:-1, 1] - pieces[:-1, 0], 0.0)
    top = np.abs(pieces[:, 2]) + np.abs(pieces[:, 3]) * lengths + np.abs(pieces[:, 4])
    walk = _Walk(problem, solution, allowed, pieces, top > STILL * problem.block.uplift_acceleration, np.zeros(2))
    contact = walk.start()
    for index in range(min(len(solution.impact_times), MOST_CONTACTS) + 1):
        if walk.still(contact) or (index and contact.rate == 0.0):
            return walk.finish(contact)
        if index == len(solution.impact_times):
            break
        contact, lost = carry_flight(problem, pieces, solution, index, contact, walk.peaks)
        walk.compare(
            np.array([contact.time]),
            np.array([contact.delta - contact.rho_delta]),
            np.array([contact.delta + contact.rho_delta]),
        )
        if lost is not None:
            raise Unbounded(lost)
    raise Unbounded("goes on rocking while the base moves")


@dataclass(slots=True)
class _Walk:
    problem: Problem
    solution: Solution
    allowed: float
    pieces: FloatArray
    active: NDArray[np.bool_]
    peaks: FloatArray
    uplift: float = 0.0
    worst: float = 0.0

    def start(self) -> Contact:
        problem, block = self.problem, self.problem.block
        p = block.frequency_parameter
        if problem.rotation != 0.0 or problem.rate != 0.0:
            side = math.copysign(1.0, problem.rotation if problem.rotation != 0.0 else problem.rate)
            self.peaks[:] = abs(problem.rotation)
            return Contact(0.0, side, side * problem.rate / p)
        linear = problem.model == LINEARISED
        threshold = block.gravity * block.slenderness if linear else block.uplift_acceleration
        simple, side = _uplift(self.pieces, threshold)
        self.uplift, other = _uplift(self.pieces, block.uplift_acceleration)
        known = self.solution.uplift_time or 0.0
        if side != other or abs(simple - known) > 1e-9 * (known + 1.0 / p):
            raise Unbounded("lifts on another swing of the base than the nonlinear one")
        return Contact(simple, side, 0.0, delta=p * (self.uplift - simple))

    def compare(self, times: FloatArray, least: FloatArray, greatest: FloatArray) -> None:
        """Take note of the impacts at `times` (s) whose errors are bounded (1/p)."""
        p = self.problem.block.frequency_parameter
        errors = PADDING * np.maximum(np.abs(least), np.abs(greatest)) / p
        known = times - self.uplift - errors
        relative = np.where(known > 0.0, errors / np.maximum(known, 1e-300), math.inf)
        self.worst = max(self.worst, float(np.max(relative)))
        if self.worst > self.allowed:
            raise Unbounded(f"may be off by {percent(self.worst)} in its impact times")

    def still(self, at: Contact) -> bool:
        """Tell whether both blocks are on the base, and that keeps still around their contacts."""
        if at.time == 0.0 and self.problem.rotation != 0.0:
            return False
        p = self.problem.block.frequency_parameter
        lags = np.array([min(0.0, at.delta - at.rho_delta), max(0.0, at.delta + at.rho_delta)])
        first, last = np.searchsorted(self.pieces[1:, 0], at.time + lags / p, side="right").tolist()
        return not bool(self.active[first : last + 1].any())

    def finish(self, at: Contact) -> ModelError:
        """Compare the impacts left, on a still base, and see that nothing lifts the block again."""
        p = self.problem.block.frequency_parameter
        rest = at.time
        if at.rate > 0.0:
            slack = PADDING * at.rho_nu
            low, high = at.rate + at.nu - slack, at.rate + at.nu + slack
            quasi = self.problem.model == QUASI_LINEAR
            tail = None
            if low > SLOWEST:
                tail = free_tail(self.problem.block.slenderness, self.problem.eta, at.rate, low, high, quasi=quasi)
            if tail is None:
                raise Unbounded("leaves the base too near the rate that overturns it, or hardly leaves it")
            least = tail.least + at.delta - at.rho_delta
            greatest = tail.greatest + at.delta + at.rho_delta
            times = at.time + tail.simple / p
            self.compare(times, least, greatest)
            rest = float(times[-1] + PADDING * max(0.0, greatest[-1]) / p) if self.problem.eta < 1.0 else math.inf
            self.peaks[HIGHEST] = max(self.peaks[HIGHEST], tail.highest)
            self.peaks[LOWEST] = max(self.peaks[LOWEST], tail.lowest)
        self._see_it_rests(at, rest)
        lowest, peak = float(self.peaks[LOWEST]), self.solution.peak
        spread = PADDING * max(float(self.peaks[HIGHEST]) - peak, peak - lowest) + self.solution.error
        return ModelError(math.inf if lowest <= 0.0 else spread / lowest, self.worst)

    def _see_it_rests(self, at: Contact, rest: float) -> None:
        """See that the base keeps still until both blocks rest, at `rest` (s) or before, and lifts neither later."""
        block = self.problem.block
        earliest = at.time + min(0.0, at.delta - at.rho_delta) / block.frequency_parameter
        here = int(np.searchsorted(self.pieces[1:, 0], earliest, side="right"))
        later = np.nonzero(self.active[here:])[0] + here
        if at.rate > 0.0 and later.size and self.pieces[later[0], 0] < rest:
            raise Unbounded("is not at rest when the base moves again")
        threshold = block.gravity * block.slenderness
        for row in self.pieces[later]:
            if first_uplift(row, max(float(row[0]), earliest), float(row[1]), threshold) >= 0.0:
                raise Unbounded("may be lifted a second time")


def _uplift(pieces: FloatArray, threshold: float) -> tuple[float, float]:
    """Return when |a| first passes the threshold, s, and the side the block then leans to; infinite where never."""
    for row in pieces[:-1]:
        t = first_uplift(row, float(row[0]), float(row[1]), threshold)
        if t >= 0.0:
            return t, -1.0 if base_acceleration(row, t) > 0.0 else 1.0
    return math.inf, 0.0
