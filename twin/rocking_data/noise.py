"""The noise of a measured rotation, and where its zero is."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

EVEN = 1.5
"""A step up to this many median steps is an ordinary one; a longer one is a gap."""
STILL = 6.0
"""A stretch is still while it stays within this many standard deviations of its median."""
STILL_SAMPLES = 20
"""Shortest still stretch that says where zero is."""
LARGEST_OFFSET = 0.02
"""A still stretch further from zero than this is a tilted block, not a sensor's offset, rad."""

# Var(x3 - 3 x2 + 3 x1 - x0) = (1 + 9 + 9 + 1) sigma^2 for white noise.
_THIRD_DIFFERENCE = math.sqrt(20.0)
# The median of |x| of a normal variable is 0.67449 standard deviations.
_MEDIAN_TO_DEVIATION = 1.0 / 0.6744897501960817


def steps(time: FloatArray) -> tuple[float, NDArray[np.bool_]]:
    """Return the median step of `time`, s, and which steps are gaps.

    >>> steps(np.array([0.0, 0.1, 0.2, 0.5, 0.6]))[1].tolist()
    [False, False, True, False]
    """
    apart = np.diff(time)
    median = float(np.median(apart)) if apart.size else math.nan
    return median, apart > EVEN * median


def noise_level(time: FloatArray, values: FloatArray) -> float:
    """Return the standard deviation of white noise on a smooth signal, in the signal's unit.

    From the median of |third difference| over evenly spaced samples: impacts, being few, do not move a median. Not
    less than the deviation of rounding to the smallest step between values, q / sqrt(12); a signal that changes between
    all its samples has no such step worth mentioning.

    Parameters
    ----------
    time, values : ndarray, shape (n,)
        Increasing, s; finite.
    """
    if values.size < 4:
        return 0.0
    _, gaps = steps(time)
    even = ~(gaps[:-2] | gaps[1:-1] | gaps[2:])
    third = np.abs(np.diff(values, 3))[even]
    spread = float(np.median(third)) * _MEDIAN_TO_DEVIATION / _THIRD_DIFFERENCE if third.size else 0.0
    changes = np.abs(np.diff(values))
    changes = changes[changes > 0.0]
    quantum = float(np.min(changes)) if changes.size else 0.0
    return max(spread, quantum / math.sqrt(12.0))


def rest_offset(values: FloatArray, noise: float) -> float | None:
    """Return the mean of the sensor's reading at rest; None where the run neither begins nor ends still near zero.

    The longest still stretch at either end is taken, the longer of the two; one further from zero than
    `LARGEST_OFFSET` is a block held at a tilt, or lying.
    """
    best: FloatArray | None = None
    for end in (values, values[::-1]):
        stretch = end[: _still(end, noise)]
        near = stretch.size >= STILL_SAMPLES and abs(float(np.median(stretch))) <= LARGEST_OFFSET
        if near and (best is None or stretch.size > best.size):
            best = stretch
    return None if best is None else float(np.mean(best))


def _still(values: FloatArray, noise: float) -> int:
    """Return how many samples from the first on stay within `STILL` deviations of the first ones' median."""
    middle = float(np.median(values[:STILL_SAMPLES])) if values.size else 0.0
    away = np.flatnonzero(np.abs(values - middle) > STILL * noise)
    return int(away[0]) if away.size else values.size
