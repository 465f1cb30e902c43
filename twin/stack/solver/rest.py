"""A stack at rest, and when the base lifts it."""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray
from twin.rocking.series import ORDER, base_acceleration
from twin.rocking.uplift import first_uplift
from twin.stack.solver.book import UPLIFT, Book, hold, note, record
from twin.stack.solver.chain import FRESH, GRAVITY, LIFTED, TIME, Chain, P, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.groups import gather
from twin.stack.solver.series import Series

# Above the threshold of a stack at rest by no more than this, relative: it opens as if just reached.
JUST_REACHED = 1e-12


@lent
def all_closed(n: int, state: State) -> bool:
    count = 0
    for i in range(n):
        count += state.side[i] != 0.0
    return count == 0


@lent
def lift(chain: Chain, n: int, state: State, piece: FloatArray, end: float, s: Series, book: Book) -> bool:
    """Take a stack at rest to where the base lifts it, or to `end`: False."""
    p = chain.scales[P]
    best = -1
    threshold = math.inf
    for i in range(n):
        mass = 0.0
        moment = 0.0
        base = 0.0
        for k in range(i, n):
            mass += chain.mass[k]
            moment += chain.mass[k] * (base + 0.5 * chain.height[k])
            base += chain.height[k]
        needed = chain.scales[GRAVITY] * p * p * chain.half[i] * mass / moment
        if needed < threshold:
            threshold = needed
            best = i
    t = state.clock[TIME]
    lift = first_uplift(piece, t, end, threshold)
    until = end if lift < 0.0 else lift
    if until > t:
        # A still stack: one step without groups.
        gather(chain, n, state.side, s)
        record(book, state, p * (until - t), ORDER, s)
    state.clock[TIME] = until
    if lift < 0.0:
        return False
    a = base_acceleration(piece, lift)
    if abs(a) > threshold * (1.0 + JUST_REACHED):
        state.clock[FRESH] = 1.0
        return True
    hold(state, book)
    state.side[best] = -1.0 if a > 0.0 else 1.0
    state.clock[LIFTED] = 1.0
    note(chain, book, state, UPLIFT, best, 0.0, 1)
    return True
