"""A forecast in work: two branches of 32 futures, as far as a cycle's share of steps takes them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.forecast.compiled import compiled
from twin.forecast.course import K0, K1, LENGTH, LONGEST, START, STRONGEST
from twin.forecast.ensemble import FUTURES, GROUPS, draw, place, square_root
from twin.forecast.futures import FALL, MARGIN, ROCKS, conclude, cross, lowest_threshold, march, trace
from twin.forecast.ramp import interval_at, lay_ramp
from twin.forecast.step import OFFSET
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.compiled import FloatArray

Numbers = NDArray[np.int64]

BRANCHES = 2
ALL_GROUPS = BRANCHES * GROUPS
NO_LIMIT = 2**31
# What a branch comes to: margin of the estimate, whether it rocks, its time of pi/2; how many futures overturn, and the
# first and the last of these times; 1/p, NaN where none does.
OUTLOOK = 6


@compiled
def renew(
    known: FloatArray,
    covariance: FloatArray,
    z: FloatArray,
    fresh: bool,
    tau: float,
    sample: FloatArray,
    p: float,
    gravity: float,
    root: FloatArray,
    row: FloatArray,
    futures: FloatArray,
) -> None:
    """Bring the futures to `tau` (1/p): drawn anew where `fresh`, else carried over the last sample.

    Parameters
    ----------
    sample : ndarray, shape (3,)
        Its length s, and the base acceleration at both ends, m/s2.
    root, row : ndarray, shape (4, 4) and (COLUMNS,)
        Room to work in.
    futures : ndarray, shape (GROUPS, ROWS, WIDTH)
        Changed; the first of them is the estimate itself.
    """
    if fresh:
        square_root(covariance, root)
        draw(known, root, z, tau, futures)
        return
    parts = math.ceil(p * sample[0] / LONGEST)
    h = 0.0 if parts == 0 else p * sample[0] / parts
    for part in range(parts):
        row[:] = 0.0
        row[START] = tau - (parts - part) * h
        row[LENGTH] = h
        row[K0] = (sample[1] + (sample[2] - sample[1]) * part / parts) / gravity
        row[K1] = (sample[2] - sample[1]) / gravity / (p * sample[0])
        row[STRONGEST] = max(abs(sample[1]), abs(sample[2])) / gravity
        for group in range(GROUPS):
            cross(futures[group], row, lowest_threshold(futures[group]), NO_LIMIT)
    place(futures[0], 0, known[0], known[1], known[2], known[3], known[4], tau)


@compiled
def begin(
    futures: FloatArray,
    tau: float,
    act: float,
    course: FloatArray,
    loop: FloatArray,
    stop: FloatArray,
    p: float,
    gravity: float,
    groups: FloatArray,
    ramp: FloatArray,
    at: Numbers,
    most: int,
) -> None:
    """Lay out both branches from the futures at `tau`; the ramp acts from `act` on (1/p).

    `at` holds the next interval of each group, then the plan's last that is looked at (at most `most` from now), and
    the ramp's last.
    """
    first = interval_at(course, tau)
    rows = lay_ramp(course, first, tau, act, loop, stop, p, gravity, ramp)
    groups[:GROUPS] = futures
    groups[GROUPS:] = futures
    for group in range(ALL_GROUPS):
        at[group] = first if group < GROUPS else 0
        begun = course[first, START] if group < GROUPS else ramp[0, START]
        for lane in range(WIDTH):
            groups[group, OFFSET, lane] = max(0.0, tau - begun)
    at[ALL_GROUPS] = min(course.shape[0] - 1, first + most)
    at[ALL_GROUPS + 1] = rows - 1


@compiled
def proceed(
    tau: float,
    course: FloatArray,
    ramp: FloatArray,
    groups: FloatArray,
    at: Numbers,
    budget: int,
    results: FloatArray,
    outlooks: FloatArray,
) -> int:
    """Go on, with what began at `tau`, by about `budget` steps of sixteen futures.

    Parameters
    ----------
    results : ndarray, shape (BRANCHES FUTURES, RESULTS)
        Room for what becomes of each future.
    outlooks : ndarray, shape (BRANCHES, OUTLOOK)
        Written where all is done.

    Returns
    -------
    int
        Steps left; below 0 where there is more to do.
    """
    for group in range(ALL_GROUPS):
        rows = course if group < GROUPS else ramp
        last = at[ALL_GROUPS] if group < GROUPS else at[ALL_GROUPS + 1]
        if at[group] > last:
            continue
        here, steps = march(groups[group], rows, at[group], last, budget)
        budget -= steps
        at[group] = here
        if here < last:
            return -1
        conclude(groups[group], max(tau, rows[last, START]), results, group * WIDTH)
        at[group] = last + 1
    for branch in range(BRANCHES):
        _sum_up(results[branch * FUTURES : (branch + 1) * FUTURES], outlooks[branch])
    return max(budget, 0)


@compiled
def _sum_up(results: FloatArray, outlook: FloatArray) -> None:
    """Write what the futures of one branch come to."""
    falls = 0
    earliest = math.nan
    latest = math.nan
    for k in range(results.shape[0]):
        if results[k, MARGIN] < 0.0:
            fall = results[k, FALL]
            earliest = fall if falls == 0 else min(earliest, fall)
            latest = fall if falls == 0 else max(latest, fall)
            falls += 1
    outlook[0] = results[0, MARGIN]
    outlook[1] = results[0, ROCKS]
    outlook[2] = results[0, FALL] if results[0, MARGIN] < 0.0 else math.nan
    outlook[3] = falls
    outlook[4] = earliest
    outlook[5] = latest


@compiled
def fan(
    futures: FloatArray, tau: float, until: float, course: FloatArray, times: FloatArray, rotations: FloatArray
) -> int:
    """Write the futures' rotations at the ends of the intervals from `tau` to `until` (1/p); see `futures.trace`.

    `futures` is changed.
    """
    first = interval_at(course, tau)
    rows = 0
    for group in range(GROUPS):
        for lane in range(WIDTH):
            # Past the course's end every interval is a still one that begins now.
            futures[group, OFFSET, lane] = max(0.0, tau - course[first, START]) if first < course.shape[0] - 1 else 0.0
        rows = trace(futures[group], course, first, tau, until, times, rotations, group * WIDTH)
    return rows
