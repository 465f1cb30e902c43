"""What every stepping method does at the base: lift off, impact, and the end of endless impacts.

The rules are those of `twin.rocking.march`, for any of the three equations.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.error_ellipse import LARGEST_IMPACT_CHANGE, LARGEST_LINEAR
from twin.rocking.march import (
    ALPHA,
    AT_REST,
    DEAD_RATE,
    DOUBT,
    E11,
    E12,
    E22,
    GRAVITY,
    IMPACT,
    PHI,
    PSI,
    RATE,
    REST,
    REST_RATE,
    RESTITUTION,
    SIDE,
    THRESHOLD,
    TIME,
    UPLIFT,
    WORST,
    P,
)
from twin.rocking.methods.equations import acceleration, centre, time_to_rest
from twin.rocking.rest import remaining_time_forced
from twin.rocking.series import base_acceleration
from twin.rocking.uplift import first_uplift, steepest

EPSILON = 2.3e-16


@compiled
def note(events: FloatArray, used: FloatArray, t: float, rate: float, code: float) -> None:
    """Append an event: time s, signed rate rad/s, code."""
    row = events[int(used[1])]
    row[0] = t
    row[1] = rate
    row[2] = code
    used[1] += 1.0


@compiled
def lift_off(
    model: int, body: FloatArray, state: FloatArray, piece: FloatArray, end: float, events: FloatArray, used: FloatArray
) -> bool:
    """Let a block at rest wait for its uplift, at most to `end`; return whether it lifted."""
    lift = first_uplift(piece, state[TIME], end, body[THRESHOLD])
    state[TIME] = end if lift < 0.0 else lift
    if lift < 0.0:
        return False
    state[SIDE] = -1.0 if base_acceleration(piece, lift) > 0.0 else 1.0
    state[PHI] = 0.0
    state[PSI] = centre(model, body[ALPHA])
    state[RATE] = 0.0
    note(events, used, lift, 0.0, UPLIFT)
    return True


@compiled
def strike_base(
    model: int,
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    before: float,
    events: FloatArray,
    used: FloatArray,
) -> None:
    """Impact at the state's time with rate `before` <= 0: v = -eta v about the other corner, or rest."""
    alpha = body[ALPHA]
    eta = body[RESTITUTION]
    note(events, used, state[TIME], state[SIDE] * body[P] * before, IMPACT)
    f = state[SIDE] * base_acceleration(piece, state[TIME]) / body[GRAVITY]
    c = centre(model, alpha)
    leaving = acceleration(model, alpha, 0.0, c, f)
    entering = acceleration(model, alpha, 0.0, c, -f)
    _reflect(state, eta, before, leaving, entering)
    state[SIDE] = -state[SIDE]
    state[PHI] = 0.0
    state[PSI] = c
    state[RATE] = -eta * before
    if state[RATE] < REST_RATE:
        _settle(
            model, body, state, piece, end, abs(f), min(-leaving, -entering), max(-leaving, -entering), events, used
        )


@compiled
def _reflect(state: FloatArray, eta: float, before: float, leaving: float, entering: float) -> None:
    """Carry the error over an impact (saltation): d(v)+ = -eta d(v) + (eta phi''- + phi''+) / v- d(phi)."""
    if before == 0.0:
        state[DOUBT] = 1.0
        return
    m = (eta * leaving + entering) / before
    if math.sqrt(state[E11]) * abs(leaving) > LARGEST_IMPACT_CHANGE * before * before:
        state[DOUBT] = 1.0
    e11, e12, e22 = state[E11], state[E12], state[E22]
    state[E11] = eta * eta * e11
    state[E12] = eta * eta * e12 - eta * m * e11
    state[E22] = eta * eta * e22 - 2.0 * eta * m * e12 + m * m * e11


@compiled
def carry_linear(state: FloatArray, c: float, s: float, q: float, r: float, force: float, h: float) -> None:
    """Carry the error over a stretch with transition matrix [[c, s], [q, r]], and add its rounding."""
    e11, e12, e22 = state[E11], state[E12], state[E22]
    d = EPSILON * min(abs(state[PHI]) + abs(state[RATE]) * h, 2.0)
    w = EPSILON * (abs(state[RATE]) + (1.0 + abs(force)) * h)
    state[E11] = c * c * e11 + 2.0 * c * s * e12 + s * s * e22 + d * d + w * w * h * h
    state[E12] = c * q * e11 + (c * r + s * q) * e12 + s * r * e22
    state[E22] = q * q * e11 + 2.0 * q * r * e12 + r * r * e22 + w * w
    worst = math.sqrt(state[E11])
    state[WORST] = max(state[WORST], worst)
    if worst > LARGEST_LINEAR:
        state[DOUBT] = 1.0


@compiled
def _settle(
    model: int,
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    f: float,
    weak: float,
    strong: float,
    events: FloatArray,
    used: FloatArray,
) -> None:
    """Put a block whose impacts have become tiny to rest, where they end before anything changes."""
    p = body[P]
    v = state[RATE]
    if v == 0.0:
        left = 0.0
    elif weak <= 0.0:
        return
    elif f == 0.0:
        left = time_to_rest(model, body[ALPHA], body[RESTITUTION], v)
    else:
        left = remaining_time_forced(v, weak, strong, body[RESTITUTION])
    if math.isinf(left):
        return
    change = steepest(piece) / body[GRAVITY] / p * left
    if v > DEAD_RATE and (state[TIME] + left / p > end or change > 0.1 * weak):
        return
    state[TIME] = min(state[TIME] + left / p, end)
    state[SIDE] = 0.0
    state[RATE] = 0.0
    state[E11] = 0.0
    state[E12] = 0.0
    state[E22] = 0.0
    if weak > 0.0:
        state[AT_REST] = state[TIME]
        note(events, used, state[TIME], 0.0, REST)
