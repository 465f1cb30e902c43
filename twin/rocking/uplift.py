"""When a block at rest begins to rock: the base acceleration passes g tan(alpha)."""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.series import AMPLITUDE, C0, C1, OMEGA, PHASE, T0, base_acceleration

# An acceleration that equals the threshold does not lift the block; nor does one above it by rounding alone.
UPLIFT_TOLERANCE = 4e-15


@compiled
def first_uplift(piece: FloatArray, start: float, end: float, threshold: float) -> float:
    """Return the first time in [start, end) at which |a| exceeds `threshold` (m/s2), or -1.

    The bound: on an interval of width w, |a| exceeds the larger of its ends by at most |A| omega2 w2 / 8. The instant
    returned is the crossing of the threshold itself, on the side where |a| is not below it.
    """
    if piece[C0] == 0.0 and piece[C1] == 0.0 and piece[AMPLITUDE] == 0.0:
        return -1.0
    limit = threshold * (1.0 + UPLIFT_TOLERANCE)
    bend = abs(piece[AMPLITUDE]) * piece[OMEGA] * piece[OMEGA]
    left = start
    right = end
    a_left = abs(base_acceleration(piece, left))
    if a_left > limit:
        return left
    while left < end:
        a_right = abs(base_acceleration(piece, right))
        if a_right > limit:
            width = right - left
            if _monotone(piece, left, right, bend):
                return _crossing(piece, left, right, threshold)
            middle = left + 0.5 * width
            if middle <= left or middle >= right:
                return right
            right = middle
            continue
        width = right - left
        middle = left + 0.5 * width
        if max(a_left, a_right) + 0.125 * bend * width * width <= limit or middle <= left or middle >= right:
            left = right
            a_left = a_right
            right = min(end, left + 2.0 * width)
        else:
            right = middle
    return -1.0


@compiled
def _monotone(piece: FloatArray, left: float, right: float, bend: float) -> bool:
    """Tell whether a keeps its slope's sign on [left, right] and does not pass zero there."""
    middle = 0.5 * (left + right)
    rate = piece[C1]
    if piece[AMPLITUDE] != 0.0:
        rate += piece[AMPLITUDE] * piece[OMEGA] * math.cos(piece[OMEGA] * (middle - piece[T0]) + piece[PHASE])
    if abs(rate) <= 0.5 * bend * (right - left):
        return False
    return base_acceleration(piece, left) * base_acceleration(piece, right) >= 0.0


@compiled
def _crossing(piece: FloatArray, left: float, right: float, threshold: float) -> float:
    """Return where |a| passes `threshold` between `left` (not above) and `right` (above): bisection to one rounding."""
    while True:
        middle = 0.5 * (left + right)
        if middle <= left or middle >= right:
            return right
        if abs(base_acceleration(piece, middle)) > threshold:
            right = middle
        else:
            left = middle


@compiled
def steepest(piece: FloatArray) -> float:
    """Return a bound of |da/dt| over the piece, m/s3."""
    return abs(piece[C1]) + abs(piece[AMPLITUDE] * piece[OMEGA])
