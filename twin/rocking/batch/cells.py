"""Which cell each lane of a batch works on: its beginning, its way from piece to piece, what became of it."""

from __future__ import annotations

import math

from twin.rocking.batch.base import DOUBT, FALLS_OVER, FOR_EVER, MOVING, STANDING, lift, take_piece, verdict
from twin.rocking.batch.codes import OVERTURNED, ROCKED, STAYED, UNSETTLED, Codes, Counts, Numbers, Signs
from twin.rocking.batch.compiled import lent
from twin.rocking.batch.step import (
    COSINE,
    ERROR,
    FAINT,
    FINISH,
    HALF_SINE,
    PHI,
    PSI,
    RATE,
    RATE_ERROR,
    RESIDUE,
    SHIFT,
    SIDE,
    SINE,
    START_ERROR,
    START_RATE_ERROR,
    TAU,
)
from twin.rocking.compiled import FloatArray
from twin.rocking.state import ALPHA

# Rows of a lane's book: its cell or -1, its piece, its events, whether it has rested; and the next cell to be begun.
CELL, PIECE, EVENTS, RESTED, NEXT = range(5)
# Of different blocks: a rebound slower than this, units of p, over the root of the tolerance counts as rest, with an
# error. Rattling to rest through a changing base motion is what else sends many cells to the accurate method.
FAINT_AT, LEAST_FAINT = 10.0, 1e-5


# Numba compiles one version with motions and one without them, in which `motions is None` costs nothing.


@lent
def body_of(motions: Numbers | None, here: int) -> int:
    """Return which of the bodies a cell has."""
    if motions is None:
        return 0
    return here


@lent
def motion_of(motions: Numbers | None, here: int) -> int:
    """Return which of the pieces a cell has."""
    if motions is None:
        return here
    return motions[here]


@lent
def cap_errors(m: FloatArray, lane: int, margin: float) -> None:
    """Leave of a lane's errors at most `margin`, where that is above 0."""
    if margin <= 0.0:
        return
    m[ERROR, lane] = min(m[ERROR, lane], margin)
    m[START_ERROR, lane] = min(m[START_ERROR, lane], margin)
    m[SHIFT, lane] = min(m[SHIFT, lane], margin)
    m[RATE_ERROR, lane] = min(m[RATE_ERROR, lane], margin)
    m[START_RATE_ERROR, lane] = min(m[START_RATE_ERROR, lane], margin)
    m[RESIDUE, lane] = 0.0


@lent
def stand(m: FloatArray, lane: int, body: FloatArray) -> None:
    """Put a body into a lane."""
    m[SINE, lane] = math.sin(body[ALPHA])
    m[COSINE, lane] = math.cos(body[ALPHA])
    m[HALF_SINE, lane] = math.sin(0.5 * body[ALPHA])


@lent
def begin(
    m: FloatArray,
    lane: int,
    tops: FloatArray | None,
    bodies: FloatArray,
    pieces: FloatArray,
    motions: Numbers | None,
    rotations: FloatArray,
    tolerance: float,
    book: Numbers,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
) -> int:
    """Give a lane the next cell that has to be stepped through; return 1, or 0 where none is left."""
    while book[NEXT, 0] < codes.shape[0]:
        here = book[NEXT, 0]
        book[NEXT, 0] += 1
        book[CELL, lane] = here
        book[PIECE, lane] = -1
        book[EVENTS, lane] = 0
        book[RESTED, lane] = 0
        body = bodies[body_of(motions, here)]
        motion = motion_of(motions, here)
        rotation = rotations[0]
        if motions is not None:
            rotation = rotations[here]
            stand(m, lane, body)
            m[FAINT, lane] = max(FAINT_AT * math.sqrt(tolerance), LEAST_FAINT)
            m[RESIDUE, lane] = 0.0
        codes[here] = STAYED
        impacts[here] = 0
        directions[here] = 0
        m[TAU, lane] = 0.0
        m[SIDE, lane] = 0.0
        m[RATE, lane] = 0.0
        m[ERROR, lane] = 0.0
        m[RATE_ERROR, lane] = 0.0
        m[SHIFT, lane] = 0.0
        m[PHI, lane] = abs(rotation)
        m[PSI, lane] = body[ALPHA] - abs(rotation)
        if rotation != 0.0:
            m[SIDE, lane] = math.copysign(1.0, rotation)
            codes[here] = ROCKED
        # No piece yet: the first one begins at once.
        m[FINISH, lane] = 0.0
        end = go_on(m, lane, body, pieces, tops, motion, book, codes)
        if end == MOVING:
            return 1
        write(m, lane, end, here, codes, impacts, directions)
    # Idle lanes are balanced on a still base, where nothing ever happens.
    book[CELL, lane] = -1
    m[:, lane] = 0.0
    m[PHI, lane] = 0.5
    m[FINISH, lane] = FOR_EVER
    return 0


@lent
def go_on(
    m: FloatArray,
    lane: int,
    body: FloatArray,
    pieces: FloatArray,
    tops: FloatArray | None,
    motion: int,
    book: Numbers,
    codes: Codes,
) -> int:
    """Take the lane over the end of its piece and through any rest: MOVING, or what becomes of it."""
    while True:
        if m[TAU, lane] >= m[FINISH, lane]:
            book[PIECE, lane] += 1
            if book[PIECE, lane] >= pieces.shape[1]:
                return verdict(m, lane, body)
            take_piece(m, lane, body, pieces, tops, motion, book[PIECE, lane])
            continue
        if m[SIDE, lane] != 0.0:
            return MOVING
        found = lift(m, lane, body, pieces[motion, book[PIECE, lane]])
        if found == MOVING:
            codes[book[CELL, lane]] = ROCKED
        if found != STANDING:
            return found


@lent
def write(m: FloatArray, lane: int, end: int, here: int, codes: Codes, impacts: Counts, directions: Signs) -> None:
    """Write what became of a cell."""
    if end == DOUBT:
        codes[here] = UNSETTLED
        return
    if end == STANDING:
        impacts[here] = 0
        return
    side = 1 if m[SIDE, lane] > 0.0 else -1
    codes[here] = OVERTURNED
    if end == FALLS_OVER:
        impacts[here] += 1
        side = -side
    directions[here] = side
