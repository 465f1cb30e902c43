"""Advance one block through one piece of base motion, with every impact at its exact time.

Guards and what follows them (the state is on one side s = +1 or -1, or at rest, s = 0):

    phi reaches 0 from above        impact: v = -eta v, the other corner (s = -s)
    the rate after it is tiny       rest, where the base would not lift it again
    at rest, |a| passes g tan alpha uplift about the corner away from the acceleration (s = -sign a)
    phi reaches pi/2                overturned, terminal

A step starts with phi = 0 exactly, or above it: the polynomial is divided by its known root first, so a contact just
left is never found again, and the next one never missed.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.error_ellipse import carry, reflect
from twin.rocking.polynomial import NO_ROOT, first_root, maximum, slope
from twin.rocking.rest import remaining_time, remaining_time_forced
from twin.rocking.series import (
    ORDER,
    T0,
    T1,
    base_acceleration,
    forcing_series,
    rocking_series,
    step_length,
)
from twin.rocking.state import (
    ALPHA,
    AT_REST,
    DOUBT,
    E11,
    E12,
    E22,
    GRAVITY,
    IMPACT,
    OVERTURNED,
    PEAK,
    PHI,
    PSI,
    RATE,
    REST,
    RESTITUTION,
    SIDE,
    STRIDE,
    THRESHOLD,
    TIME,
    TOLERANCE,
    UPLIFT,
    P,
    note,
    record,
)
from twin.rocking.uplift import first_uplift, steepest

REACHED, FELL, FULL, CAME_TO_REST, STUCK = range(5)

REST_RATE = 1e-6  # units of p: impacts are followed down to here, the rest of them is a sum
DEAD_RATE = 1e-13  # units of p: rest whatever else, where the base does not lift the block
HALF_TURN = 0.5 * math.pi
LONGEST_FLIGHT = 200.0  # units of 1/p: nothing but an unstable equilibrium lasts as long on a still base


@compiled
def march(
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    steps: FloatArray,
    events: FloatArray,
    used: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> int:
    """Advance `state` in place to time `end` or to an event that stops it.

    Parameters
    ----------
    body : ndarray, shape (7,)
        See `parameters`.
    state : ndarray, shape (STATE_SIZE,)
        Changed in place; a later call goes on from it.
    piece : ndarray, shape (7,)
        One row of a pulse's `pieces`; zeros for a still base, where `end` may be infinite.
    steps, events : ndarray
        Rows are appended from `used[0]` and `used[1]` on; with no rows at all, nothing is recorded.
    f, c, work : ndarray
        From `scratch`.

    Returns
    -------
    int
        REACHED `end`; FELL (pi/2); FULL: give longer arrays and call again; CAME_TO_REST (only where `end` is
        infinite); STUCK: on an unstable equilibrium, or not a number.
    """
    alpha = body[ALPHA]
    p = body[P]
    eta = body[RESTITUTION]
    launched = state[TIME]
    while state[TIME] < end:
        recording = steps.shape[0] > 0
        if (recording and used[0] + 1 >= steps.shape[0]) or (events.shape[0] > 0 and used[1] + 3 >= events.shape[0]):
            return FULL
        t = state[TIME]

        if state[SIDE] == 0.0:
            if math.isinf(end):
                return CAME_TO_REST
            lift = first_uplift(piece, t, end, body[THRESHOLD])
            until = end if lift < 0.0 else lift
            if recording and until > t:
                record(steps, used, t, p * (until - t), 0.0, c)
            state[TIME] = until
            if lift < 0.0:
                return REACHED
            state[SIDE] = -1.0 if base_acceleration(piece, lift) > 0.0 else 1.0
            state[PHI] = 0.0
            state[PSI] = alpha
            state[RATE] = 0.0
            note(events, used, lift, 0.0, UPLIFT)
            t = lift

        forced = forcing_series(piece, t, state[SIDE] / body[GRAVITY], p, f)
        rocking_series(state[PSI], state[PHI], state[RATE], f, forced, c, work)
        touching = state[PHI] == 0.0
        known_roots = 0
        if touching:
            known_roots = 1
            if state[RATE] == 0.0:
                # Lifting off: phi'' is zero at the threshold itself, where rounding may leave it below.
                known_roots = 2
                if c[2] <= 0.0:
                    c[2] = 0.0
                    known_roots = 3
        if c[known_roots] <= 0.0 and touching:
            # The base lets go again within this instant: at rest, and looked at anew one rounding later.
            state[SIDE] = 0.0
            state[TIME] = math.nextafter(t, math.inf)
            continue

        h = body[STRIDE] * step_length(c, body[TOLERANCE])
        whole = p * (end - t)
        last = h >= whole
        if last:
            h = whole
        if not h > 0.0:
            return STUCK

        contact, grazing = first_root(c[known_roots:], ORDER - known_roots, h)
        if contact != NO_ROOT:
            h = contact
        state[PEAK] = maximum(c, ORDER, h, state[PEAK])
        fallen = state[PEAK] >= HALF_TURN
        if fallen:
            state[PEAK] = HALF_TURN
            h = _half_turn(c, work[2], h)
        if recording:
            record(steps, used, t, h, state[SIDE], c)
        carry(state, f, forced, work, h, body[TOLERANCE])

        if fallen:
            state[TIME] = t + h / p
            state[PHI] = HALF_TURN
            state[PSI] = alpha - HALF_TURN
            state[RATE] = slope(c, ORDER, h)
            note(events, used, state[TIME], state[SIDE] * p * state[RATE], OVERTURNED)
            return FELL

        if contact == NO_ROOT:
            moved = _moved(c, h)
            state[PHI] += moved
            state[PSI] -= moved
            state[RATE] = slope(c, ORDER, h)
            state[TIME] = end if last else t + h / p
            if math.isinf(end) and p * (state[TIME] - launched) > LONGEST_FLIGHT:
                return STUCK
            continue

        # Impact.
        state[TIME] = min(t + h / p, end)
        launched = state[TIME]
        before = min(slope(c, ORDER, h), 0.0)
        if grazing:
            state[DOUBT] = 1.0
        note(events, used, state[TIME], state[SIDE] * p * before, IMPACT)
        a = base_acceleration(piece, state[TIME])
        reflect(state, alpha, eta, before, state[SIDE] * a / body[GRAVITY])
        state[SIDE] = -state[SIDE]
        state[PHI] = 0.0
        state[PSI] = alpha
        state[RATE] = -eta * before
        if state[RATE] < REST_RATE:
            _settle(body, state, piece, end, a, events, used)
    return REACHED


@compiled
def march_through(
    body: FloatArray,
    state: FloatArray,
    pieces: FloatArray,
    end: float,
    steps: FloatArray,
    events: FloatArray,
    used: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> int:
    """Advance `state` through the rows of `pieces` that begin before `end`, from row `used[2]` on; see `march`."""
    while used[2] < pieces.shape[0]:
        piece = pieces[int(used[2])]
        if piece[T0] >= end:
            break
        code = march(body, state, piece, min(piece[T1], end), steps, events, used, f, c, work)
        if code != REACHED:
            return code
        used[2] += 1.0
    return REACHED


@compiled
def _settle(
    body: FloatArray, state: FloatArray, piece: FloatArray, end: float, a: float, events: FloatArray, used: FloatArray
) -> None:
    """Put a block whose impacts have become tiny to rest, where they end before anything changes."""
    alpha = body[ALPHA]
    v = state[RATE]
    a /= body[GRAVITY]
    weak = math.sin(alpha) - abs(a) * math.cos(alpha)
    strong = math.sin(alpha) + abs(a) * math.cos(alpha)
    if v == 0.0:
        left = 0.0
    elif weak <= 0.0:
        return
    elif a == 0.0:
        left = remaining_time(v, alpha, body[RESTITUTION])
    else:
        left = remaining_time_forced(v, weak, strong, body[RESTITUTION])
    rest_after(body, state, piece, end, left, weak, math.cos(alpha), events, used)


@compiled
def rest_after(
    body: FloatArray,
    state: FloatArray,
    piece: FloatArray,
    end: float,
    left: float,
    weak: float,
    pull: float,
    events: FloatArray,
    used: FloatArray,
) -> None:
    """Put a block to rest `left` / p from now, where that is before `end` and nothing changes much until then.

    `weak` is what pulls it back to the base on the side where that is less, units of p2; a change of a / g changes it
    by `pull` times as much.
    """
    if math.isinf(left):
        return
    p = body[P]
    v = state[RATE]
    change = steepest(piece) / body[GRAVITY] / p * left * pull
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


@compiled
def _moved(c: FloatArray, h: float) -> float:
    """Return phi(h) - phi(0), without adding phi(0)."""
    y = c[ORDER]
    for k in range(ORDER - 1, 0, -1):
        y = y * h + c[k]
    return y * h


@compiled
def _half_turn(c: FloatArray, room: FloatArray, end: float) -> float:
    """Return where phi first reaches pi/2 on (0, end], known to do so."""
    for k in range(ORDER + 1):
        room[k] = -c[k]
    room[0] = HALF_TURN - c[0]
    x, _ = first_root(room, ORDER, end)
    return end if x == NO_ROOT else x
