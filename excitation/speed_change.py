"""The shortest change of speed at a limited acceleration and, where there is one, a limited jerk."""

from __future__ import annotations

import math

from excitation.pieces import Span, steady


def speed_change(change: float, acceleration: float, jerk: float | None) -> list[Span]:
    """Return the spans that change the speed by `change`.

    Without a jerk limit one rectangle of acceleration; with it a trapezoid, or a triangle where `change` is too small
    to reach `acceleration` (|change| < acceleration^2 / jerk). All are symmetric in time, so the mean speed is halfway.

    Parameters
    ----------
    change : float
        Change of speed, m/s, of either sign.
    acceleration : float
        Largest |a|, m/s2, above 0.
    jerk : float or None
        Largest |da/dt|, m/s3, above 0; None allows jumps.
    """
    if change == 0.0:
        return []
    sense, size = math.copysign(1.0, change), abs(change)
    if jerk is None:
        return [steady(size / acceleration, sense * acceleration)]
    peak = min(acceleration, math.sqrt(size * jerk))
    ramp, hold = peak / jerk, max(size / peak - peak / jerk, 0.0)
    slope, peak = sense * jerk, sense * peak
    return [steady(ramp, 0.0, slope), steady(hold, peak), steady(ramp, peak, -slope)]


def change_time(change: float, acceleration: float, jerk: float | None) -> float:
    """Return the duration of `speed_change`, s."""
    return sum(span[0] for span in speed_change(change, acceleration, jerk))


def stopping_distance(velocity: float, deceleration: float, jerk: float | None) -> float:
    """Return the signed distance, m, in which `velocity` (m/s) comes to rest by `speed_change`.

    Examples
    --------
    >>> stopping_distance(-2.0, 4.0, None)
    -0.5
    """
    return 0.5 * velocity * change_time(velocity, deceleration, jerk)
