"""How long the endless sequence of impacts takes to come to rest."""

from __future__ import annotations

import math

from twin.rocking.compiled import compiled

# Free rocking with post-impact rates below this (in units of p) is summed by the series instead of stepped through.
SERIES_RATE = 1e-2
TERMS = 12


@compiled
def remaining_time(v: float, alpha: float, restitution: float) -> float:
    """Return p times the time from an impact left at rate `v` (units of p) to rest, on a still base.

    t = sum_n a_n B(n + 1, 1/2) 2^-n v^(2n+1) / (1 - eta^(2n+1)),  a_0 = 1 / S,
    a_(n+1) = (C (2n+1) a_n + n a_(n-1)) / (S^2 (n+1)),  S = sin(alpha), C = cos(alpha).

    The flight between two impacts lasts 2 integral d(phi) / v(phi); expanding it in the rate and summing each power
    over the impacts, whose rates fall by eta, gives the series. Infinite where eta is 1.
    """
    if v == 0.0:
        return 0.0
    if restitution >= 1.0:
        return math.inf
    s = math.sin(alpha)
    c = math.cos(alpha)
    before = 0.0
    a = 1.0 / s
    beta = 2.0  # B(1, 1/2)
    power = v
    damped = restitution
    total = 0.0
    for n in range(TERMS):
        total += a * beta * power / (1.0 - damped)
        following = (c * (2 * n + 1) * a + n * before) / (s * s * (n + 1))
        before = a
        a = following
        beta *= (n + 1) / (n + 1.5)  # B(n+2, 1/2) / B(n+1, 1/2)
        power *= 0.5 * v * v
        damped *= restitution * restitution
    return total


@compiled
def remaining_time_forced(v: float, weak: float, strong: float, restitution: float) -> float:
    """Return p times the time to rest under a base acceleration that stays as it is while the rate is tiny.

    The flights alternate between the two corners, which pull back with `weak` and `strong` (units of p2); each lasts
    2 v / pull: 2 v (1 / weak + eta / strong) / (1 - eta^2), whichever comes first being taken as the weak one.
    """
    if restitution >= 1.0:
        return math.inf
    return 2.0 * v * (1.0 / weak + restitution / strong) / (1.0 - restitution * restitution)
