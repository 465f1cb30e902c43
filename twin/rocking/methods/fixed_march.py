"""Advance a block with steps of a given length, shortened only where a contact could hide inside one.

|phi''| has a bound M on the step, so phi leaves its chord by at most M h^2 / 8: a step whose chord stays above that
holds no contact; one that falls through the base with a rate that cannot change its sign holds exactly one, and is
repeated with its length unknown; any other is halved. A block that just left the contact at v cannot come back within
v / M.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import FELL, FULL, HALF_TURN, REACHED, STUCK
from twin.rocking.methods.contact import lift_off, strike_base
from twin.rocking.methods.equations import acceleration, centre
from twin.rocking.methods.schemes import step_to, take_step
from twin.rocking.series import AMPLITUDE, C1, OMEGA, PHASE, T0, T1, base_acceleration
from twin.rocking.state import ALPHA, GRAVITY, OVERTURNED, PEAK, PHI, PSI, RATE, SIDE, TIME, P, note
from twin.rocking.uplift import steepest

# A recorded step: start s, length 1/p, side, phi and v at the start, change of phi, v at the end.
FIXED_COLUMNS = 7
NO_ANSWER = 9
# Below this length (1/p) a step is not halved any more: what it hides is below rounding.
SHORTEST = 1e-8


@compiled
def fixed_march(
    scheme: int,
    model: int,
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    step: float,
    parts: int,
    rows: FloatArray,
    events: FloatArray,
    used: FloatArray,
) -> int:
    """Advance `state` in place to `end` (s) with steps of `step` (s); codes as for `march`, and NO_ANSWER of a step.

    A piece shorter than a step, and the first step after a contact, are taken in `parts`: so that two runs of different
    steps differ there too.
    """
    alpha = body[ALPHA]
    p = body[P]
    regular = p * min(step, (piece[T1] - piece[T0]) / parts)
    start = state[PHI : RATE + 1]
    while state[TIME] < end:
        if used[0] + 2 >= rows.shape[0] or used[1] + 3 >= events.shape[0]:
            return FULL
        t = state[TIME]
        row = rows[int(used[0])]
        if state[SIDE] == 0.0:
            if math.isinf(end):
                return REACHED
            lifted = lift_off(model, body, state, piece, end, events, used)
            if state[TIME] > t:
                row[:] = 0.0
                row[0] = t
                row[1] = p * (state[TIME] - t)
                used[0] += 1.0
            if not lifted:
                return REACHED
            continue

        scale = state[SIDE] / body[GRAVITY]
        whole = p * (end - t)
        h = min(whole, regular)
        if not h > 0.0:
            return STUCK
        bound = greatest_bend(model, body, state, piece, h)
        if state[PHI] == 0.0:
            h = min(h, clear_of_contact(model, body, state, piece, h, bound) / parts)
            if h < 0.0:
                state[SIDE] = 0.0
                state[TIME] = math.nextafter(t, math.inf)
                continue
        touching = state[PHI] == 0.0
        struck = False
        while True:
            moved, v, good = take_step(scheme, model, alpha, piece, t, scale, p, start, h)
            if not good:
                return NO_ANSWER
            phi = state[PHI] + moved
            if phi > 0.0 and (touching or min(state[PHI], phi) > 0.125 * bound * h * h):
                break
            struck = phi <= 0.0 and not touching and max(-state[RATE], -v) > bound * h
            if struck or h < SHORTEST:
                struck = phi <= 0.0
                break
            h *= 0.5
        if struck:
            h, v, good = step_to(scheme, model, alpha, piece, t, scale, p, start, -state[PHI], h)
            moved = -state[PHI]
        fallen = not struck and state[PHI] + moved >= HALF_TURN
        if fallen:
            moved = HALF_TURN - state[PHI]
            h, v, good = step_to(scheme, model, alpha, piece, t, scale, p, start, moved, h)
        if not good:
            return NO_ANSWER
        row[0] = t
        row[1] = h
        row[2] = state[SIDE]
        row[3] = state[PHI]
        row[4] = state[RATE]
        row[5] = moved
        row[6] = v
        used[0] += 1.0
        state[PEAK] = max(state[PEAK], highest_between(row))
        last = h >= whole
        state[TIME] = end if last else min(t + h / p, end)
        if struck:
            strike_base(model, body, state, piece, end, min(v, 0.0), events, used)
            continue
        state[PHI] += moved
        state[PSI] -= moved
        state[RATE] = v
        if fallen:
            state[PHI] = HALF_TURN
            state[PSI] = centre(model, alpha) - HALF_TURN
            state[PEAK] = HALF_TURN
            note(events, used, state[TIME], state[SIDE] * p * v, OVERTURNED)
            return FELL
    return REACHED


@compiled
def greatest_bend(model: int, body: FloatArray, state: FloatArray, piece: FloatArray, h: float) -> float:
    """Return a bound of |phi''| over a step: its value, its growth with phi, and that of the forcing."""
    f = abs(base_acceleration(piece, state[TIME])) / body[GRAVITY]
    change = steepest(piece) / body[GRAVITY] / body[P]
    side = state[SIDE] * base_acceleration(piece, state[TIME]) / body[GRAVITY]
    a = abs(acceleration(model, body[ALPHA], state[PHI], state[PSI], side))
    stiff = 1.0 + f + change * h
    return (a + h * (stiff * (abs(state[RATE]) + a * h) + 2.6 * change)) * (1.0 + stiff * h * h)


@compiled
def clear_of_contact(
    model: int, body: FloatArray, state: FloatArray, piece: FloatArray, h: float, bound: float
) -> float:
    """Return a step after which a block that leaves the contact is surely above it, or -1: it does not leave."""
    v = state[RATE]
    if v > 0.0:
        return min(h, v / bound)
    alpha = body[ALPHA]
    dt = state[TIME] - piece[T0]
    slope = piece[C1] + piece[AMPLITUDE] * piece[OMEGA] * math.cos(piece[OMEGA] * dt + piece[PHASE])
    jerk = -state[SIDE] * slope / body[GRAVITY] / body[P]
    f = state[SIDE] * base_acceleration(piece, state[TIME]) / body[GRAVITY]
    a = acceleration(model, alpha, 0.0, centre(model, alpha), f)
    w = piece[OMEGA] / body[P]
    fourth = (1.0 + abs(f)) * bound + w * w * abs(piece[AMPLITUDE]) / body[GRAVITY] * 2.6
    if jerk > 0.0:
        jerk *= math.cos(alpha)
        return min(h, 2.0 * jerk / fourth)
    if a <= 0.0:
        return -1.0
    return min(h, 1.5 * a / (abs(jerk) + fourth * h))


@compiled
def hermite(row: FloatArray, x: float) -> tuple[float, float]:
    """Return phi and v at x of a recorded step: the cubic through both ends (order 4, as the best of the schemes)."""
    h = row[1]
    s = x / h
    d = row[5]
    a = h * row[4]
    b = h * row[6]
    two = 3.0 * d - 2.0 * a - b
    three = a + b - 2.0 * d
    return row[3] + s * (a + s * (two + s * three)), (a + s * (2.0 * two + 3.0 * s * three)) / h


@compiled
def highest_between(row: FloatArray) -> float:
    """Return the largest phi of a recorded step."""
    best = max(row[3], row[3] + row[5])
    if row[4] > 0.0 > row[6]:
        left = 0.0
        right = row[1]
        for _ in range(60):
            middle = 0.5 * (left + right)
            if hermite(row, middle)[1] > 0.0:
                left = middle
            else:
                right = middle
        best = max(best, hermite(row, left)[0])
    return best


@compiled
def evaluate_fixed(rows: FloatArray, times: FloatArray, p: float, rotation: FloatArray, rate: FloatArray) -> None:
    """Write rotation (rad) and angular velocity (rad/s) at `times` (s)."""
    for i in range(times.size):
        low = 0
        high = rows.shape[0]
        while high - low > 1:
            middle = (low + high) // 2
            if rows[middle, 0] <= times[i]:
                low = middle
            else:
                high = middle
        row = rows[low]
        if row[2] == 0.0:
            rotation[i] = 0.0
            rate[i] = 0.0
            continue
        phi, v = hermite(row, min(max(p * (times[i] - row[0]), 0.0), row[1]))
        rotation[i] = row[2] * phi
        rate[i] = row[2] * v * p
