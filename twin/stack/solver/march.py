"""Advance a stack through one piece of base motion, with every event at its exact time.

Guards of a step, all of them polynomials, and what follows where the first of them reaches zero:

    a gap closes                              impact: every candidate is looked at (`impact`)
    a centre of pressure reaches a corner     the interface opens about that corner
    a pivot's normal force vanishes           contact is lost (`falling`)
    a rotation, or a gap, reaches pi/2        that block, and all on it, have overturned; the rest goes on without them
    at rest, |a| passes the least threshold   the interface whose threshold it is opens

Where accelerations jump (a new piece, an impact, blocks gone) closed interfaces are asked anew (`release`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

from twin.rocking.compiled import FloatArray
from twin.rocking.polynomial import maximum, slope
from twin.rocking.series import ORDER, T0, T1, base_acceleration
from twin.stack.solver.book import IMPACT, LOST, NO_CANDIDATE, REST, SEVERAL, UPLIFT, Book, full, hold, note, record
from twin.stack.solver.chain import (
    AT_REST,
    BLOCKS,
    FALLING,
    FRESH,
    IMPACTS,
    LIFTED,
    PIECE,
    RECLOSED,
    STEPS,
    TIME,
    Chain,
    P,
    Place,
    State,
    new_place,
)
from twin.stack.solver.compiled import lent
from twin.stack.solver.energy import safe
from twin.stack.solver.events import LIES, NOTHING, OPENS, PULLED, first_event
from twin.stack.solver.falling import fall, lose
from twin.stack.solver.groups import gather
from twin.stack.solver.guards import contact_series, gap_series
from twin.stack.solver.impact import strike
from twin.stack.solver.motion import Room, new_room
from twin.stack.solver.release import release
from twin.stack.solver.rest import all_closed, lift
from twin.stack.solver.series import Series, motion_series, new_series, step_length

REACHED, FULL, CAME_TO_REST, SAFE, ALL_DOWN, CONTACT_LOST, NO_ANSWER, SEVERAL_ANSWERS, STUCK = range(9)

# Flights of a chatter, begun below this rate (units of p), take a short series.
CHATTER_RATE = 1e-3
CHATTER_ORDER = 10
# A gap this small that closes beside another's impact strikes with it.
TOGETHER = 1e-15
MOST_RECLOSED = 1000
MOST_STEPS = 200_000
LONGEST_FLIGHT = 200.0


class Bench(NamedTuple):
    """All the room a run needs besides its state."""

    place: Place
    room: Room
    series: Series


def new_bench(n: int) -> Bench:
    """Return room for `n` blocks."""
    return Bench(new_place(n), new_room(n), new_series(n))


@lent
def march(chain: Chain, state: State, piece: FloatArray, end: float, until_safe: bool, bench: Bench, book: Book) -> int:
    """Advance `state` in place to time `end`, or to what stops it.

    Parameters
    ----------
    chain : Chain
    state : State
        Changed in place; a later call goes on from it.
    piece : ndarray, shape (7,)
        One row of a pulse's `pieces`; zeros for a still base, where `end` may be infinite.
    until_safe : bool
        On a still base, whether to stop as soon as nothing standing can fall any more.
    bench, book
        Room, and what is kept.

    Returns
    -------
    int
        REACHED `end`; FULL: give a longer book and call again; CAME_TO_REST (only where `end` is infinite); SAFE;
        ALL_DOWN: nothing stands; CONTACT_LOST; NO_ANSWER or SEVERAL_ANSWERS: an impact, or a jump of acceleration,
        that no candidate fits, or several; STUCK: on an unstable equilibrium, or not a number.
    """
    p = chain.scales[P]
    s = bench.series
    groups = -1
    flown = 0.0
    while state.clock[TIME] < end:
        if full(book):
            return FULL
        t = state.clock[TIME]
        n = int(state.clock[BLOCKS])
        if n == 0:
            return ALL_DOWN
        if state.clock[FRESH] != 0.0:
            groups = -1
            code = _refresh(chain, n, state, piece, t, bench, book)
            if code != REACHED:
                return code
        if all_closed(n, state):
            if math.isinf(end):
                return CAME_TO_REST
            if not lift(chain, n, state, piece, end, bench.series, book):
                return REACHED
            groups = -1
            continue
        if until_safe and flown == 0.0 and safe(chain, n, state, bench.place):
            return SAFE
        if groups < 0:
            groups = gather(chain, n, state.side, s)
        order = _order(n, state)
        if not motion_series(chain, n, groups, state, piece, t, order, s):
            return STUCK
        gap_series(n, state, order, s)
        contact_series(chain, n, groups, state, order, s)
        h = step_length(chain, groups, order, s)
        whole = p * (end - t)
        last = h >= whole
        if last:
            h = whole
        if not h > 0.0:
            return STUCK
        what, which, corner, h = first_event(chain, n, groups, state, order, h, s)
        if which < 0:
            # It cannot open after all: closed again, and looked at one rounding later.
            state.side[corner] = 0.0
            groups = -1
            state.clock[TIME] = min(math.nextafter(t, math.inf), end)
            state.clock[RECLOSED] += 1.0
            if state.clock[RECLOSED] > MOST_RECLOSED:
                return STUCK
            continue
        state.clock[STEPS] += 1.0
        if state.clock[STEPS] > MOST_STEPS:
            return STUCK
        if h > 0.0:
            state.clock[RECLOSED] = 0.0
            record(book, state, h, order, s)
            _advance(n, state, order, h, s, book.steps.shape[0] > 0)
        state.clock[TIME] = end if last and what == NOTHING else min(t + h / p, end)
        flown += h
        if what == NOTHING:
            if math.isinf(end) and flown > LONGEST_FLIGHT:
                return STUCK
            continue
        flown = 0.0
        hold(state, book)
        groups = -1
        if what == OPENS:
            state.side[which] = corner
            state.clock[LIFTED] = 1.0
            note(chain, book, state, UPLIFT, which, 0.0, 1)
        elif what == LIES:
            fall(chain, which, state, book)
        elif what == PULLED:
            if not lose(chain, n, which, state, bench.place, book):
                return CONTACT_LOST
        else:
            code = _impact(chain, n, which, state, bench, book)
            if code != REACHED:
                return code
    return REACHED


@lent
def march_through(
    chain: Chain, state: State, pieces: FloatArray, end: float, until_safe: bool, bench: Bench, book: Book
) -> int:
    """Advance `state` through the rows of `pieces` that begin before `end`, from the clock's row on; see `march`."""
    while state.clock[PIECE] < pieces.shape[0]:
        piece = pieces[int(state.clock[PIECE])]
        if piece[T0] >= end:
            break
        code = march(chain, state, piece, min(piece[T1], end), until_safe, bench, book)
        if code != REACHED:
            return code
        state.clock[PIECE] += 1.0
        state.clock[FRESH] = 1.0
    return REACHED


@lent
def _refresh(chain: Chain, n: int, state: State, piece: FloatArray, t: float, bench: Bench, book: Book) -> int:
    """Ask the closed interfaces anew after a jump of the accelerations."""
    p = chain.scales[P]
    state.clock[FRESH] = 0.0
    hold(state, book)
    for i in range(n):
        bench.room.old[i, 0] = state.side[i]
    found = release(chain, n, state, base_acceleration(piece, t) / (p * p), bench.place, bench.room)
    if found != 1:
        note(chain, book, state, NO_CANDIDATE if found == 0 else SEVERAL, -1, 0.0, found)
        return NO_ANSWER if found == 0 else SEVERAL_ANSWERS
    for i in range(n):
        if state.side[i] != bench.room.old[i, 0]:
            state.clock[LIFTED] = 1.0
            note(chain, book, state, UPLIFT, i, 0.0, 1)
            break
    return REACHED


@lent
def _order(n: int, state: State) -> int:
    for i in range(n):
        if state.side[i] != 0.0 and state.gap[i] == 0.0 and 0.0 < abs(state.rate[i]) < CHATTER_RATE:
            return CHATTER_ORDER
    return ORDER


@lent
def _advance(n: int, state: State, order: int, h: float, s: Series, peaks: bool) -> None:
    """Move gaps and rates on by `h`, without adding what does not change."""
    for i in range(n):
        if state.side[i] == 0.0:
            continue
        c = s.gap[i]
        y = c[order]
        for k in range(order - 1, 0, -1):
            y = y * h + c[k]
        state.gap[i] += state.side[i] * y * h
        state.rate[i] = state.side[i] * slope(c, order, h)
    if peaks:
        for i in range(n):
            g = s.group[i]
            if g >= 0 and s.first[g] == i:
                top = maximum(s.angle[g], order, h, state.peak[i])
                for k in range(order + 1):
                    s.spare[0, k] = -s.angle[g, k]
                top = maximum(s.spare[0], order, h, top)
                state.peak[i] = top
            elif g >= 0:
                state.peak[i] = max(state.peak[i], state.peak[s.first[g]])


@lent
def _impact(chain: Chain, n: int, which: int, state: State, bench: Bench, book: Book) -> int:
    state.gap[which] = 0.0
    if state.side[which] * state.rate[which] > 0.0:
        state.rate[which] = 0.0
    for i in range(n):
        side = state.side[i]
        if side != 0.0 and side * state.gap[i] <= TOGETHER and side * state.rate[i] < 0.0:
            state.gap[i] = 0.0
    hold(state, book)
    found = strike(chain, n, state, bench.place, bench.room)
    if found != 1:
        if found < 0:
            state.clock[FALLING] = -1.0
            note(chain, book, state, LOST, which, 0.0, found)
            return CONTACT_LOST
        note(chain, book, state, NO_CANDIDATE if found == 0 else SEVERAL, which, 0.0, found)
        return NO_ANSWER if found == 0 else SEVERAL_ANSWERS
    state.clock[IMPACTS] += 1.0
    state.clock[FRESH] = 1.0
    note(chain, book, state, IMPACT, which, bench.room.lost[0], found)
    if all_closed(n, state):
        state.clock[AT_REST] = state.clock[TIME]
        note(chain, book, state, REST, which, 0.0, 1)
    return REACHED
