"""The part of a recording in which the base stands still: what free rocking is calibrated from."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.calibration.course import BoolArray
from twin.errors import InputError
from twin.rocking_data.impacts import find_impacts
from twin.rocking_data.noise import FloatArray, noise_level, rest_offset, steps

WINDOW = 0.05
"""Base accelerations are averaged over so long: the block's own knocks are shorter, s."""
LEAST = 0.003
"""A base acceleration that is less than this part of gravity is none."""
SURE = 6.0
"""Nor is one within so many deviations of its noise."""
SHORTEST = 0.2
"""Shortest part that is looked at, s."""


class FreePart(NamedTuple):
    """Begin and end of the free part, s, and whether the base moves outside it."""

    begin: float
    end: float
    shaken: bool


def free_part(time: FloatArray, rotation: FloatArray, acceleration: FloatArray, gravity: float) -> FreePart:
    """Return the still part with the most impacts.

    Parameters
    ----------
    time, rotation, acceleration : ndarray, shape (n,)
        s, increasing; rad, NaN where missing; of the base, m/s2, NaN where missing. A constant offset is none.
    gravity : float
        m/s2.

    Raises
    ------
    InputError
        The base moves all the time, or the block rocks only while it does.
    """
    moving = base_moves(time, acceleration, gravity)
    if not np.any(moving):
        return FreePart(float(time[0]), float(time[-1]), shaken=False)
    edges = np.flatnonzero(np.diff(np.concatenate([[True], moving, [True]]).astype(np.int8)))
    best: tuple[int, float, float, float] | None = None
    for begin, end in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        first, last = float(time[begin]), float(time[end - 1])
        first += WINDOW if begin else 0.0
        last -= WINDOW if end < time.size else 0.0
        if last - first < SHORTEST:
            continue
        part = slice(*np.searchsorted(time, (first, last)).tolist())
        rank = (_impacts_in(time[part], rotation[part]), last - first, first, last)
        best = rank if best is None or rank > best else best
    if best is None or best[0] < 2:
        until = float(time[np.flatnonzero(moving)[-1]])
        raise InputError(
            f"the base moves until {until:.3f} s and the block does not rock freely before or after it: there is "
            "nothing to calibrate from"
        )
    return FreePart(best[2], best[3], shaken=True)


def base_moves(time: FloatArray, acceleration: FloatArray, gravity: float) -> BoolArray:
    """Return at which samples the base is accelerated by more than noise and what does not matter to the block."""
    known = np.isfinite(acceleration)
    if np.count_nonzero(known) < 4:
        return np.zeros(time.size, dtype=np.bool_)
    filled = np.where(known, acceleration, np.median(acceleration[known]))
    step, _ = steps(time)
    window = max(round(WINDOW / step), 1)
    kernel = np.full(window, 1.0 / window)
    count = np.convolve(np.ones(time.size), kernel, mode="same")
    mean = np.convolve(filled - np.median(filled), kernel, mode="same") / count
    noise = noise_level(time, filled) / np.sqrt(window)
    return np.abs(mean) > max(LEAST * gravity, SURE * noise)


def _impacts_in(time: FloatArray, rotation: FloatArray) -> int:
    seen = np.isfinite(rotation)
    if np.count_nonzero(seen) < 20:
        return 0
    time, rotation = time[seen], rotation[seen]
    noise = max(noise_level(time, rotation), 1e-9)
    return len(find_impacts(time, rotation, noise=noise, offset=rest_offset(rotation, noise) or 0.0))
