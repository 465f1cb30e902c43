"""Roots and extremes of a step's own polynomial, found with bounds that cannot jump one.

A polynomial is its coefficients c[0..n] in rising powers. On [l, r] with 0 <= l, its second derivative is bounded by
B(r) = sum k (k - 1) |c_k| r^(k-2), so it cannot leave the chord by more than B (r - l)^2 / 8: an interval whose chord
stays above that holds no root. Intervals that cannot be excluded are halved, the left half first.
"""

from __future__ import annotations

from twin.rocking.compiled import FloatArray, compiled

NO_ROOT = -1.0
# Below this width, relative to the interval, halving stops: the curve touches zero within rounding.
GRAZING_WIDTH = 1e-14


@compiled
def value(c: FloatArray, n: int, x: float) -> float:
    """Return the polynomial of degree `n` at `x` (Horner)."""
    y = c[n]
    for k in range(n - 1, -1, -1):
        y = y * x + c[k]
    return y


@compiled
def slope(c: FloatArray, n: int, x: float) -> float:
    """Return the first derivative at `x`."""
    y = n * c[n]
    for k in range(n - 1, 0, -1):
        y = y * x + k * c[k]
    return y


@compiled
def bend_bound(c: FloatArray, n: int, x: float) -> float:
    """Return a bound of the second derivative's magnitude on [0, x]."""
    y = n * (n - 1) * abs(c[n])
    for k in range(n - 1, 1, -1):
        y = y * x + k * (k - 1) * abs(c[k])
    return y


@compiled
def bracketed_root(c: FloatArray, n: int, left: float, right: float) -> float:
    """Return the root in [left, right] of a curve that falls through zero there (Newton, kept in its bracket)."""
    x = 0.5 * (left + right)
    for _ in range(100):
        y = value(c, n, x)
        if y > 0.0:
            left = x
        else:
            right = x
        d = slope(c, n, x)
        step = y / d if d != 0.0 else 0.0
        new = x - step
        if not (left < new < right):
            new = 0.5 * (left + right)
        if abs(new - x) <= 1.2e-16 * abs(x) or new in (left, right):
            return new
        x = new
    return x


@compiled
def first_root(c: FloatArray, n: int, end: float) -> tuple[float, bool]:
    """Return the first x in (0, end] where the polynomial, above zero at 0, is no longer above it.

    Returns
    -------
    tuple of float and bool
        The root or `NO_ROOT`; and whether the curve merely grazes zero, so that rounding decides.
    """
    left = 0.0
    right = end
    y_left = c[0]
    while True:
        y_right = value(c, n, right)
        width = right - left
        bend = bend_bound(c, n, right)
        if min(y_left, y_right) > 0.125 * bend * width * width:
            if right >= end:
                return NO_ROOT, False
            # Next: the rest of the step, from here.
            left = right
            y_left = y_right
            right = min(end, left + 2.0 * width)
            continue
        if y_right <= 0.0 < y_left:
            middle = 0.5 * (left + right)
            if abs(slope(c, n, middle)) > 0.5 * bend * width:
                return bracketed_root(c, n, left, right), False
        if width <= GRAZING_WIDTH * end or y_left <= 0.0:
            if y_right > 0.0 and y_left > 0.0:
                # Both ends above zero by less than the bound: a touch that rounding decides. Counted as contact.
                return right, True
            return right, y_left > 0.0 and slope(c, n, right) >= 0.0
        right = 0.5 * (left + right)


@compiled
def maximum(c: FloatArray, n: int, end: float, known: float) -> float:
    """Return the larger of `known` and the maximum on [0, end]; `known` or c[0] must not be below zero."""
    best = max(known, c[0], value(c, n, end))
    left = 0.0
    right = end
    while left < end:
        width = right - left
        top = max(value(c, n, left), value(c, n, right))
        best = max(best, top)
        bend = bend_bound(c, n, right)
        settled = top + 0.125 * bend * width * width <= best * (1.0 + 4e-16) or width <= 1e-9 * end
        rising = slope(c, n, left)
        if not settled:
            # Where the slope cannot change sign, the ends, already counted, are the highest.
            settled = abs(rising) > bend * width
        if not settled and rising > 0.0 > slope(c, n, right) and _concave(c, n, left, right):
            best = max(best, value(c, n, _level(c, n, left, right)))
            settled = True
        if settled:
            left = right
            right = min(end, left + 2.0 * width)
        else:
            right = 0.5 * (left + right)
    return best


@compiled
def _concave(c: FloatArray, n: int, left: float, right: float) -> bool:
    """Tell whether the second derivative is surely negative on [left, right]: its middle, and a bound of the third."""
    x = 0.5 * (left + right)
    middle = n * (n - 1) * c[n]
    twist = n * (n - 1) * (n - 2) * abs(c[n])
    for k in range(n - 1, 1, -1):
        middle = middle * x + k * (k - 1) * c[k]
    for k in range(n - 1, 2, -1):
        twist = twist * right + k * (k - 1) * (k - 2) * abs(c[k])
    return middle + 0.5 * (right - left) * twist < 0.0


@compiled
def _level(c: FloatArray, n: int, left: float, right: float) -> float:
    """Return a point in [left, right] where the slope, positive at the left and negative at the right, is near zero."""
    high = slope(c, n, left)
    low = slope(c, n, right)
    enough = 1e-10 * (high - low)
    x = left
    stayed = 0
    for _ in range(60):
        x = left + (right - left) * high / (high - low)
        y = slope(c, n, x)
        if abs(y) <= enough or not left < x < right:
            break
        # Regula falsi after Illinois: an end that stays twice counts half.
        if y > 0.0:
            left = x
            high = y
            if stayed == 1:
                low *= 0.5
            stayed = 1
        else:
            right = x
            low = y
            if stayed == -1:
                high *= 0.5
            stayed = -1
    return x
