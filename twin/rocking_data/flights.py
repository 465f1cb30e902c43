"""Where a noisy rotation leaves the contact and comes back to it: flights, and the brackets between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.rocking_data.noise import FloatArray

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

LINGER = 3.0
"""A crossing that takes this many times longer than its rates explain is a landing: the block stayed."""
LINGER_SAMPLES = 4
"""And so many samples more."""


class Brackets(NamedTuple):
    """Where the impacts are: one row for each time the rotation came back to the contact, in order.

    Attributes
    ----------
    last, first : ndarray of int, shape (n,)
        Last sample outside the band before the impact, first one outside after it; `first` is the end of the band's
        stay, or of the record, for a landing.
    side : ndarray of int
        Sign of the rotation before it.
    begin, end : ndarray of int
        First sample of the flight before, last of the flight after.
    landing : ndarray of bool
        Whether the block stayed in the band: what it did there is below the noise.
    """

    last: IntArray
    first: IntArray
    side: IntArray
    begin: IntArray
    end: IntArray
    landing: BoolArray

    def at(self, rows: IntArray) -> Brackets:
        """Return some of the rows."""
        return Brackets(
            self.last[rows], self.first[rows], self.side[rows], self.begin[rows], self.end[rows], self.landing[rows]
        )


def median_of_three(values: FloatArray) -> FloatArray:
    """Return the running median of three samples, ends as they are: a single wild sample is gone.

    >>> median_of_three(np.array([0.0, 9.0, 0.1, 0.2, 0.3])).tolist()
    [0.0, 0.1, 0.2, 0.2, 0.3]
    """
    result = values.copy()
    if values.size > 2:
        a, b, c = values[:-2], values[1:-1], values[2:]
        result[1:-1] = np.maximum(np.minimum(a, b), np.minimum(np.maximum(a, b), c))
    return result


def find_brackets(time: FloatArray, rotation: FloatArray, band: float, step: float) -> Brackets:
    """Return where the rotation passed, or came back into, the band around zero.

    A flight is a stretch in which the samples outside the band have one sign. Between two flights of opposite sign lies
    an impact. A stay inside the band that is longer than `LINGER` times what the rates at its ends explain, plus
    `LINGER_SAMPLES`, is a landing: an impact whose end is below the noise, whatever side the next flight is on. A
    shorter dip into the band that comes out on the same side is no impact: nobody could tell it from a near miss.

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        s and rad, without its offset; wild samples removed.
    band : float
        Half width, rad.
    step : float
        Median time between samples, s.
    """
    size = np.abs(rotation)
    outside = np.flatnonzero(size > band)
    if not outside.size:
        none = np.zeros(0, dtype=np.int64)
        return Brackets(none, none, none, none, none, none.astype(np.bool_))
    sides = np.sign(rotation[outside]).astype(np.int64)
    # One row for each return into the band, the last one's stay ending with the record.
    left = np.append(np.flatnonzero((np.diff(outside) > 1) | (sides[1:] != sides[:-1])), outside.size - 1)
    last = outside[left]
    first = np.append(outside[left[:-1] + 1], rotation.size - 1)
    far = np.flatnonzero(size > 2.0 * band)
    rate_in = _slope(time, size, last, far[np.maximum(np.searchsorted(far, last) - 1, 0)] if far.size else last, -1)
    after = far[np.minimum(np.searchsorted(far, first, side="right"), far.size - 1)] if far.size else first
    rate_out = _slope(time, size, first, after, 1)
    rate_out[-1] = np.inf
    stay = time[first] - time[last]
    explained = band / rate_in + band / rate_out
    landing = stay > LINGER * explained + LINGER_SAMPLES * step
    turned = np.append(sides[left[:-1] + 1] != sides[left[:-1]], False)
    kept = np.flatnonzero(turned | landing)
    # The flight before begins where the bracket before ended, the one after ends where the next begins.
    begin = np.append(outside[0], first[kept][:-1])
    end = np.append(last[kept][1:], outside[-1])
    return Brackets(last[kept], first[kept], sides[left[kept]], begin, np.maximum(end, first[kept]), landing[kept])


def _slope(time: FloatArray, size: FloatArray, edge: IntArray, far: IntArray, sign: int) -> FloatArray:
    """Return how fast |rotation| changes between the band's edge and twice the band, rad/s; tiny where unknown."""
    beside = np.clip(edge + sign, 0, size.size - 1)
    far = np.minimum(far, beside) if sign < 0 else np.maximum(far, beside)
    apart = np.abs(time[edge] - time[far])
    rise = np.abs(size[far] - size[edge])
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(apart > 0.0, np.maximum(rise / apart, 1e-12), 1e-12)
