"""What every stepping method does at the base: lift off, impact, and the end of endless impacts.

The rules are those of `twin.rocking.march`, for any of the three equations.
"""

from __future__ import annotations

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.error_ellipse import saltate
from twin.rocking.march import REST_RATE, rest_after
from twin.rocking.methods.equations import acceleration, centre, time_to_rest
from twin.rocking.rest import remaining_time_forced
from twin.rocking.series import base_acceleration
from twin.rocking.state import (
    ALPHA,
    GRAVITY,
    IMPACT,
    PHI,
    PSI,
    RATE,
    RESTITUTION,
    SIDE,
    THRESHOLD,
    TIME,
    UPLIFT,
    P,
    note,
)
from twin.rocking.uplift import first_uplift


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
    saltate(state, eta, before, leaving, entering)
    state[SIDE] = -state[SIDE]
    state[PHI] = 0.0
    state[PSI] = c
    state[RATE] = -eta * before
    if state[RATE] < REST_RATE:
        _settle(
            model, body, state, piece, end, abs(f), min(-leaving, -entering), max(-leaving, -entering), events, used
        )


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
    v = state[RATE]
    if v == 0.0:
        left = 0.0
    elif weak <= 0.0:
        return
    elif f == 0.0:
        left = time_to_rest(model, body[ALPHA], body[RESTITUTION], v)
    else:
        left = remaining_time_forced(v, weak, strong, body[RESTITUTION])
    rest_after(body, state, piece, end, left, weak, 1.0, events, used)
