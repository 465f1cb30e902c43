"""Where a block comes down to its contact and goes up again on the same side: a bounce, unless it was touched."""

from __future__ import annotations

import numpy as np

from twin.rocking_data.impacts import Impacts
from twin.rocking_data.noise import FloatArray

LOW = 0.3
"""A dip goes below this part of the smaller peak beside it."""
HIGH = 3.0
"""Both of which stand out so many times from the band in which nothing is seen."""
BESIDE = 2
"""Samples next to an impact that are not looked at: its time is not known to one."""


def dips(time: FloatArray, rotation: FloatArray, impacts: Impacts) -> FloatArray:
    """Return the times of the lowest points of dips, s: between two impacts |rotation| has one hill, no two.

    A dip beside a gap that may hide impacts is none.

    `rotation`: rad, without its offset; wild samples removed.
    """
    found: list[float] = []
    landings = np.flatnonzero(impacts.landing)
    count = int(landings[0]) + 1 if landings.size else len(impacts)
    edges = [0, *np.searchsorted(time, impacts.time[:count]).tolist()]
    for j in range(count):
        inside = slice(edges[j] + BESIDE * (j > 0), edges[j + 1] - BESIDE)
        found += _valleys(time[inside], -int(impacts.direction[j]) * rotation[inside], HIGH * impacts.band)
    gaps = impacts.hidden
    return np.array([at for at in found if not np.any((gaps[:, 0] <= at) & (at <= gaps[:, 1]))])


def _valleys(time: FloatArray, size: FloatArray, least: float) -> list[float]:
    """Return the lowest points between hills of one flight; `size` is positive on its side."""
    if size.size < 3:
        return []
    left = np.maximum.accumulate(size)
    right = np.maximum.accumulate(size[::-1])[::-1]
    walls = np.minimum(left, right)
    deep = (size < LOW * walls) & (walls > least)
    if not np.any(deep):
        return []
    places = np.flatnonzero(deep)
    groups = np.split(places, np.flatnonzero(np.diff(walls[places]) != 0.0) + 1)
    return [float(time[group[np.argmin(size[group])]]) for group in groups]
