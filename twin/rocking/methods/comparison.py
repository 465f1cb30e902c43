"""A run of a method with a known order beside a coarser one: the error it states, and the verdict it can answer for.

The difference of the two runs, over 2^order - 1, is the error of the finer one (L. F. Richardson 1911); twice that is
stated. The verdict follows from the distance to the barriers at the end of the excitation, and is None where that
distance is not beyond what changed from run to run, or where the two runs have parted: that both fall then means
nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.equations import margins
from twin.rocking.methods.judgement import sorted_events
from twin.rocking.methods.problem import History, Problem, Solution
from twin.rocking.run import initial_state
from twin.rocking.state import ALPHA, PEAK, PSI, RATE, RESTITUTION, SIDE, TIME

SAMPLES = 257
# Runs that differ by more than this share of the slenderness tell nothing of each other.
LARGEST_SHARE = 0.02


@dataclass(frozen=True, slots=True)
class Track:
    """One run: state and whether it had fallen when the base came to stand still, and at the end."""

    model: int
    body: FloatArray
    at_standstill: FloatArray
    fallen_before: bool
    state: FloatArray
    fallen: bool
    events: FloatArray
    history: History

    def margins(self) -> tuple[float, float]:
        """Return the distances beyond the two barriers, units of p, when the base came to stand still."""
        state = self.at_standstill
        if self.fallen_before:
            return math.inf, math.inf
        if state[SIDE] == 0.0:
            return -1.0, -1.0
        alpha, eta = float(self.body[ALPHA]), float(self.body[RESTITUTION])
        return margins(self.model, alpha, eta, float(state[PSI]), float(state[RATE]))


def begin(problem: Problem, body: FloatArray, equilibrium: float) -> FloatArray:
    """Return the state at time 0, psi counted from the model's own equilibrium."""
    state = initial_state(body, problem.rotation, problem.rate)
    state[PSI] = equilibrium - abs(problem.rotation)
    return state


def verdict(fine: Track, coarse: Track) -> bool | None:
    """Return whether the block overturns, None where the two runs cannot tell."""
    if fine.fallen_before or coarse.fallen_before:
        return True if fine.fallen_before and coarse.fallen_before else None
    (ahead, around), (coarse_ahead, coarse_around) = fine.margins(), coarse.margins()
    if abs(ahead) <= 2.0 * abs(ahead - coarse_ahead) + 1e-14:
        return None
    if ahead > 0.0:
        return True
    if abs(around) <= 2.0 * abs(around - coarse_around) + 1e-14:
        return None
    return around > 0.0


def solution(problem: Problem, fine: Track, coarse: Track, order: float) -> Solution:
    """Return the finer run as the answer."""
    impacts, lift, rest = sorted_events(fine.events)
    started = problem.rotation != 0.0 or problem.rate != 0.0
    uplift = 0.0 if started else lift
    reached = float(fine.state[TIME])
    resting = not fine.fallen and bool(fine.state[SIDE] == 0.0)
    until = min(reached, float(coarse.state[TIME]))
    whole, upright = differences(fine, coarse, until)
    overturned = verdict(fine, coarse) if upright <= LARGEST_SHARE * float(fine.body[ALPHA]) else None
    return Solution(
        uplift_time=uplift,
        impact_times=impacts[0],
        impact_rates=impacts[1],
        rest_time=rest if resting and uplift is not None else None,
        overturning_time=reached if fine.fallen else None,
        side=int(fine.state[SIDE]) if fine.fallen else 0,
        overturned=overturned,
        resting=resting,
        peak=float(fine.state[PEAK]),
        error=2.0 * whole / (2.0**order - 1.0),
        end_time=math.inf if resting or fine.fallen else min(problem.end, max(reached, problem.shaking)),
        history=fine.history,
    )


def differences(fine: Track, coarse: Track, until: float) -> tuple[float, float]:
    """Return the largest difference of the rotations up to `until` (s), rad, and that while the finer is upright.

    Upright: below the slenderness angle. Beyond it every difference grows without deciding anything.
    """
    times = np.linspace(0.0, until, SAMPLES)
    rotation = fine.history.evaluate(times)[0]
    apart = np.abs(rotation - coarse.history.evaluate(times)[0])
    upright = np.abs(rotation) < float(fine.body[ALPHA])
    return float(np.max(apart)), float(np.max(apart, where=upright, initial=0.0))
