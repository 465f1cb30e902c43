"""What a run leaves behind: its steps and its events, row by row."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.series import ORDER
from twin.stack.solver.chain import BLOCKS, TIME, Chain, P, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.series import Series

COEFFICIENTS = ORDER + 1
# A step: start s, length 1/p, then the coefficients of every theta. An event: time s, kind, which, energy lost J,
# candidates; then sides after it, rates before and after it (rad/s) and rotations (rad), one a block.
STEP_HEAD = 2
EVENT_HEAD = 5
IMPACT, UPLIFT, REST, OVERTURNED, LOST, NO_CANDIDATE, SEVERAL = 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0
# In place of the candidates of a loss of contact: the part above left and the rest goes on; or the run ends.
LEFT, STOPPED = 2, 1


class Book(NamedTuple):
    """Rows written so far are counted in `used`: steps, events. Arrays with no rows keep nothing."""

    steps: FloatArray
    events: FloatArray
    used: FloatArray
    before: FloatArray  # rates before the event in hand


def new_book(n: int, steps: int, events: int) -> Book:
    """Return room for so many rows of `n` blocks."""
    return Book(
        np.empty((steps, STEP_HEAD + n * COEFFICIENTS)),
        np.empty((events, EVENT_HEAD + 4 * n)),
        np.zeros(2),
        np.zeros(n),
    )


@lent
def full(book: Book) -> bool:
    """Tell whether a step more might not find room."""
    steps = book.steps.shape[0]
    events = book.events.shape[0]
    return (steps > 0 and book.used[0] + 2 > steps) or (events > 0 and book.used[1] + 4 > events)


@lent
def record(book: Book, state: State, h: float, order: int, s: Series) -> None:
    """Append a step that begins now; what has fallen lies still."""
    if book.steps.shape[0] == 0:
        return
    row = book.steps[int(book.used[0])]
    row[:] = 0.0
    row[0] = state.clock[TIME]
    row[1] = h
    standing = int(state.clock[BLOCKS])
    for i in range(state.gap.shape[0]):
        base = STEP_HEAD + i * COEFFICIENTS
        if i >= standing:
            row[base] = state.lying[i]
        elif s.group[i] >= 0:
            for k in range(order + 1):
                row[base + k] = s.angle[s.group[i], k]
    book.used[0] += 1.0


@lent
def hold(state: State, book: Book) -> None:
    """Keep the rates before an event."""
    for i in range(state.rate.shape[0]):
        book.before[i] = state.rate[i]


@lent
def note(chain: Chain, book: Book, state: State, kind: float, which: int, lost: float, candidates: int) -> None:
    """Append an event that has just happened; the rates before it are in `book.before`."""
    if book.events.shape[0] == 0:
        return
    row = book.events[int(book.used[1])]
    p = chain.scales[P]
    n = state.gap.shape[0]
    row[0] = state.clock[TIME]
    row[1] = kind
    row[2] = which
    row[3] = lost * p * p
    row[4] = candidates
    before = 0.0
    after = 0.0
    angle = 0.0
    standing = int(state.clock[BLOCKS])
    for i in range(n):
        before += p * book.before[i]
        after += p * state.rate[i]
        angle += state.gap[i]
        row[EVENT_HEAD + i] = state.side[i]
        row[EVENT_HEAD + n + i] = before
        row[EVENT_HEAD + 2 * n + i] = after if i < standing else 0.0
        row[EVENT_HEAD + 3 * n + i] = angle if i < standing else state.lying[i]
    book.used[1] += 1.0
