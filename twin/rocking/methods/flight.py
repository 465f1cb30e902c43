"""Flights over a still base in closed form: time to the contact, its rate, the peak, time to pi/2; units of 1/p.

Nonlinear equation, psi'' = sin(psi): with E = v^2/2 + cos(psi) - 1 < 0 the block turns back at psi_m,
k' = sin(psi_m / 2), k'^2 = (sin(psi/2) - v/2)(sin(psi/2) + v/2), and the time between the turning point and psi is

    u = F(chi, k) = tan(chi) R_F(1, 1 + k'^2 tan^2 chi, 1 + tan^2 chi),    tan(chi) = |v| / (2 k' cos(psi/2)).

With E > 0 it passes the equilibrium: b^2 = E / 2, x = tan(psi / 2), and the time from psi to 0 is
(x / b) R_F(1, 1 + x^2, 1 + x^2 (1 + b^2) / b^2). The first is K(k) - F(asin(cos(alpha/2) / k), k) by the addition
theorem, without its cancellation. R_F after B. C. Carlson, Numer. Algorithms 10, 1995.

Linear models, psi'' = lam^2 psi: exponentials and their logarithms.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import HALF_TURN
from twin.rocking.methods.equations import FULL_EQUATION, centre, growth

FLIGHT_TERMS = 10
# The series of a flight is used below this share of sin(alpha); its terms then fall by a hundred each.
SERIES_SHARE = 0.1


@compiled
def carlson(x: float, y: float, z: float) -> float:
    """Return R_F(x, y, z), at most one argument zero."""
    mean = (x + y + z) / 3.0
    q = 170.0 * max(abs(mean - x), abs(mean - y), abs(mean - z))  # (3 eps)^(-1/8): the series below is of order 7
    dx = mean - x
    dy = mean - y
    power = 1.0
    a = mean
    while q * power > abs(a):
        rx = math.sqrt(x)
        ry = math.sqrt(y)
        rz = math.sqrt(z)
        shift = rx * (ry + rz) + ry * rz
        a = 0.25 * (a + shift)
        x = 0.25 * (x + shift)
        y = 0.25 * (y + shift)
        z = 0.25 * (z + shift)
        power *= 0.25
    dx *= power / a
    dy *= power / a
    dz = -dx - dy
    e2 = dx * dy - dz * dz
    e3 = dx * dy * dz
    # Carlson 1995, eq. 1.4, two more orders of it (DLMF 19.36.1).
    series = (
        1.0
        - e2 / 10.0
        + e3 / 14.0
        + e2 * e2 / 24.0
        - 3.0 * e2 * e3 / 44.0
        - 5.0 * e2 * e2 * e2 / 208.0
        + 3.0 * e3 * e3 / 104.0
        + e2 * e2 * e3 / 16.0
    )
    return series / math.sqrt(a)


@compiled
def turning(psi: float, v: float) -> float:
    """Return k'^2 = sin^2(psi_m / 2) of a state; negative where the block passes the equilibrium."""
    half = math.sin(0.5 * abs(psi))
    return (half - 0.5 * abs(v)) * (half + 0.5 * abs(v))


@compiled
def from_turning(psi: float, v: float, square: float) -> float:
    """Return the time between the turning point and psi, `square` = k'^2 > 0."""
    c = math.cos(0.5 * psi)
    t_squared = v * v / (4.0 * square * c * c)
    return math.sqrt(t_squared) * carlson(1.0, 1.0 + square * t_squared, 1.0 + t_squared)


@compiled
def to_equilibrium(psi: float, square: float) -> float:
    """Return the signed time between psi and the equilibrium on a path that passes it, `square` = b^2 > 0."""
    x = math.tan(0.5 * psi)
    return x / math.sqrt(square) * carlson(1.0, 1.0 + x * x, 1.0 + x * x * (1.0 + square) / square)


@compiled
def strike(model: int, alpha: float, psi: float, v: float) -> tuple[float, float, float]:
    """Return time to the contact, rate there (positive) and the rotation at the turning point, for ahead <= 0.

    The time is infinite on the separatrix itself. The rotation returned is the present one where v <= 0.
    """
    c = centre(model, alpha)
    if model == FULL_EQUATION:
        base = math.sin(0.5 * alpha)
        half = math.sin(0.5 * psi)
        rate = math.sqrt(max(0.0, v * v + 4.0 * (base - half) * (base + half)))
        square = turning(psi, v)
        if square < 0.0:
            # Falling back from beyond the equilibrium.
            b = -square
            return to_equilibrium(alpha, b) - to_equilibrium(psi, b), rate, c - psi
        if square == 0.0:
            if v >= 0.0 or psi <= 0.0:
                return math.inf, rate, c - psi
            return math.log(math.tan(0.25 * alpha) / math.tan(0.25 * psi)), rate, c - psi
        down = from_turning(alpha, rate, square)
        if v <= 0.0:
            return down - from_turning(psi, v, square), rate, c - psi
        k = math.sqrt(square)
        turn = 2.0 * math.asin(k)
        # sin(psi/2) - k' = v^2 / (4 (sin(psi/2) + k')), and the difference of sines taken apart again.
        rise = v * v / (4.0 * (half + k)) / (2.0 * math.cos(0.25 * (psi + turn)))
        return down + from_turning(psi, v, square), rate, (c - psi) + 4.0 * math.asin(rise)
    lam = growth(model, alpha)
    w = v / lam
    rate = math.sqrt(max(0.0, w * w + (c - psi) * (c + psi)))
    grows = 0.5 * (psi - w)
    if grows <= 0.0:
        return math.inf, lam * rate, c - psi
    # psi = grows e^x + (psi + w)/2 e^-x = c
    time = math.log((c + rate) / (2.0 * grows)) / lam
    if psi == c:
        time = 2.0 * math.atanh(w / c) / lam
    peak = c - psi
    if w > 0.0:
        peak += w * w / (psi + math.sqrt((psi - w) * (psi + w)))
    return time, lam * rate, peak


@compiled
def fall(model: int, alpha: float, psi: float, v: float) -> float:
    """Return the time until the rotation reaches pi/2, for ahead > 0."""
    c = centre(model, alpha)
    last = c - HALF_TURN
    if model == FULL_EQUATION:
        square = turning(psi, v)
        if square < 0.0:
            return to_equilibrium(psi, -square) - to_equilibrium(last, -square)
        if square == 0.0:
            return math.log(math.tan(0.25 * last) / math.tan(0.25 * psi))
        end = math.sin(0.5 * last)
        half = math.sin(0.5 * psi)
        rate = math.sqrt(max(0.0, v * v + 4.0 * (end - half) * (end + half)))
        return from_turning(last, rate, square) - math.copysign(from_turning(psi, v, square), v)
    lam = growth(model, alpha)
    grows = 0.5 * (v / lam - psi)
    dies = 0.5 * (psi + v / lam)
    # psi = -grows e^x + dies e^-x = last
    return math.log((-last + math.sqrt(last * last + 4.0 * grows * dies)) / (2.0 * grows)) / lam


@compiled
def flight_series(alpha: float) -> FloatArray:
    """Return b_n of the nonlinear flight time sum b_n v^(2n+1), from a contact left at rate v to the next.

    b_n = a_n B(n + 1, 1/2) 2^-n, see `twin.rocking.rest`.
    """
    series = np.empty(FLIGHT_TERMS)
    s = math.sin(alpha)
    c = math.cos(alpha)
    before = 0.0
    a = 1.0 / s
    beta = 2.0
    for n in range(FLIGHT_TERMS):
        series[n] = a * beta
        following = (c * (2 * n + 1) * a + n * before) / (s * s * (n + 1))
        before = a
        a = following
        beta *= 0.5 * (n + 1) / (n + 1.5)
    return series


@compiled
def bounce(model: int, alpha: float, series: FloatArray, v: float) -> float:
    """Return the time from a contact left at rate v to the next contact, for ahead <= 0."""
    if model == FULL_EQUATION:
        base = math.sin(0.5 * alpha)
        if v < SERIES_SHARE * 2.0 * base:
            total = series[FLIGHT_TERMS - 1]
            for n in range(FLIGHT_TERMS - 2, -1, -1):
                total = total * v * v + series[n]
            return total * v
        square = turning(alpha, v)
        return 2.0 * from_turning(alpha, v, square) if square > 0.0 else math.inf
    lam = growth(model, alpha)
    return 2.0 * math.atanh(v / (lam * centre(model, alpha))) / lam
