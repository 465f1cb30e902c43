"""How far the nearest other outcome is: in amplitude, in frequency, and to a given probability."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from twin.rocking.batch.codes import OVERTURNED, UNDECIDED
from twin.rocking.batch.many import outcomes_of
from twin.rocking.compiled import FloatArray
from twin.rocking.state import GRAVITY, THRESHOLD, P
from twin.simulation import overturns
from twin.uncertainty.population import Population

RANGE, STEP = 0.5, 0.001
"""Looked for over +-50 % in steps of 0.1 %; a thinner window of another outcome can be missed."""
CLOSE_ENOUGH = 1e-6
COARSE_STEP, COARSE_FUTURES = 0.05, 200
FINE_FUTURES, HALVINGS = 1000, 5


@dataclass(frozen=True, slots=True)
class Boundary:
    """Smallest relative changes that change whether the block overturns; None where 50 % does not.

    `down` is negative, `up` positive.
    """

    down: float | None
    up: float | None

    @property
    def nearest(self) -> float | None:
        """The nearer of the two."""
        known = [value for value in (self.down, self.up) if value is not None]
        return min(known, key=abs) if known else None


def amplitude_boundary(body: FloatArray, rows: FloatArray, rotation: float) -> Boundary:
    """Return how much stronger or weaker the base motion `rows` has to be for another outcome of one block.

    The whole motion is scaled, its brake with it.
    """

    def changed(change: float) -> FloatArray:
        other = body.copy()
        other[[GRAVITY, THRESHOLD]] /= 1.0 + change
        return other

    return _boundary(changed, rows, rotation)


def frequency_boundary(body: FloatArray, rows: FloatArray, rotation: float) -> Boundary:
    """Return how much faster or slower the base motion `rows` has to be, at the same accelerations.

    Time and 1/p only matter as a ratio: a motion (1 + x) times as fast is one under which p is as much smaller.
    """

    def changed(change: float) -> FloatArray:
        other = body.copy()
        other[P] /= 1.0 + change
        return other

    return _boundary(changed, rows, rotation)


def _boundary(changed: Callable[[float], FloatArray], rows: FloatArray, rotation: float) -> Boundary:
    steps = np.arange(1, round(RANGE / STEP) + 1) * STEP
    changes = np.concatenate([[0.0], steps, -steps])
    bodies = np.array([changed(float(change)) for change in changes])
    codes = outcomes_of(
        bodies, rows[None], np.zeros(len(changes), dtype=np.int64), np.full(len(changes), rotation)
    ).codes
    kinds = np.where(codes == UNDECIDED, 2, codes == OVERTURNED)

    def nearest(part: slice, way: float) -> float | None:
        other = np.nonzero(kinds[part] != kinds[0])[0]
        if not other.size:
            return None
        outside = way * float(steps[other[0]])
        inside = way * (float(steps[other[0] - 1]) if other[0] else 0.0)
        now = overturns(changed(0.0), rows, rotation=rotation)
        while abs(outside - inside) > CLOSE_ENOUGH:
            middle = 0.5 * (inside + outside)
            same = overturns(changed(middle), rows, rotation=rotation) == now
            inside, outside = (middle, outside) if same else (inside, middle)
        return outside

    return Boundary(nearest(slice(1 + len(steps), None), -1.0), nearest(slice(1, 1 + len(steps)), 1.0))


def level(population: Population, pieces: FloatArray, probability: float, fine: int = FINE_FUTURES) -> float | None:
    """Return the factor of amplitude, from 1 - `RANGE` to 1 + `RANGE`, at which falling is first as likely.

    None where it is not, or already is at the least factor. First a few futures tell between which two of the coarse
    steps, then `fine` where: its own error is that of so many.
    """
    few, more = population.first(min(COARSE_FUTURES, fine)), population.first(fine)
    below = 1.0 - RANGE
    if few.scaled(below).probability(pieces).estimate >= probability:
        return None
    for factor in np.arange(below + COARSE_STEP, 1.0 + RANGE + 0.5 * COARSE_STEP, COARSE_STEP).tolist():
        if few.scaled(factor).probability(pieces).estimate >= probability:
            low, high = below, factor
            for _ in range(HALVINGS):
                middle = 0.5 * (low + high)
                reached = more.scaled(middle).probability(pieces).estimate >= probability
                low, high = (low, middle) if reached else (middle, high)
            return 0.5 * (low + high)
        below = factor
    return None
