"""How far the impacts on a still base can be from a simpler model's, all of them down to rest at once.

On a still base both models keep their energy v2/2 + U(phi) in flight, so each impact leaves eta times the rate that the
one before left, and a flight begun at the rate v lasts

    D(v) = 2 integral du / (U'(u) sqrt(v2 - 2 u)) over u = U(phi) from 0 to v2/2,

    nonlinear     U'2 = sin2(alpha) - 2 u cos(alpha) - u2          (u = cos(alpha - phi) - cos(alpha))
    linearised    U'2 = alpha2 - 2 u                               D = 2 atanh(v / alpha)
    quasi-linear  U'2 = sin2(alpha) - 2 u cos(alpha)               D = 2 atanh(sqrt(C) v / S) / sqrt(C)

The integrands differ by the factor q(u) = U'_simple / U'_nonlinear alone: the nonlinear flight lasts between the least
and the greatest q times the simpler one of the same v. Units of 1/p.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray

SLOWEST = 1e-6
"""Impacts are listed down to this rate, units of p."""
MOST = 5000
"""So many are compared one by one; without loss, the later flights are all alike."""
GRID = 400


@dataclass(frozen=True, slots=True)
class Tail:
    """Bounds of impact times later than the tail's first contact, units of 1/p, one per flight, the limit (rest) last.

    `simple` are the simpler model's times after the contact; `least` and `greatest` bound how much later (or sooner)
    the nonlinear ones come, counted from the nonlinear contact. `lowest` and `highest` bound the nonlinear peak.
    """

    simple: FloatArray
    least: FloatArray
    greatest: FloatArray
    lowest: float
    highest: float


def free_tail(alpha: float, eta: float, v: float, low: float, high: float, *, quasi: bool) -> Tail | None:
    """Return the tail after a contact left at `v` (simpler) and at `low` to `high` (nonlinear), units of p, above 0.

    None where one of the two might pass the barrier on this side.
    """
    s, c = math.sin(alpha), math.cos(alpha)
    barrier = s / math.sqrt(c) if quasi else alpha
    if high >= (1.0 - 1e-9) * min(2.0 * math.sin(0.5 * alpha), barrier) or v >= (1.0 - 1e-9) * barrier:
        return None
    count = MOST if eta >= 1.0 else 1
    if 0.0 < eta < 1.0:
        count = min(MOST, max(1, math.ceil(math.log(SLOWEST / v) / math.log(eta)) + 1))
    shrink: FloatArray = np.power(eta, np.arange(count, dtype=np.float64))
    rates = np.stack([v * shrink, low * shrink, high * shrink])
    energies: FloatArray = 0.5 * np.square(high * shrink)
    root = math.sqrt(c) if quasi else 1.0
    flights = 2.0 * np.arctanh(rates / barrier) / root

    # The extremes of q on a fine grid; between two points it goes beyond both by less than a second difference.
    u = np.arange(GRID, dtype=np.float64) * (0.5 * high * high / (GRID - 1))
    real = s * s - 2.0 * u * c - u * u
    q = np.sqrt(((s * s - 2.0 * u * c) if quasi else (alpha * alpha - 2.0 * u)) / real)
    slack = float(np.max(np.abs(q[2:] - 2.0 * q[1:-1] + q[:-2])))
    shortest = np.minimum.accumulate(q)
    longest = np.maximum.accumulate(q)
    place = np.searchsorted(u[:-1], energies)
    sooner = (shortest[place] - slack) * flights[1] - flights[0]
    later = (longest[place] + slack) * flights[2] - flights[0]

    simple, least, greatest = np.cumsum(flights[0]), np.cumsum(sooner), np.cumsum(later)
    if eta < 1.0:
        # After the last one listed each flight is eta times the one before, or less, and the share by which it differs
        # goes from the last one's to that of an endlessly small one.
        rest = eta / (1.0 - eta) * flights[0, -1]
        simple = np.append(simple, simple[-1] + rest)
        least = np.append(least, least[-1] + rest * min(sooner[-1] / flights[0, -1], q[0] * low / v - 1.0, 0.0))
        greatest = np.append(
            greatest, greatest[-1] + rest * max(later[-1] / flights[0, -1], q[0] * high / v - 1.0, 0.0)
        )
    return Tail(simple, least, greatest, _top(alpha, low), _top(alpha, high))


def _top(alpha: float, v: float) -> float:
    """Return the nonlinear peak after leaving the base at `v`: cos(alpha - phi) = cos(alpha) + v2/2, without loss."""
    half = math.sin(0.5 * alpha) ** 2 - 0.25 * v * v
    return alpha - 2.0 * math.asin(math.sqrt(max(0.0, half)))
