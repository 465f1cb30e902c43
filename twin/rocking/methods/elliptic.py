"""Where a free block is after a given time, by Jacobi's elliptic functions (nonlinear equation; units of 1/p).

psi'' = sin(psi) is a pendulum turned over. With w = the time from the turning point, and from there backwards,

    turns back, k'^2 = sin^2(psi_m / 2) > 0:    sin(psi/2) = dn(w'), cos(psi/2) = k sn(w'), |v| = 2 k cn(w'), w' = K - w

and, with w from the equilibrium, b^2 = E/2 and the modulus k = 1 / sqrt(1 + b^2),

    passes it:                                  tan(psi/2) = k' sc(w / k)

(P. F. Byrd & M. D. Friedman, Handbook of Elliptic Integrals, 1971). The amplitude comes from the arithmetic-geometric
mean (Abramowitz & Stegun 16.4), with the complementary modulus given directly. Shortly after a known state, and in low
flights, a Taylor series is used: there phi is small beside psi, whose rounding would show.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import compiled
from twin.rocking.methods.flight import carlson, from_turning, to_equilibrium, turning
from twin.rocking.series import ORDER, rocking_series

LEVELS = 12
# Up to this time from the known state, and for flights that leave the contact below LOW, phi comes from its series.
NEAR = 0.5
LOW = 0.1


@compiled
def amplitude(u: float, square: float) -> float:
    """Return am(u, k), k'^2 = `square` in (0, 1]."""
    a = np.empty(LEVELS + 1)
    c = np.empty(LEVELS + 1)
    b = math.sqrt(square)
    a[0] = 1.0
    c[0] = math.sqrt(max(0.0, 1.0 - square))
    n = 0
    while n < LEVELS and abs(c[n]) > 1e-16 * a[n]:
        following = 0.5 * (a[n] + b)
        c[n + 1] = 0.5 * (a[n] - b)
        b = math.sqrt(a[n] * b)
        a[n + 1] = following
        n += 1
    angle = a[n] * u * 2.0**n
    for i in range(n, 0, -1):
        angle = 0.5 * (angle + math.asin(c[i] / a[i] * math.sin(angle)))
    return angle


@compiled
def series_position(phi: float, psi: float, v: float, x: float) -> tuple[float, float, float]:
    """Return phi, psi and v after x by the Taylor series of order 24, in steps of at most `NEAR`."""
    forcing = np.zeros(ORDER + 1)
    c = np.zeros(ORDER + 1)
    work = np.zeros((3, ORDER + 1))
    while True:
        h = min(x, NEAR / max(1.0, abs(v)))
        rocking_series(psi, phi, v, forcing, 1, c, work)
        moved = c[ORDER]
        rate = ORDER * c[ORDER]
        for k in range(ORDER - 1, 0, -1):
            moved = moved * h + c[k]
            rate = rate * h + k * c[k]
        moved *= h
        phi += moved
        psi -= moved
        v = rate
        x -= h
        if x <= 0.0:
            return phi, psi, v


@compiled
def position(alpha: float, phi: float, psi: float, v: float, x: float) -> tuple[float, float, float]:
    """Return phi, psi and v a time x after the given state, whatever happens at phi = 0."""
    if x <= NEAR or (phi == 0.0 and v < LOW):
        return series_position(phi, psi, v, x)
    square = turning(psi, v)
    if square > 0.0:
        k = math.sqrt(1.0 - square)
        sign = math.copysign(1.0, psi)
        w = x - math.copysign(from_turning(psi, v, square), sign * v)
        angle = amplitude(carlson(0.0, square, 1.0) - abs(w), square)
        cosine = math.cos(angle)
        sine = math.sin(angle)
        psi = sign * 2.0 * math.atan2(math.sqrt(cosine * cosine + square * sine * sine), k * sine)
        return alpha - psi, psi, -sign * math.copysign(2.0 * k * cosine, w)
    if square < 0.0:
        b = -square
        w = to_equilibrium(psi, b) - math.copysign(x, v)
        angle = amplitude(abs(w) * math.sqrt(1.0 + b), b / (1.0 + b))
        psi = math.copysign(2.0 * math.atan(math.sqrt(b / (1.0 + b)) * math.tan(angle)), w)
        half = math.sin(0.5 * psi)
        return alpha - psi, psi, math.copysign(2.0 * math.sqrt(b + half * half), v)
    psi = 4.0 * math.atan(math.tan(0.25 * psi) * math.exp(-math.copysign(x, v * psi)))
    return alpha - psi, psi, math.copysign(2.0 * math.sin(0.5 * abs(psi)), v) if v != 0.0 else 0.0
