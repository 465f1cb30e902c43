"""A group of sixteen futures along a course of the base, to its end, and what becomes of them on a still base."""

from __future__ import annotations

import math

from twin.forecast.compiled import lent
from twin.forecast.course import LENGTH, LONGEST, START, STRONGEST
from twin.forecast.step import (
    ALPHA,
    FALLEN,
    FELL_AT,
    OFFSET,
    PHI,
    RATE,
    RESTITUTION,
    ROCKED,
    SIDE,
    THRESHOLD,
    advance,
    lift,
)
from twin.rocking.batch.lanes import WIDTH, above, load, magnitude, marked, smaller, spread, store
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.equations import FULL_EQUATION
from twin.rocking.methods.flight import fall, strike

# Impacts followed within one interval. A lane that has more is left on the contact to the interval's end.
MOST_ROUNDS = 16
# Intervals at rest that cost as much as a step.
IDLE = 16
ALL_LANES = 2**WIDTH - 1
# What a future leaves: margin, time of pi/2 (1/p; infinite where it stands), whether it rocked.
MARGIN, FALL, ROCKS = range(3)
RESULTS = 3


@lent
def march(m: FloatArray, course: FloatArray, first: int, last: int, budget: int) -> tuple[int, int]:
    """Take a group through the intervals `first` to `last` - 1, at most about `budget` steps of sixteen lanes.

    Parameters
    ----------
    m : ndarray, shape (ROWS, WIDTH)
        The group; `OFFSET` holds how far into the interval `first` each lane is.
    course : ndarray, shape (n, COLUMNS)
        See `twin.forecast.course`.

    Returns
    -------
    tuple of int
        The interval to go on from (`last` where the group is done) and the steps taken; one with an impact counts
        twice, as it costs.
    """
    steps = 0
    idle = 0
    least = lowest_threshold(m)
    here = first
    while here < last:
        if steps >= budget:
            return here, steps
        if marked(load(m, FALLEN)) == ALL_LANES:
            return last, steps
        taken, done = cross(m, course[here], least, budget - steps)
        # An interval that all of them rest through costs a share of a step.
        idle += taken == 0
        if idle == IDLE:
            idle = 0
            taken = 1
        steps += taken
        here += done
    return last, steps


@lent
def lowest_threshold(m: FloatArray) -> float:
    """Return the least |a| / g that lifts any of the group."""
    least = math.inf
    for lane in range(WIDTH):
        least = min(least, m[THRESHOLD, lane])
    return least


@lent
def cross(m: FloatArray, row: FloatArray, least: float, budget: int) -> tuple[int, int]:
    """Take a group to the end of an interval; return the steps taken, and 1, or 0 where `budget` steps end before.

    Only an interval of a still base is left half-way, each lane where its `OFFSET` says.
    """
    zero = spread(0.0)
    steps = 0
    # Without a push strong enough the resting lanes stay as they are.
    strong = row[STRONGEST] > least
    if strong or marked(smaller(1.0 - load(m, FALLEN), above(magnitude(load(m, SIDE)), zero))):
        still = row[STRONGEST] == 0.0
        most = budget if still else MOST_ROUNDS
        on = 0
        for _ in range(most):
            lifted = lift(m, row, row[LENGTH]) if strong else 0
            on, struck = advance(m, row, row[START], row[LENGTH])
            on |= lifted
            steps += 1 if struck == 0 else 2
            if on == 0:
                break
        if still and on != 0:
            return steps, 0
    store(m, OFFSET, zero)
    return steps, 1


@lent
def conclude(m: FloatArray, end: float, results: FloatArray, first: int) -> None:
    """Write what becomes of a group when the base stays still from `end` (1/p) on: rows `first` on of `results`."""
    for lane in range(WIDTH):
        result = results[first + lane]
        result[ROCKS] = m[ROCKED, lane]
        if m[FALLEN, lane] != 0.0:
            result[MARGIN] = -1.0
            result[FALL] = m[FELL_AT, lane]
            continue
        alpha = m[ALPHA, lane]
        eta = m[RESTITUTION, lane]
        result[FALL] = math.inf
        if m[SIDE, lane] == 0.0:
            result[MARGIN] = 1.0
            continue
        psi = alpha - m[PHI, lane]
        v = m[RATE, lane]
        ahead, around = energy_margins(alpha, eta, psi, v)
        result[MARGIN] = max(min(ahead, around), -1.0)
        if ahead < 0.0:
            result[FALL] = end + fall(FULL_EQUATION, alpha, psi, v)
        elif around < 0.0:
            time, rate, _ = strike(FULL_EQUATION, alpha, psi, v)
            result[FALL] = end + time + fall(FULL_EQUATION, alpha, alpha, eta * rate)


@lent
def energy_margins(alpha: float, eta: float, psi: float, v: float) -> tuple[float, float]:
    """Return the energy that is missing to each of the two barriers, over the barrier's height; negative beyond.

    With W the energy above that of the block standing on its base and B = 1 - cos(alpha) the height of the barrier,
    both in units of (4/3) m R^2 p^2, the way ahead misses (1 - cos(psi)) - v^2 / 2 = B - W, with the sign of psi and of
    v where they are negative, and the way round, after an impact, B - eta^2 W. Their signs are those of
    `twin.rocking.verdict.barrier_margins`: it overturns where either is below zero.
    """
    base = math.sin(0.5 * alpha)
    half = math.sin(0.5 * psi)
    barrier = 2.0 * base * base
    ahead = 2.0 * half * abs(half) - 0.5 * v * abs(v)
    energy = 0.5 * v * v + 2.0 * (base - half) * (base + half)
    return ahead / barrier, 1.0 - eta * eta * energy / barrier


@lent
def trace(
    m: FloatArray,
    course: FloatArray,
    first: int,
    now: float,
    until: float,
    times: FloatArray,
    rotations: FloatArray,
    lane: int,
) -> int:
    """Follow a group from `now` to `until` (1/p), over the end of the course and a still base, and write where it is.

    Parameters
    ----------
    times : ndarray, shape (n,)
        Written: ends of intervals, 1/p.
    rotations : ndarray, shape (n, lanes)
        Written from column `lane` on: signed rotations there, rad.

    Returns
    -------
    int
        Rows written; less than all of them where `until` comes first.
    """
    least = lowest_threshold(m)
    last = course.shape[0] - 1
    here = first
    n = 0
    begun = course[here, START] if here < last else now
    # All lanes are as far into the first interval.
    gone = m[OFFSET, 0]
    end = begun + gone
    while n < times.size and end < until:
        row = course[min(here, last)]
        length = row[LENGTH] if here < last else math.inf
        # A still interval may be a long one.
        part = min(length, gone + LONGEST) if row[STRONGEST] == 0.0 else length
        for _ in range(MOST_ROUNDS):
            lifted = lift(m, row, part) if row[STRONGEST] > least else 0
            on, _ = advance(m, row, begun, part)
            if (on | lifted) == 0:
                break
        gone = part
        end = begun + gone
        if gone >= length:
            begun = end
            gone = 0.0
            here += 1
        store(m, OFFSET, spread(gone))
        times[n] = end
        for k in range(WIDTH):
            rotations[n, lane + k] = m[SIDE, k] * m[PHI, k]
        n += 1
    return n
