"""How much of each shape of pulse a table makes exactly as asked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.search.family import Family

LADDER = 12
"""Sizes at which a column is tried first, evenly in their logarithm."""
CLOSE_ENOUGH = 2e-4
"""Relative size to which the ends of what fits are closed in on."""


@dataclass(frozen=True, slots=True)
class Reach:
    """Least and largest size of each of `shapes` that fits; nan where none was found.

    A guide for the search alone: what is proposed has gone through the clip itself.
    """

    shapes: FloatArray
    least: FloatArray
    largest: FloatArray

    @property
    def empty(self) -> bool:
        """Whether nothing fits."""
        return not bool(np.isfinite(self.largest).any())

    def inside(self, sizes: FloatArray) -> np.ndarray[tuple[int, int], np.dtype[np.bool_]]:
        """Return which cells of `sizes` x `shapes` fit."""
        return (sizes[:, None] >= self.least) & (sizes[:, None] <= self.largest)


def reach(family: Family, shapes: FloatArray) -> Reach:
    """Ask the clip for the largest size of every shape; where it does not say, close in on the ends of a ladder."""
    ends = [_ends(family, shape) for shape in shapes.tolist()]
    return Reach(shapes, np.array([end[0] for end in ends]), np.array([end[1] for end in ends]))


def _ends(family: Family, shape: float) -> tuple[float, float]:
    top = family.largest(shape)
    if top is not None and family.fits(top, shape) and family.fits(family.size.low, shape):
        return family.size.low, top
    ladder = np.geomspace(family.size.low, family.size.high, LADDER).tolist()
    good = [size for size in ladder if family.fits(size, shape)]
    if not good:
        return math.nan, math.nan
    below = max((size for size in ladder if size < good[0]), default=None)
    above = min((size for size in ladder if size > good[-1]), default=None)
    least = good[0] if below is None else _edge(family, shape, good[0], below)
    return least, good[-1] if above is None else _edge(family, shape, good[-1], above)


def _edge(family: Family, shape: float, inside: float, outside: float) -> float:
    while abs(outside / inside - 1.0) > CLOSE_ENOUGH:
        middle = math.sqrt(inside * outside)
        inside, outside = (middle, outside) if family.fits(middle, shape) else (inside, middle)
    return inside
