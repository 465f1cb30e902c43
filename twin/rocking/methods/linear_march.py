"""Advance a linear block through one piece of base motion, stretch by stretch in closed form, impacts exact."""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.error_ellipse import grow
from twin.rocking.march import FELL, FULL, HALF_TURN, REACHED, STUCK
from twin.rocking.methods.contact import lift_off, strike_base
from twin.rocking.methods.equations import SMALL_ROTATION, acceleration, centre
from twin.rocking.methods.segment import (
    FORCE,
    K0,
    LENGTH,
    MU,
    OMEGA,
    PHI0,
    RAMP,
    START,
    THETA,
    V0,
    bend_bound,
    first_fall,
    growing,
    highest,
    motion,
    third_derivative,
)
from twin.rocking.methods.segment import SIDE as ROW_SIDE
from twin.rocking.series import AMPLITUDE, C1, PHASE, T0, base_acceleration
from twin.rocking.series import OMEGA as PIECE_OMEGA
from twin.rocking.state import ALPHA, GRAVITY, OVERTURNED, PEAK, PHI, PSI, RATE, SIDE, TIME, P, note

# Longer stretches, in 1/p, are cut: e^x of them would lose digits.
LONGEST = 4.0


@compiled
def linear_march(
    model: int,
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    rows: FloatArray,
    events: FloatArray,
    used: FloatArray,
) -> int:
    """Advance `state` in place to the finite time `end`; parameters and codes as for `march`.

    In the quasi-linear model the piece must be constant.
    """
    p = body[P]
    while state[TIME] < end:
        if used[0] + 2 >= rows.shape[0] or used[1] + 3 >= events.shape[0]:
            return FULL
        t = state[TIME]
        row = rows[int(used[0])]
        row[:] = 0.0
        row[START] = t
        if state[SIDE] == 0.0:
            lifted = lift_off(model, body, state, piece, end, events, used)
            if state[TIME] > t:
                row[LENGTH] = p * (state[TIME] - t)
                used[0] += 1.0
            if not lifted:
                return REACHED
            continue

        f = _lay_out(model, body, state, piece, t, row)
        whole = p * (end - t)
        h = min(whole, LONGEST)
        if not h > 0.0:
            return STUCK
        after = 0.0
        if state[PHI] == 0.0:
            after = _clear_of_contact(row, h)
            if after < 0.0:
                # The base lets go again within this instant: at rest, and looked at anew one rounding later.
                state[SIDE] = 0.0
                state[TIME] = math.nextafter(t, math.inf)
                continue
        contact = first_fall(row, state[PHI], 1.0, after, h) if after < h else -1.0
        last = contact < 0.0 and h >= whole
        if contact >= 0.0:
            h = contact
        state[PEAK] = highest(row, h, state[PEAK])
        fallen = state[PEAK] >= HALF_TURN
        if fallen:
            state[PEAK] = HALF_TURN
            fall = first_fall(row, HALF_TURN - state[PHI], -1.0, 0.0, h)
            h = fall if fall >= 0.0 else h
        row[LENGTH] = h
        used[0] += 1.0
        s1, _, c = growing(row[MU], h)
        grow(state, c, s1, row[MU] * s1, c, f, h, 0.0)
        moved, v, _ = motion(row, h)
        state[TIME] = end if last else min(t + h / p, end)
        if fallen:
            state[PHI] = HALF_TURN
            state[PSI] = centre(model, body[ALPHA]) - HALF_TURN
            state[RATE] = v
            note(events, used, state[TIME], state[SIDE] * p * v, OVERTURNED)
            return FELL
        if contact < 0.0:
            state[PHI] += moved
            state[PSI] -= moved
            state[RATE] = v
            continue
        strike_base(model, body, state, piece, end, min(v, 0.0), events, used)
    return REACHED


@compiled
def _lay_out(model: int, body: FloatArray, state: FloatArray, piece: FloatArray, t: float, row: FloatArray) -> float:
    """Write the stretch that begins at the state into `row`, and return f there."""
    alpha = body[ALPHA]
    scale = state[SIDE] / body[GRAVITY]
    f = scale * base_acceleration(piece, t)
    row[ROW_SIDE] = state[SIDE]
    row[PHI0] = state[PHI]
    row[V0] = state[RATE]
    row[K0] = acceleration(model, alpha, state[PHI], state[PSI], f)
    row[MU] = 1.0
    if model == SMALL_ROTATION:
        row[MU] = math.cos(alpha) - f * math.sin(alpha)
        return f
    row[RAMP] = scale * piece[C1] / body[P]
    row[FORCE] = scale * piece[AMPLITUDE]
    row[OMEGA] = piece[PIECE_OMEGA] / body[P]
    row[THETA] = piece[PIECE_OMEGA] * (t - piece[T0]) + piece[PHASE]
    return f


@compiled
def _clear_of_contact(row: FloatArray, h: float) -> float:
    """Return a time up to which a block that is just leaving the contact cannot come back, or -1: it does not leave.

    From phi >= v x - B x^2 / 2, or with v = 0 from phi >= k x^2 / 2 - J x^3 / 6, or with k = 0 too from
    phi >= j x^3 / 6 - Q x^4 / 24.
    """
    span = min(h, 1.0)
    bend = bend_bound(row, 0.0, span)
    if row[V0] > 0.0:
        return min(span, row[V0] / bend)
    jerk = third_derivative(row, 0.0, 0.0)
    fourth = abs(row[MU]) * bend + row[OMEGA] * row[OMEGA] * abs(row[FORCE])
    if row[K0] <= 0.0:
        # At the threshold itself, where rounding may leave phi'' below zero.
        row[K0] = 0.0
        return min(span, 2.0 * jerk / fourth) if jerk > 0.0 else -1.0
    if jerk > 0.0:
        return min(span, 2.0 * jerk / fourth)
    return min(span, 1.5 * row[K0] / (abs(jerk) + fourth * span))
