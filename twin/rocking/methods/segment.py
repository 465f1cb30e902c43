"""One stretch of a linear equation in closed form: no impact, one side, one piece of the pulse.

    phi'' = mu phi - q - r x - F (sin(W x + theta) - sin(theta)),    x in 1/p from the start of the stretch

with mu = 1 in the linearised equation; in the quasi-linear one mu = cos(alpha) - f sin(alpha) under constant f (then
r = F = 0), which is negative where cos(alpha) < f sin(alpha): the hyperbolic functions turn trigonometric there
(N. Ceh, doctoral thesis, Rijeka 2018, section 3.3). With k = phi''(0), the solution is written about the start,

    phi = phi0 + v0 S1 + k S2 - r (sinh x - x) - F cos(theta) Y1 + F sin(theta) Y2,
    S1 = sinh(m x) / m,  S2 = (cosh(m x) - 1) / m^2,  m = sqrt(mu),
    Y1 = (W sinh x - sin W x) / (1 + W^2),  Y2 = (W^2 (cosh x - 1) - (1 - cos W x)) / (1 + W^2),

so that a short stretch loses nothing to cancellation: S1, S2 by half angles, Y1, Y2 by their series where x is small.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled

START, LENGTH, SIDE, PHI0, V0, K0, MU, RAMP, FORCE, OMEGA, THETA = range(11)
COLUMNS = 11
# Below this, of x and W x, the series are used: their terms fall at least as fast as 1 / n!.
SMALL = 1.0
SERIES_TERMS = 11


@compiled
def growing(mu: float, x: float) -> tuple[float, float, float]:
    """Return S1, S2 and cosh(m x) for `mu` of either sign."""
    if mu > 0.0:
        m = math.sqrt(mu)
        half = math.sinh(0.5 * m * x) / m
        return math.sinh(m * x) / m, 2.0 * half * half, math.cosh(m * x)
    if mu < 0.0:
        m = math.sqrt(-mu)
        half = math.sin(0.5 * m * x) / m
        return math.sin(m * x) / m, 2.0 * half * half, math.cos(m * x)
    return x, 0.5 * x * x, 1.0


@compiled
def harmonic(w: float, x: float) -> tuple[float, float, float]:
    """Return Y1, Y2 and Y1'."""
    s = math.sinh(0.5 * x)
    c = math.sin(0.5 * w * x)
    rate = 2.0 * w * (s * s + c * c) / (1.0 + w * w)
    if max(x, w * x) > SMALL:
        y1 = (w * math.sinh(x) - math.sin(w * x)) / (1.0 + w * w)
        return y1, 2.0 * (w * w * s * s - c * c) / (1.0 + w * w), rate
    # (1 - (-W^2)^n) / (1 + W^2) = 1 - W^2 + W^4 ..., n terms.
    g = 1.0
    y1 = 0.0
    y2 = 0.0
    odd = w * x * x * x / 6.0
    for n in range(1, SERIES_TERMS):
        y1 += g * odd
        even = odd * x * w / (2 * n + 2)
        y2 += g * even
        g = 1.0 - w * w * g
        odd *= x * x / ((2 * n + 2) * (2 * n + 3))
    return y1, y2, rate


@compiled
def excess(x: float) -> float:
    """Return sinh(x) - x."""
    if x > SMALL:
        return math.sinh(x) - x
    total = 0.0
    term = x * x * x / 6.0
    for n in range(2, SERIES_TERMS):
        total += term
        term *= x * x / ((2 * n) * (2 * n + 1))
    return total


@compiled
def motion(row: FloatArray, x: float) -> tuple[float, float, float]:
    """Return phi - phi0, phi' and phi'' at `x`."""
    s1, s2, c = growing(row[MU], x)
    moved = row[V0] * s1 + row[K0] * s2
    v = row[V0] * c + row[K0] * s1
    bend = row[V0] * row[MU] * s1 + row[K0] * c
    if row[RAMP] != 0.0:
        half = math.sinh(0.5 * x)
        moved -= row[RAMP] * excess(x)
        v -= row[RAMP] * 2.0 * half * half
        bend -= row[RAMP] * math.sinh(x)
    if row[FORCE] != 0.0:
        w = row[OMEGA]
        y1, y2, rate = harmonic(w, x)
        along = row[FORCE] * math.cos(row[THETA])
        across = row[FORCE] * math.sin(row[THETA])
        moved += across * y2 - along * y1
        v += across * w * y1 - along * rate
        bend += across * w * rate - along * w * (math.sinh(x) + w * math.sin(w * x)) / (1.0 + w * w)
    return moved, v, bend


@compiled
def third_derivative(row: FloatArray, x: float, v: float) -> float:
    """Return phi''' at `x`, given phi' there."""
    jerk = row[MU] * v - row[RAMP]
    if row[FORCE] != 0.0:
        jerk -= row[FORCE] * row[OMEGA] * math.cos(row[OMEGA] * x + row[THETA])
    return jerk


@compiled
def bend_bound(row: FloatArray, x: float, h: float) -> float:
    """Return a bound of |phi''| on [x, x + h]: its own equation, (phi'')'' = mu phi'' + F W^2 sin, started at x."""
    _, v, bend = motion(row, x)
    s1, s2, c = growing(abs(row[MU]), h)
    force = row[OMEGA] * row[OMEGA] * abs(row[FORCE])
    return abs(bend) * c + abs(third_derivative(row, x, v)) * s1 + force * s2


@compiled
def first_fall(row: FloatArray, offset: float, sign: float, start: float, end: float) -> float:
    """Return the first x in (start, end] where offset + sign (phi - phi0) is no longer above zero, or -1.

    It is above zero at `start`. The curve leaves its chord on a window of width h by at most B h^2 / 8: a window whose
    chord stays above that holds no root; others are halved, the left half first.
    """
    left = start
    moved, _, _ = motion(row, left)
    y_left = offset + sign * moved
    width = min(end - start, 1.0)
    while left < end:
        right = min(end, left + width)
        h = right - left
        moved, v, _ = motion(row, right)
        y_right = offset + sign * moved
        bound = bend_bound(row, left, h)
        if min(y_left, y_right) > 0.125 * bound * h * h:
            left = right
            y_left = y_right
            width = 2.0 * h
            continue
        if y_right <= 0.0 and abs(v) > bound * h:
            return _bracketed(row, offset, sign, left, right)
        if h <= 1e-14 * max(right, 1e-3 * (end - start)) or left + 0.5 * h <= left:
            return right
        width = 0.5 * h
    return -1.0


@compiled
def _bracketed(row: FloatArray, offset: float, sign: float, left: float, right: float) -> float:
    """Return the root in [left, right], where the curve falls through zero once (Newton, kept in its bracket)."""
    x = right
    for _ in range(100):
        moved, v, _ = motion(row, x)
        y = offset + sign * moved
        if y > 0.0:
            left = x
        else:
            right = x
        new = x - y / (sign * v) if v != 0.0 else left
        if not left <= new <= right:
            new = 0.5 * (left + right)
        if abs(new - x) <= 1.2e-16 * abs(x) or not left < new < right:
            return new
        x = new
    return x


@compiled
def highest(row: FloatArray, end: float, known: float) -> float:
    """Return the larger of `known` and the maximum of phi on [0, end] (chords and bounds, as in `first_fall`)."""
    phi0 = row[PHI0]
    last, _, _ = motion(row, end)
    best = max(known, phi0, phi0 + last)
    left = 0.0
    y_left = phi0
    width = min(end, 1.0)
    while left < end:
        right = min(end, left + width)
        h = right - left
        moved, _, _ = motion(row, right)
        y_right = phi0 + moved
        best = max(best, y_right)
        if max(y_left, y_right) + 0.125 * bend_bound(row, left, h) * h * h <= best * (1.0 + 4e-16) or h <= 1e-9 * end:
            left = right
            y_left = y_right
            width = 2.0 * h
        else:
            width = 0.5 * h
    return best


@compiled
def row_at(rows: FloatArray, t: float) -> int:
    """Return the last row that starts at or before `t`, or the first."""
    low = 0
    high = rows.shape[0]
    while high - low > 1:
        middle = (low + high) // 2
        if rows[middle, START] <= t:
            low = middle
        else:
            high = middle
    return low


@compiled
def evaluate_rows(rows: FloatArray, times: FloatArray, p: float, rotation: FloatArray, rate: FloatArray) -> None:
    """Write rotation (rad) and angular velocity (rad/s) at `times` (s) from consecutive stretches."""
    for i in range(times.size):
        row = rows[row_at(rows, times[i])]
        if row[SIDE] == 0.0:
            rotation[i] = 0.0
            rate[i] = 0.0
            continue
        x = min(max(p * (times[i] - row[START]), 0.0), row[LENGTH])
        moved, v, _ = motion(row, x)
        rotation[i] = row[SIDE] * (row[PHI0] + moved)
        rate[i] = row[SIDE] * v * p
