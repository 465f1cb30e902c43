"""Time and rates of impacts by a local fit: two polynomials that meet at zero.

    theta(t) = r- tau + c- tau^2 + d- tau^3   for tau = t - t* < 0
    theta(t) = r+ tau + c+ tau^2 + d+ tau^3   for tau >= 0

with the impact's time t* and the rates r-, r+ before and after it among the unknowns: least squares by Gauss and
Newton, all impacts at once. Restitution is r+ / r-.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.rocking_data.noise import FloatArray

IntArray = NDArray[np.int64]

UNKNOWNS = 7
"""t*, then r, c, d before, then r, c, d after."""
CUBIC, QUADRATIC, LINEAR = 8, 4, 2
"""Samples on a side that a polynomial of that degree wants; a side with fewer than `LINEAR` is left out."""
FRACTIONS = (1.0, 0.6, 0.36, 0.22, 0.13, 0.08)
"""Windows tried, in parts of the half flight: the first whose residuals are explained by the noise is taken."""
CONFIDENCE = 2.0
"""Residuals are larger than the noise where their sum of squares exceeds it by so many of its own deviations."""
BLOCKS = 10
"""Residuals are also looked at as means over so many blocks: a curve that does not fit shows there long before it does
in single samples."""
MOST_SAMPLES = 200
"""Most samples on a side."""
ITERATIONS = 6
AT_ONCE = 300_000
"""Samples in one batch."""


class Windows(NamedTuple):
    """Which samples belong to each impact, and where its time may lie. One row an impact.

    Attributes
    ----------
    begin, last, first, end : ndarray of int, shape (n,)
        Samples `begin` to `last` are before the impact, `first` to `end` after it (both included); those between may
        be either. `end` < `first`: nothing after it is used.
    guess : ndarray, shape (n,)
        First estimate of the time, s.
    """

    begin: IntArray
    last: IntArray
    first: IntArray
    end: IntArray
    guess: FloatArray

    def at(self, rows: IntArray) -> Windows:
        """Return some of the rows."""
        return Windows(self.begin[rows], self.last[rows], self.first[rows], self.end[rows], self.guess[rows])


class Fitted(NamedTuple):
    """Unknowns of each impact and their covariance.

    `values`: shape (n, 7), in the order of `UNKNOWNS`, s and rad/s; NaN where a side has too few samples.
    `covariance`: shape (n, 7, 7). `samples`: how many were used.
    """

    values: FloatArray
    covariance: FloatArray
    samples: IntArray


def fit_impacts(time: FloatArray, rotation: FloatArray, windows: Windows, noise: float) -> Fitted:
    """Fit all impacts; `noise` is the standard deviation of one sample, rad.

    Each impact takes the longest window of `FRACTIONS` whose residuals are explained by the noise, and the shortest
    where none is. The covariance is that of least squares with the larger of the noise and the residuals' variance.
    """
    count = windows.guess.size
    values = np.full((count, UNKNOWNS), np.nan)
    covariance = np.full((count, UNKNOWNS, UNKNOWNS), np.nan)
    samples = np.zeros(count, dtype=np.int64)
    left = np.arange(count)
    for fraction in FRACTIONS:
        if not left.size:
            break
        here = shortened(windows.at(left), fraction)
        good = np.zeros(left.size, dtype=np.bool_)
        for rows in _batches(here):
            batch = here.at(rows)
            found, misfit, freedom, used, inverse = _gauss_newton(time, rotation, batch)
            variance = np.maximum(np.sum(misfit**2, axis=1) / np.maximum(freedom, 1), noise**2)
            good[rows] = _explained(misfit, freedom, used, noise)
            values[left[rows]] = found
            covariance[left[rows]] = inverse * variance[:, None, None]
            samples[left[rows]] = used
        left = left[~good]
    return Fitted(values, covariance, samples)


def shortened(windows: Windows, fraction: float) -> Windows:
    """Return windows with that part of their samples on each side, nearest the impact; never fewer than `CUBIC`."""
    before = windows.last - windows.begin + 1
    after = windows.end - windows.first + 1
    keep_before = np.minimum(np.maximum((fraction * before).astype(np.int64), np.minimum(before, CUBIC)), MOST_SAMPLES)
    keep_after = np.minimum(np.maximum((fraction * after).astype(np.int64), np.minimum(after, CUBIC)), MOST_SAMPLES)
    return windows._replace(begin=windows.last - keep_before + 1, end=windows.first + keep_after - 1)


def _explained(misfit: FloatArray, freedom: IntArray, used: IntArray, noise: float) -> NDArray[np.bool_]:
    """Return whether residuals, shape (k, m) with zeros behind the `used` first, are those of white noise."""
    if noise <= 0.0:
        return freedom < 1
    squares = np.sum(misfit**2, axis=1) / noise**2
    single = squares <= freedom + CONFIDENCE * np.sqrt(2.0 * np.maximum(freedom, 1))
    count, longest = misfit.shape
    column: IntArray = np.arange(longest, dtype=np.int64).reshape(1, longest)
    block: IntArray = np.minimum(column * BLOCKS // used.reshape(count, 1), BLOCKS - 1)
    place: IntArray = (np.arange(count, dtype=np.int64).reshape(count, 1) * BLOCKS + block).ravel()
    sums = np.bincount(place, misfit.ravel(), count * BLOCKS).reshape(count, BLOCKS)
    inside: FloatArray = (column < used.reshape(count, 1)).astype(np.float64)
    sizes = np.bincount(place, inside.ravel(), count * BLOCKS).reshape(count, BLOCKS)
    squares = np.sum(sums**2 / np.maximum(sizes, 1.0), axis=1) / noise**2
    left = BLOCKS - UNKNOWNS
    blocks = (squares <= left + CONFIDENCE * np.sqrt(2.0 * left)) | (used < 2 * BLOCKS)
    return (single & blocks) | (freedom < 1)


def _batches(windows: Windows) -> list[IntArray]:
    longest = int(np.max(windows.end - windows.begin + 1))
    size = max(1, AT_ONCE // longest)
    rows = np.arange(windows.guess.size)
    return [rows[start : start + size] for start in range(0, rows.size, size)]


def _gauss_newton(
    time: FloatArray, rotation: FloatArray, windows: Windows
) -> tuple[FloatArray, FloatArray, IntArray, IntArray, FloatArray]:
    """Return unknowns, residuals, degrees of freedom, samples used, and the inverse normal matrices."""
    begin, last, first, end, guess = windows
    stop = np.where(end >= first, end, last)
    # One place more than the longest window, always empty: see `_power_sums`.
    index: IntArray = begin[:, None] + np.arange(int(np.max(stop - begin)) + 2, dtype=np.int64)
    used = index <= stop[:, None]
    index = np.minimum(index, time.size - 1)
    # Time in units of the window, so that the normal matrices are well conditioned.
    scale = np.maximum(time[stop] - time[begin], 1e-12)
    t = (time[index] - guess[:, None]) / scale[:, None]
    theta = np.where(used, rotation[index], 0.0)
    low = (time[last] - guess) / scale
    high = (time[np.maximum(first, last)] - guess) / scale
    margin = 0.5 * (high - low) + 1e-9
    number: IntArray = np.sum(used, axis=1)
    x = np.zeros((begin.size, UNKNOWNS))
    normal, right, free, tau, before = _equations(t, theta, number, x)
    for iteration in range(ITERATIONS):
        if iteration == 0:
            # The polynomials first, at the guess: there is no slope yet by which the time could be moved.
            free[:, 0] = False
        x += _solve(normal, right, free)
        x[:, 0] = np.clip(x[:, 0], low - margin, high + margin)
        normal, right, free, tau, before = _equations(t, theta, number, x)
    place = np.arange(t.shape[1], dtype=np.int64).reshape(1, t.shape[1])
    misfit = np.where(used, theta - _model(tau, place < before[:, None], x), 0.0)
    freedom = number - np.sum(free, axis=1)
    inverse = _inverse(normal, free)
    unit = np.stack([scale, *[scale ** -float(power) for power in (1, 2, 3, 1, 2, 3)]], axis=1)
    values = np.where(free, x, np.nan) * unit
    values[:, 0] = guess + x[:, 0] * scale
    inverse = inverse * unit[:, :, None] * unit[:, None, :]
    return values, misfit, freedom, number, inverse


def _model(tau: FloatArray, before: NDArray[np.bool_], x: FloatArray) -> FloatArray:
    b, a = x[:, 1:4, None], x[:, 4:7, None]
    earlier = tau * (b[:, 0] + tau * (b[:, 1] + tau * b[:, 2]))
    later = tau * (a[:, 0] + tau * (a[:, 1] + tau * a[:, 2]))
    return np.where(before, earlier, later)


def _equations(
    t: FloatArray, theta: FloatArray, number: IntArray, x: FloatArray
) -> tuple[FloatArray, FloatArray, NDArray[np.bool_], FloatArray, IntArray]:
    """Return normal matrices, right sides, which unknowns the samples say something about, tau, and samples before.

    With polynomials all of it is sums of powers: S_j = sum(tau^j), T_j = sum(theta tau^j), on each side.
    """
    tau = t - x[:, :1]
    inside = np.arange(t.shape[1], dtype=np.int64).reshape(1, t.shape[1]) < number[:, None]
    before: IntArray = np.sum((tau < 0.0) & inside, axis=1)
    all_sums = _power_sums(tau, theta, inside, before)
    count = before.size
    normal = np.zeros((count, UNKNOWNS, UNKNOWNS))
    right = np.zeros((count, UNKNOWNS))
    free = np.zeros((count, UNKNOWNS), dtype=np.bool_)
    free[:, 0] = True
    for side, at, samples in ((0, 1, before), (1, 4, number - before)):
        s, m = all_sums[0][:, side], all_sums[1][:, side]
        r, c, d = x[:, at], x[:, at + 1], x[:, at + 2]
        # d theta / d t* = -(r + 2 c tau + 3 d tau^2); e = theta - (r tau + c tau^2 + d tau^3), times 1, tau, tau^2, ...
        e = [m[:, j] - (r * s[:, j + 1] + c * s[:, j + 2] + d * s[:, j + 3]) for j in range(4)]
        right[:, 0] -= r * e[0] + 2.0 * c * e[1] + 3.0 * d * e[2]
        normal[:, 0, 0] += r * r * s[:, 0] + 4.0 * r * c * s[:, 1] + (4.0 * c * c + 6.0 * r * d) * s[:, 2]
        normal[:, 0, 0] += 12.0 * c * d * s[:, 3] + 9.0 * d * d * s[:, 4]
        for i in range(3):
            right[:, at + i] = e[i + 1]
            slope = -(r * s[:, i + 1] + 2.0 * c * s[:, i + 2] + 3.0 * d * s[:, i + 3])
            normal[:, 0, at + i] = normal[:, at + i, 0] = slope
            for j in range(3):
                normal[:, at + i, at + j] = s[:, i + j + 2]
        for power, least in enumerate((LINEAR, QUADRATIC, CUBIC)):
            free[:, at + power] = samples >= least
    return normal, right, free, tau, before


def _power_sums(
    tau: FloatArray, theta: FloatArray, inside: NDArray[np.bool_], before: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return sums of tau^0 to tau^6, and of theta tau^0 to theta tau^3, shapes (k, 2, 7) and (k, 2, 4): both sides.

    Rows are summed in two parts, divided behind the samples before the impact; since each has an empty place at its
    end, no second part is without one. Of a first part without samples `reduceat` would give that of the second.
    """
    count, width = tau.shape
    starts: IntArray = np.arange(count, dtype=np.int64) * width
    cuts = np.stack((starts, starts + before), axis=1).ravel()
    power = inside.astype(np.float64)
    sums, moments = np.zeros((count, 2, 7)), np.zeros((count, 2, 4))
    for j in range(7):
        sums[:, :, j] = np.add.reduceat(power.ravel(), cuts).reshape(count, 2)
        if j < 4:
            moments[:, :, j] = np.add.reduceat((power * theta).ravel(), cuts).reshape(count, 2)
        power *= tau
    nothing = before == 0
    sums[nothing, 0] = 0.0
    moments[nothing, 0] = 0.0
    return sums, moments


def _solve(normal: FloatArray, right: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    fixed, target = _pinned(normal, free), np.where(free, right, 0.0)
    try:
        change: FloatArray = np.linalg.solve(fixed, target[:, :, None])[:, :, 0].astype(np.float64)
    except np.linalg.LinAlgError:
        change = np.einsum("kij,kj->ki", np.linalg.pinv(fixed), target)
    return change


def _inverse(normal: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    fixed = _pinned(normal, free)
    try:
        inverse: FloatArray = np.linalg.inv(fixed).astype(np.float64)
    except np.linalg.LinAlgError:
        inverse = np.linalg.pinv(fixed).astype(np.float64)
    return np.where(free[:, :, None] & free[:, None, :], inverse, np.nan)


def _pinned(normal: FloatArray, free: NDArray[np.bool_]) -> FloatArray:
    """Return the normal matrices with rows and columns of fixed unknowns replaced by those of the unit matrix."""
    both = free[:, :, None] & free[:, None, :]
    return np.where(both, normal, np.eye(UNKNOWNS)[None])
