"""Impacts of a rocking block from its measured rotation: when, how fast before and after, how sure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rocking_data.flights import Brackets, find_brackets, median_of_three
from twin.rocking_data.impact_fit import CUBIC, Fitted, Windows, fit_impacts
from twin.rocking_data.noise import FloatArray, noise_level, steps

BAND = 5.0
"""Half width of the band around zero in which the sign of the rotation says nothing, standard deviations."""
SURE = 2.0
"""Between flights that are not so many times higher than the band no restitution is said: what stands out of the noise
of them is not a fair sample."""
LEAST_BAND = 1e-9
"""Half width of the band of a signal without noise, rad."""
LYING = 0.5 * np.pi - 0.02
"""A block this far over lies, or is about to: what follows are no impacts of rocking, rad."""
SHORT_GAP = 10.0
"""A gap of so many steps at rest hides no impact."""
LONGEST_GAP = 0.5
"""An impact inside a gap counts where the gap is no longer than this part of the flights beside it."""


@dataclass(frozen=True, eq=False)
class Impacts:
    """Impacts in order, one row each; errors are one standard deviation, from the noise of the rotation.

    Attributes
    ----------
    time, time_error : ndarray, shape (n,)
        s; the error is NaN where too few samples say it.
    direction : ndarray of int
        +1 where the block goes on to positive rotations, -1 to negative ones.
    rate_before, rate_before_error, rate_after, rate_after_error : ndarray
        Angular velocity, rad/s, signed; NaN where too few samples say it.
    restitution, restitution_error : ndarray
        Rate after over rate before; NaN where one is not known, or a flight beside it is too low (`SURE`).
    landing : ndarray of bool
        The motion after it is below the noise: the block is as good as at rest, and `rate_after` is NaN.
    noise, band : float
        Standard deviation of one sample, and the half width inside which nothing is seen, rad.
    hidden : ndarray, shape (m, 2)
        Gaps of the recording in which impacts may be hidden: from, to, s.
    """

    time: FloatArray
    time_error: FloatArray
    direction: NDArray[np.int64]
    rate_before: FloatArray
    rate_before_error: FloatArray
    rate_after: FloatArray
    rate_after_error: FloatArray
    restitution: FloatArray
    restitution_error: FloatArray
    landing: NDArray[np.bool_]
    noise: float
    band: float
    hidden: FloatArray

    def __len__(self) -> int:
        return self.time.size


def find_impacts(
    time: FloatArray,
    rotation: FloatArray,
    *,
    noise: float | None = None,
    offset: float = 0.0,
) -> Impacts:
    """Find the impacts of a block that rocks about its two lower corners.

    An impact is where the rotation passes from beyond one side of a band of `BAND` standard deviations around zero to
    beyond the other, or comes back into the band and stays there (see `find_brackets`); its time and rates are those of
    two polynomials that meet at zero there (see `impact_fit`). Impacts between flights smaller than the band are not
    seen; single wild samples are passed over; the search ends where the block lies.

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        s, increasing; rad. Samples whose rotation is not finite are left out, as gaps.
    noise : float, optional
        Standard deviation of one sample, rad; estimated unless given (`noise_level`).
    offset : float
        What the sensor reads at rest, rad; see `rest_offset`.

    Raises
    ------
    ValueError
        Where the arrays differ in shape, or the times are not finite or do not increase.

    Examples
    --------
    >>> t = np.arange(0.0, 1.0, 1e-3)
    >>> found = find_impacts(t, np.where(t < 0.5, 1.0, 0.9) * (t - 0.5), noise=1e-6)
    >>> round(float(found.time[0]), 9), round(float(found.restitution[0]), 9)
    (0.5, 0.9)
    """
    time, rotation = np.asarray(time, dtype=np.float64), np.asarray(rotation, dtype=np.float64)
    if time.ndim != 1 or time.shape != rotation.shape:
        raise ValueError(f"times and rotations have shapes {time.shape} and {rotation.shape}; they must be equal rows")
    if not np.all(np.isfinite(time)) or np.any(np.diff(time) <= 0.0):
        raise ValueError("times must be finite and increase")
    seen = np.isfinite(rotation)
    time, rotation = time[seen], rotation[seen] - offset
    lying = np.flatnonzero(np.abs(rotation) >= LYING)
    if lying.size:
        time, rotation = time[: lying[0]], rotation[: lying[0]]
    deviation = noise_level(time, rotation) if noise is None else noise
    band = max(BAND * deviation, LEAST_BAND)
    if time.size < 4:
        return _impacts(*_nothing(), deviation, band, np.zeros((0, 2)))
    step, gaps = steps(time)
    clean = median_of_three(rotation)
    brackets = find_brackets(time, clean, band, step)
    known = _not_in_a_gap(time, gaps, brackets)
    brackets = brackets.at(known)
    hidden = _hidden(time, clean, gaps, brackets, band)
    fitted = fit_impacts(time, rotation, _windows(time, clean, brackets, step), deviation)
    found = _impacts(brackets, fitted, deviation, band, hidden)
    # A fit to little but noise may point outside of what was recorded.
    np.clip(found.time, time[0], time[-1], out=found.time)
    high = np.minimum(_highest(clean, brackets.begin, brackets.last), _highest(clean, brackets.first, brackets.end))
    low = high < SURE * band
    found.restitution[low] = found.restitution_error[low] = np.nan
    return found


def _windows(time: FloatArray, rotation: FloatArray, brackets: Brackets, step: float) -> Windows:
    """Return the half flights beside each impact, and where the straight line between its brackets meets zero.

    A half flight of few samples is made longer, up to the whole flight: a cubic fits that too.
    """
    last, first, _, begin, end, landing = brackets
    half_before = np.searchsorted(time, 0.5 * (time[begin] + time[last]))
    half_after = np.searchsorted(time, 0.5 * (time[first] + time[end]), side="right") - 1
    before, after = np.abs(rotation[last]), np.abs(rotation[first])
    line = time[last] + (time[first] - time[last]) * before / np.maximum(before + after, 1e-300)
    return Windows(
        np.maximum(np.minimum(half_before, last - CUBIC + 1), np.minimum(begin, last)),
        last,
        np.where(landing, last + 1, first),
        np.where(landing, last, np.minimum(np.maximum(half_after, first + CUBIC - 1), np.maximum(end, first))),
        np.where(landing, time[last] + 0.5 * step, line),
    )


def _not_in_a_gap(time: FloatArray, gaps: NDArray[np.bool_], brackets: Brackets) -> NDArray[np.int64]:
    """Return the brackets whose impact is one, and not some number of them, whatever the gap between the samples."""
    last, first, _, begin, end, landing = brackets
    longest = np.zeros(last.size)
    places = np.flatnonzero(gaps)
    for k in np.flatnonzero(np.searchsorted(places, first) > np.searchsorted(places, last)):
        longest[k] = np.max(np.diff(time[last[k] : first[k] + 1]))
    flights = np.where(landing, time[last] - time[begin], np.minimum(time[last] - time[begin], time[end] - time[first]))
    return np.flatnonzero(longest <= LONGEST_GAP * flights)


def _hidden(
    time: FloatArray, rotation: FloatArray, gaps: NDArray[np.bool_], brackets: Brackets, band: float
) -> FloatArray:
    """Return the gaps that are long enough for the block to have come to the contact and back unseen.

    A short one between two samples inside the band hides nothing that would have been seen without it.
    """
    places = np.flatnonzero(gaps)
    even = np.flatnonzero(~gaps)
    if not places.size or not even.size:
        return np.zeros((0, 2))
    fastest = float(np.max(np.abs(np.diff(rotation)[even]) / np.diff(time)[even]))
    away = np.abs(rotation[places]) + np.abs(rotation[places + 1])
    near = away < fastest * (time[places + 1] - time[places])
    seen = (np.abs(rotation[places]) > band) | (np.abs(rotation[places + 1]) > band)
    near &= seen | (time[places + 1] - time[places] > SHORT_GAP * float(np.median(np.diff(time)[even])))
    # A gap across which an impact was counted is explained.
    counted = np.searchsorted(brackets.last, places, side="right") - 1
    inside = (counted >= 0) & (brackets.first[np.maximum(counted, 0)] > places) if brackets.last.size else counted > 0
    chosen = places[near & ~inside]
    return np.stack((time[chosen], time[chosen + 1]), axis=1)


def _highest(rotation: FloatArray, begin: NDArray[np.int64], end: NDArray[np.int64]) -> FloatArray:
    """Return the largest |rotation| of each flight, from `begin` to `end`, both included."""
    if not begin.size:
        return np.zeros(0)
    ends = np.stack((begin, end + 1), axis=1).ravel()
    return np.maximum.reduceat(np.append(np.abs(rotation), 0.0), ends)[::2]


def _nothing() -> tuple[Brackets, Fitted]:
    none = np.zeros(0, dtype=np.int64)
    brackets = Brackets(none, none, none, none, none, none.astype(np.bool_))
    return brackets, Fitted(np.zeros((0, 7)), np.zeros((0, 7, 7)), none)


def _impacts(brackets: Brackets, fitted: Fitted, noise: float, band: float, hidden: FloatArray) -> Impacts:
    values, covariance = fitted.values, fitted.covariance
    variance = np.diagonal(covariance, axis1=1, axis2=2)
    # Where no side has a slope nothing says how sure the time is.
    deviation = np.sqrt(np.where(variance > 0.0, variance, np.nan))
    before, after = values[:, 1], values[:, 4]
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = after / before
        # Var(a / b) = (a / b)^2 (Var a / a^2 + Var b / b^2 - 2 Cov(a, b) / (a b)), to first order.
        spread = ratio**2 * ((deviation[:, 4] / after) ** 2 + (deviation[:, 1] / before) ** 2)
        spread -= 2.0 * ratio**2 * covariance[:, 1, 4] / (after * before)
        error = np.sqrt(np.maximum(spread, 0.0))
    return Impacts(
        time=values[:, 0],
        time_error=deviation[:, 0],
        direction=-brackets.side,
        rate_before=before,
        rate_before_error=deviation[:, 1],
        rate_after=after,
        rate_after_error=deviation[:, 4],
        restitution=ratio,
        restitution_error=error,
        landing=brackets.landing,
        noise=noise,
        band=band,
        hidden=hidden,
    )
