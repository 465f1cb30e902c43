"""Which flights of a recording can be fitted: whole ones between two impacts, high enough, with no gap to hide in."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.calibration.course import BoolArray, Flights, IntArray
from twin.calibration.dips import dips
from twin.rocking_data.flights import median_of_three
from twin.rocking_data.impacts import Impacts
from twin.rocking_data.noise import FloatArray

LEAST_HEIGHT = 2.0
"""A flight counts where it is so many times higher than the band in which nothing is seen."""
LEAST_SAMPLES = 4
"""And has so many samples."""
FADING = 0.93
"""Duration of a flight over that of the one before it, where impacts inside a gap are guessed."""


class Seen(NamedTuple):
    """Impacts that bound whole flights, and which of those between them are.

    Attributes
    ----------
    time : ndarray, shape (n,)
        Impacts, s.
    direction : ndarray of int, shape (n,)
        +1 where the block goes on to positive rotations.
    whole : ndarray of bool, shape (n - 1,)
        Whether the flight after each but the last is one flight, seen well enough.
    """

    time: FloatArray
    direction: IntArray
    whole: BoolArray

    def at(self, begin: int, end: int) -> Seen:
        """Return the impacts from `begin` to `end` (excluded)."""
        return Seen(self.time[begin:end], self.direction[begin:end], self.whole[begin : end - 1])

    def without(self, flight: int) -> Seen:
        """Return these without both impacts of a flight that was none: its neighbours are one."""
        pair = [flight, flight + 1]
        whole = np.delete(self.whole, [k for k in (*pair, flight - 1) if 0 <= k < self.whole.size])
        if 0 < flight < self.whole.size - 1:
            whole = np.insert(whole, flight - 1, True)
        return Seen(np.delete(self.time, pair), np.delete(self.direction, pair), whole)


def flights_seen(time: FloatArray, rotation: FloatArray, impacts: Impacts, *, bridge: bool = False) -> Seen:
    """Return the impacts up to the first flight that is too low, and which flights between them are whole.

    A stay in the band with a high flight on the other side behind it is an impact in a gap, no landing; any other
    landing ends it.

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        s; rad, without its offset.
    impacts : Impacts
    bridge : bool
        Put one or two impacts into a gap that hides them, where the flights beside it say how many: a guess that the
        fit must confirm.
    """
    clean = median_of_three(rotation)
    size, dipped = np.abs(clean), dips(time, clean, impacts)
    at = np.array([_in_a_gap(time, size, impacts, j) for j in range(len(impacts))])
    direction, whole, hiding = impacts.direction.tolist(), list[bool](), list[bool]()
    count = len(impacts)
    for j in range(count - 1):
        inside = slice(*np.searchsorted(time, at[j : j + 2]).tolist())
        turned = direction[j] != direction[j + 1]
        low = size[inside].size and float(np.max(size[inside])) < LEAST_HEIGHT * impacts.band
        if low or (impacts.landing[j] and not turned):
            count = j + 1
            break
        bounced = bool(np.any((dipped > at[j]) & (dipped < at[j + 1])))
        hidden = bool(np.any((impacts.hidden[:, 0] < at[j + 1]) & (impacts.hidden[:, 1] > at[j])))
        whole.append(bool(turned and not hidden and not bounced and size[inside].size >= LEAST_SAMPLES))
        hiding.append(hidden and not bounced)
    seen = Seen(at[:count], impacts.direction[:count], np.array(whole[: max(count - 1, 0)], dtype=np.bool_))
    return _bridged(seen, np.array(hiding[: seen.whole.size], dtype=np.bool_)) if bridge else seen


def _in_a_gap(time: FloatArray, size: FloatArray, impacts: Impacts, row: int) -> float:
    """Return the time of an impact; of one taken for a landing, where the samples beside it would meet zero."""
    at = float(impacts.time[row])
    if not impacts.landing[row]:
        return at
    last = max(int(np.searchsorted(time, at)) - 1, 0)
    later = np.flatnonzero(size[last + 1 :] > impacts.band)
    if not later.size:
        return at
    first = last + 1 + int(later[0])
    return float(time[last] + (time[first] - time[last]) * size[last] / max(size[last] + size[first], 1e-300))


def _bridged(seen: Seen, hiding: BoolArray) -> Seen:
    """Return the impacts with those that gaps hide, one or two a gap, evenly put, and the flights beside them whole."""
    lasting = np.diff(seen.time)
    time, direction, whole = [seen.time[:1]], [seen.direction[:1]], list[bool]()
    for j in range(seen.whole.size):
        beside = [float(lasting[k]) for k in (j - 1, j + 1) if 0 <= k < lasting.size and seen.whole[k]]
        missing = 0
        if hiding[j]:
            usual = float(np.mean(beside)) if beside else float(lasting[j]) / 2.0
            turned = seen.direction[j] != seen.direction[j + 1]
            missing = min((0, 2) if turned else (1,), key=lambda n: abs(np.log(lasting[j] / (n + 1) / usual)))
        between = seen.time[j] + lasting[j] * (1.0 - FADING ** np.arange(1, missing + 1)) / (
            1.0 - FADING ** (missing + 1)
        )
        time += [between, seen.time[j + 1 : j + 2]]
        turns = seen.direction[j] * (-1) ** np.arange(1, missing + 1)
        direction += [turns, seen.direction[j + 1 : j + 2]]
        whole += [bool(seen.whole[j] or hiding[j])] * (missing + 1)
    return Seen(np.concatenate(time), np.concatenate(direction).astype(np.int64), np.array(whole, dtype=np.bool_))


def bounds_of(rows: IntArray) -> IntArray:
    """Return the places of the impacts that bound those flights."""
    return np.unique(np.concatenate([rows, rows + 1]))


def _bounded(whole: BoolArray, seen: BoolArray) -> BoolArray:
    """Return which flights have samples enough, or two such neighbours, which bound it."""
    good = np.concatenate([[False], whole & seen, [False]])
    return seen | (good[:-2] & good[2:])


def laid_out(time: FloatArray, rotation: FloatArray, seen: Seen) -> tuple[Flights, IntArray]:
    """Return the whole flights with their samples, without an entry, and their places among those of `seen`.

    Instants are those impacts that bound one. A flight without samples counts where both its neighbours have some.
    """
    edges = np.searchsorted(time, seen.time)
    samples = np.diff(edges)
    rows = np.flatnonzero(seen.whole & _bounded(seen.whole, samples >= LEAST_SAMPLES))
    used = bounds_of(rows)
    number = np.full(seen.time.size, -1, dtype=np.int64)
    number[used] = np.arange(used.size)
    flight = np.full(time.size, -1, dtype=np.int64)
    for k, j in enumerate(rows.tolist()):
        flight[edges[j] : edges[j + 1]] = k
    inside = flight >= 0
    return Flights(
        left=number[rows],
        right=number[rows + 1],
        side=seen.direction[rows],
        entry=False,
        held=False,
        instants=used.size,
        flight=flight[inside],
        time=time[inside],
        rotation=rotation[inside],
    ), rows
