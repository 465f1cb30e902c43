"""Extremes and first passages of a quantity known at any instant, smooth between the instants it is first looked at."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray

CANDIDATES = 12
"""How many of the largest values' neighbourhoods are searched."""
ROUNDS = 4
PARTS = 24
"""Each round divides the neighbourhood into this many parts and keeps two: 12^4 times finer in the end."""


@dataclass(frozen=True, slots=True)
class Instants:
    """Times, s, in rising order, with T / (m g) and N / (m g) there; a time twice is an event, before and after."""

    time: FloatArray
    tangential: FloatArray
    normal: FloatArray

    def with_limits(self, limits: Instants) -> Instants:
        """Return these with `limits`, the values just before a time, put in ahead of it."""
        place = np.searchsorted(self.time, limits.time, side="left")
        return Instants(
            np.insert(self.time, place, limits.time),
            np.insert(self.tangential, place, limits.tangential),
            np.insert(self.normal, place, limits.normal),
        )


Look = Callable[[FloatArray], Instants]
Quantity = Callable[[Instants], FloatArray]


def greatest(instants: Instants, look: Look, quantity: Quantity) -> tuple[float, float]:
    """Return when a quantity is greatest, and how great: the best instant, closed in on between its neighbours.

    An instant at an event keeps its own value; its neighbourhood ends at the event.
    """
    values = quantity(instants)
    t = instants.time
    best = int(np.argmax(values))
    when, value = float(t[best]), float(values[best])
    for i in np.argsort(values)[::-1][:CANDIDATES].tolist():
        left, right = float(t[max(i - 1, 0)]), float(t[min(i + 1, t.size - 1)])
        for _ in range(ROUNDS):
            if not right > left:
                break
            # Strictly inside: the ends may be events, where the quantity jumps.
            grid = np.linspace(left, right, PARTS + 1)[1:-1]
            found = quantity(look(grid))
            k = int(np.argmax(found))
            if float(found[k]) > value:
                when, value = float(grid[k]), float(found[k])
            width = (right - left) / PARTS
            left, right = max(left, float(grid[k]) - width), min(right, float(grid[k]) + width)
    return when, value


def first_passage(instants: Instants, look: Look, quantity: Quantity, level: float) -> float | None:
    """Return the first time a quantity is not below `level`, to 1e-12 of the spacing; None where it never is.

    A passage between two instants that are both below is not seen here: see `greatest`.
    """
    beyond = np.nonzero(quantity(instants) >= level)[0]
    if not beyond.size:
        return None
    i = int(beyond[0])
    if i == 0:
        return float(instants.time[0])
    low, high = float(instants.time[i - 1]), float(instants.time[i])
    for _ in range(40):
        middle = 0.5 * (low + high)
        if not low < middle < high:
            break
        passed = bool(quantity(look(np.array([middle])))[0] >= level)
        low, high = (low, middle) if passed else (middle, high)
    return high
