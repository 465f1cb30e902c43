"""A field over sizes and shapes: how far its cells are from a boundary, and which of its heights are worth naming."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from twin.rocking.compiled import FloatArray

APART = 0.2
"""Runs nearer than this to each other (root of the sum of the squared logarithms' differences) are one proposal."""

Mask = NDArray[np.bool_]


def distances(region: Mask, sizes: FloatArray, shapes: FloatArray) -> FloatArray:
    """Return how far each cell of `region` is from the nearest outside it, as a share of size and shape together.

    Both axes count in their logarithms and must be even there. What lies beyond the field is not known to be outside.
    """
    if bool(region.all()):
        return np.full(region.shape, np.inf)
    steps = [_step(sizes), _step(shapes)]
    return np.asarray(distance_transform_edt(region, sampling=steps), dtype=np.float64)


def peaks_apart(
    score: FloatArray, allowed: Mask, sizes: FloatArray, shapes: FloatArray, apart: float = APART
) -> Iterator[tuple[int, int]]:
    """Yield cells, the highest score first, each at least `apart` from all that were yielded."""
    x, y = np.log(sizes)[:, None], np.log(shapes)[None, :]
    left = allowed & np.isfinite(score)
    field = np.where(left, score, -np.inf)
    while bool(left.any()):
        i, j = np.unravel_index(int(np.argmax(field)), field.shape)
        yield int(i), int(j)
        near = np.hypot(x - x[i, 0], y - y[0, j]) < apart
        left &= ~near
        field[near] = -np.inf


def separation(one: tuple[float, float], other: tuple[float, float]) -> float:
    """Return how far two runs (size, shape) are apart, in the measure of `APART`."""
    return math.hypot(math.log(one[0] / other[0]), math.log(one[1] / other[1]))


def _step(axis: FloatArray) -> float:
    return 1.0 if len(axis) < 2 else float(abs(math.log(axis[-1] / axis[0]))) / (len(axis) - 1)
