"""Which impacts of two runs are the same ones, and how far their clocks are apart."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.rocking_data.noise import FloatArray

IntArray = NDArray[np.int64]

STRONGEST = 60
"""Impacts of each run whose differences are tried as shifts: the fastest ones."""
SHORTLIST = 24
"""Shifts at which the rotations are compared."""
GRID = 5e-3
"""Step at which they are, s."""
CLOSE = 0.1
"""Impacts brought together to within this part of the flight beside them count in full towards a shift, and nothing at
three times that."""
ALIKE = 0.2
"""Natural logarithm of the ratio of two rates at which their likeness is a half."""
REACH = 0.4
"""An impact matches the one expected at its place to within this part of the shorter flight beside it."""
TREND, STEEPEST = 4, 0.5
"""Pairs that say how the difference goes on, and its largest change, s per s."""
CERTAIN = 4.0
"""A drift is one where it is so many times its own error."""
RIVAL = 0.1
"""A second shift whose likeness is no more than this behind the best makes the alignment ambiguous."""


class Rocking(NamedTuple):
    """One run: its rotation, and the impacts in it.

    Attributes
    ----------
    clock, rotation : ndarray, shape (m,)
        s, increasing; rad, finite.
    time : ndarray, shape (n,)
        Impacts, s, increasing.
    direction : ndarray of int
        Of the impacts, +1 or -1.
    rate : ndarray
        |Angular velocity| before them, rad/s, finite.
    """

    clock: FloatArray
    rotation: FloatArray
    time: FloatArray
    direction: IntArray
    rate: FloatArray


class Matches(NamedTuple):
    """Pairs of impacts, by index, in order; and those without a partner."""

    first: IntArray
    second: IntArray
    only_first: IntArray
    only_second: IntArray


class Shift(NamedTuple):
    """How much later the second run's clock shows the same impact.

    Attributes
    ----------
    seconds : float
        Time of the second run minus time of the first; 0 where nothing can be aligned.
    likeness : float
        Of the two rotations when shifted so: 1 where they are equal, 0 where they have nothing in common.
    rival : float or None
        Another shift that does nearly as well (`RIVAL`), s: a periodic motion looks the same a period later.
    matches : Matches
        The impacts it pairs.
    """

    seconds: float
    likeness: float
    rival: float | None
    matches: Matches


def estimate_shift(one: Rocking, two: Rocking) -> Shift:
    """Return the shift that brings the most impacts of `one` onto impacts of `two`.

    Every difference between one of the `STRONGEST` impacts of one run and of the other, of the same direction, is a
    candidate: where either run misses impacts, or has some too many, the right one is still among them. Each is scored
    by the impacts it brings together, weighted by the squares of their rates (the energies) and by how alike those are.
    Of the best of these the one is taken that makes the rotations most alike, and of equally good ones the smallest:

        likeness = 2 sum(theta_1 theta_2) / (sum(theta_1^2) + sum(theta_2^2))

    over all samples, with zeros where one run was not recorded. It is then set to the median difference of the fastest
    quarter of the impacts it pairs (`match`): in a decay those are the early ones, which a difference in restitution
    has moved least. Where even those drift, it is what a straight line through the first four of them says
    of the first.
    """
    nothing = Shift(0.0, 0.0, None, match(one, two, 0.0))
    if not one.time.size or not two.time.size:
        return nothing
    a, b = _strongest(one), _strongest(two)
    apart = two.time[None, b] - one.time[a, None]
    candidates = np.unique(apart[one.direction[a, None] == two.direction[None, b]])
    if not candidates.size:
        return nothing
    candidates = candidates[np.argsort(np.abs(candidates), kind="stable")]
    # Of the fast impacts: those at the end of a decay are close together.
    spacing = float(np.median(_flights(one.time)[a[: max(3, a.size // 4)]]))
    chosen = _apart_by(candidates, np.array([_score(one, two, shift) for shift in candidates]), 0.3 * spacing)
    curves = _resampled(one, two)
    scores = np.array([_likeness(*curves, shift) for shift in chosen])
    best = int(np.argmax(scores >= np.max(scores) - 1e-9))
    pairs = match(one, two, chosen[best])
    if not pairs.first.size:
        return nothing
    rivals = np.flatnonzero((scores >= scores[best] - RIVAL) & (np.abs(chosen - chosen[best]) > spacing))
    rival = float(chosen[rivals[np.argmax(scores[rivals])]]) if rivals.size else None
    return Shift(_typical(one, two, pairs), float(scores[best]), rival, pairs)


def match(one: Rocking, two: Rocking, shift: float) -> Matches:
    """Pair the impacts of two runs, following them as they drift apart.

    From the first impact on, each one of `one` is expected at its time plus the shift, later plus the difference of the
    pairs before, which goes on changing as it did over the last `TREND` of them: small differences in restitution add
    up, and the twentieth impacts may lie further apart than two neighbours do. The nearest impact of `two` of the same
    direction and not yet taken is its partner where it is within `REACH` of the shorter flight beside it.
    """
    flights_one, flights_two = _flights(one.time), _flights(two.time)
    first: list[int] = []
    second: list[int] = []
    times, directions = two.time.tolist(), two.direction.tolist()
    low = 0
    for i, (time, direction) in enumerate(zip(one.time.tolist(), one.direction.tolist(), strict=True)):
        expected = time + _drift(one.time, two.time, first, second, time, shift)
        best, nearest = -1, np.inf
        for j in range(low, len(times)):
            if times[j] - expected > nearest:
                break
            if directions[j] == direction and abs(times[j] - expected) < nearest:
                best, nearest = j, abs(times[j] - expected)
        if best >= 0 and nearest <= REACH * min(flights_one[i], flights_two[best]):
            first.append(i)
            second.append(best)
            low = best + 1
        while low < len(times) and times[low] < expected - REACH * flights_one[i]:
            low += 1
    alone_one = np.setdiff1d(np.arange(one.time.size), first)
    alone_two = np.setdiff1d(np.arange(two.time.size), second)
    return Matches(np.array(first, dtype=np.int64), np.array(second, dtype=np.int64), alone_one, alone_two)


def _drift(one: FloatArray, two: FloatArray, first: list[int], second: list[int], time: float, shift: float) -> float:
    """Return how much later the second run's impact is expected than the first one's at `time`, s."""
    if not first:
        return shift
    i, j = first[-1], second[-1]
    latest = float(two[j] - one[i])
    if len(first) == 1:
        return latest
    k, m = first[-min(len(first), TREND)], second[-min(len(first), TREND)]
    slope = (latest - float(two[m] - one[k])) / float(one[i] - one[k])
    return latest + min(max(slope, -STEEPEST), STEEPEST) * (time - float(one[i]))


def _strongest(run: Rocking) -> IntArray:
    return np.argsort(-run.rate, kind="stable")[:STRONGEST]


def _flights(time: FloatArray) -> FloatArray:
    """Return the shorter flight beside each impact, s; one impact alone has a second to itself."""
    apart = np.diff(time)
    if not apart.size:
        return np.ones(time.size)
    return np.minimum(np.append(apart, apart[-1]), np.insert(apart, 0, apart[0]))


def _partners(one: Rocking, two: Rocking, shift: float) -> tuple[IntArray, FloatArray]:
    """Return the nearest impact of `two` of the same direction for each of `one`, and how much later it is, s."""
    nearest = np.zeros(one.time.size, dtype=np.int64)
    apart = np.full(one.time.size, np.inf)
    for direction in (-1, 1):
        mine, theirs = np.flatnonzero(one.direction == direction), np.flatnonzero(two.direction == direction)
        if not mine.size or not theirs.size:
            continue
        expected = one.time[mine] + shift
        right = np.clip(np.searchsorted(two.time[theirs], expected), 0, theirs.size - 1)
        left = np.maximum(right - 1, 0)
        closer = np.abs(two.time[theirs[left]] - expected) <= np.abs(two.time[theirs[right]] - expected)
        nearest[mine] = theirs[np.where(closer, left, right)]
        apart[mine] = two.time[nearest[mine]] - expected
    return nearest, apart


def _score(one: Rocking, two: Rocking, shift: float) -> float:
    nearest, apart = _partners(one, two, shift)
    far = np.abs(apart) / (CLOSE * _flights(one.time))
    return float(np.sum(_alike(one.rate, two.rate[nearest]) * np.clip(1.5 - 0.5 * far, 0.0, 1.0)))


def _resampled(one: Rocking, two: Rocking) -> tuple[FloatArray, FloatArray, Rocking]:
    """Return the first run on an even grid: times and rotations; and the second."""
    grid = np.arange(one.clock[0], one.clock[-1], GRID)
    return grid, np.interp(grid, one.clock, one.rotation), two


def _likeness(grid: FloatArray, rotation: FloatArray, two: Rocking, shift: float) -> float:
    other = np.interp(grid + shift, two.clock, two.rotation, left=0.0, right=0.0)
    # The whole of the second run, not only what the first one's grid meets.
    outside = (two.clock < grid[0] + shift) | (two.clock > grid[-1] + shift)
    steps = np.diff(two.clock, append=two.clock[-1])
    rest = float(np.sum((two.rotation**2 * steps)[outside])) / GRID
    whole = float(np.sum(rotation**2) + np.sum(other**2)) + rest
    return 2.0 * float(np.sum(rotation * other)) / max(whole, 1e-300)


def _alike(one: FloatArray, two: FloatArray) -> FloatArray:
    """Return the square of the smaller of two rates: in full where they are equal, half of it `ALIKE` apart."""
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.log(one / two) / ALIKE
    return np.nan_to_num(np.minimum(one, two) ** 2 / (1.0 + ratio**2))


def _apart_by(candidates: FloatArray, scores: FloatArray, least: float) -> FloatArray:
    """Return the best candidates, at most `SHORTLIST` of them and none closer than `least` to a better one."""
    chosen: list[float] = []
    for index in np.argsort(-scores, kind="stable"):
        shift = float(candidates[index])
        if all(abs(shift - other) >= least for other in chosen):
            chosen.append(shift)
        if len(chosen) == SHORTLIST:
            break
    return np.array(sorted(chosen, key=abs))


def _typical(one: Rocking, two: Rocking, pairs: Matches) -> float:
    rate = np.minimum(one.rate[pairs.first], two.rate[pairs.second])
    fastest = np.sort(np.argsort(-rate, kind="stable")[: max(4, -(-rate.size // 4))])
    time = one.time[pairs.first[fastest]]
    apart = two.time[pairs.second[fastest]] - time
    slope, error, _ = _line(time, apart)
    if fastest.size >= 4 and abs(slope) > CERTAIN * error:
        # The drift itself grows: only the first of them say where it began.
        return _line(time[:4], apart[:4])[2]
    return float(np.median(apart))


def _line(time: FloatArray, apart: FloatArray) -> tuple[float, float, float]:
    """Return slope of the straight line through (time, apart), its standard error, and its value at the first time."""
    later = time - np.mean(time)
    spread = float(np.sum(later**2))
    if time.size < 3 or spread == 0.0:
        return 0.0, np.inf, float(apart[0])
    slope = float(np.sum(later * apart)) / spread
    left = apart - np.mean(apart) - slope * later
    error = float(np.sqrt(np.sum(left**2) / (time.size - 2) / spread))
    return slope, error, float(np.mean(apart) + slope * later[0])
