"""Whether each of many cells of one block overturns: sixteen at a time, with a bound of the error."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.rocking.batch.base import (
    DOUBT,
    FALLEN,
    FALLS_OVER,
    FOR_EVER,
    LIES,
    MOVING,
    STANDING,
    STRUCK,
    lift,
    still_base,
    take_piece,
    verdict,
)
from twin.rocking.batch.compiled import lent
from twin.rocking.batch.contact import look, reaches
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.batch.step import (
    COSINE,
    ERROR,
    FINISH,
    HALF_SINE,
    LENGTH,
    LOOK,
    LOST,
    NOTICED,
    ORDER,
    PHI,
    PSI,
    RATE,
    RATE_ERROR,
    ROWS,
    SHIFT,
    SIDE,
    SINE,
    START,
    TAU,
    advance,
)
from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import HALF_TURN
from twin.rocking.state import ALPHA, P

Codes = NDArray[np.uint8]
Counts = NDArray[np.int32]
Signs = NDArray[np.int8]
Numbers = NDArray[np.int64]

# Codes of an outcome. UNSETTLED, of the quick look alone, asks for the accurate one; DOUBTFUL is what that adds to an
# outcome which it cannot be sure of either.
STAYED, ROCKED, OVERTURNED, UNDECIDED, IMPOSSIBLE, UNSETTLED = range(6)
DOUBTFUL = 16
COARSE, FINE = 1e-9, 1e-16
# A cell with more events goes to the accurate method.
MOST_EVENTS = 20_000
# Rows of a lane's book: its cell or -1, its piece, its events, whether it has rested; and the next cell to be begun.
CELL, PIECE, EVENTS, RESTED, NEXT = range(5)


@compiled
def quick_look(
    body: FloatArray,
    pieces: FloatArray,
    rotation: float,
    tolerance: float,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
    times: FloatArray,
) -> None:
    """Decide every cell whose outcome the error's bound cannot change; the others become UNSETTLED.

    Parameters
    ----------
    body : ndarray, shape (7,)
        See `twin.rocking.run.parameters`.
    pieces : ndarray, shape (cells, n, 7)
        Base motion of each cell, n >= 1.
    rotation : float
        Initial rotation of all cells, rad, signed; at rest.
    tolerance : float
        Truncation allowed per step, rad: COARSE settles most cells, FINE most of what that leaves.
    codes, impacts, directions : ndarray, shape (cells,)
        Written: outcome; impacts before overturning (0 where it stands); side it falls to, +1, -1, or 0.
    times : ndarray, shape (cells,) or (0,)
        Written where it has room and the block overturns: when |rotation| reaches pi/2, s.
    """
    m = np.zeros((ROWS, WIDTH))
    c = np.zeros(ORDER + 1)
    book = np.zeros((5, WIDTH), dtype=np.int64)
    _run(m, c, book, body, pieces, rotation, tolerance, codes, impacts, directions, times)


@lent
def _run(
    m: FloatArray,
    c: FloatArray,
    book: Numbers,
    body: FloatArray,
    pieces: FloatArray,
    rotation: float,
    tolerance: float,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
    times: FloatArray,
) -> None:
    for lane in range(WIDTH):
        m[SINE, lane] = math.sin(body[ALPHA])
        m[COSINE, lane] = math.cos(body[ALPHA])
        m[HALF_SINE, lane] = math.sin(0.5 * body[ALPHA])
    timed = times.size > 0
    busy = 0
    for lane in range(WIDTH):
        busy += _begin(m, lane, body, pieces, rotation, book, codes, impacts, directions)
    while busy > 0:
        advance(m, tolerance)
        for lane in range(WIDTH):
            noticed = m[NOTICED, lane]
            here = book[CELL, lane]
            if noticed == 0.0 or here < 0:
                continue
            book[EVENTS, lane] += 1
            end = MOVING
            if noticed == LOOK:
                end = look(m, lane, body, c)
                if end == STRUCK:
                    impacts[here] += 1
                    end = MOVING
                    if m[SIDE, lane] == 0.0 and m[RATE, lane] > 0.0:
                        book[RESTED, lane] = 1
                elif end == FALLEN and timed:
                    times[here] = (m[START, lane] + reaches(c, m[LENGTH, lane], HALF_TURN)) / body[P]
                    end = LIES
            elif noticed == LOST and not timed:
                end = FALLEN
            if end == MOVING:
                end = _go_on(m, lane, body, pieces[here], book, codes)
            if end not in (MOVING, STANDING) and book[RESTED, lane] != 0:
                # How many of the impacts before the rest are listed, the accurate method knows.
                end = DOUBT
            if timed and end in (FALLEN, FALLS_OVER):
                # Sure to overturn: on over a still base until it lies.
                still_base(m, lane)
                end = MOVING
            if book[EVENTS, lane] > MOST_EVENTS:
                end = DOUBT
            if end == MOVING:
                continue
            _write(m, lane, end, here, codes, impacts, directions)
            busy -= 1 - _begin(m, lane, body, pieces, rotation, book, codes, impacts, directions)


@lent
def _begin(
    m: FloatArray,
    lane: int,
    body: FloatArray,
    pieces: FloatArray,
    rotation: float,
    book: Numbers,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
) -> int:
    """Give a lane the next cell that has to be stepped through; return 1, or 0 where none is left."""
    while book[NEXT, 0] < pieces.shape[0]:
        here = book[NEXT, 0]
        book[NEXT, 0] += 1
        book[CELL, lane] = here
        book[PIECE, lane] = -1
        book[EVENTS, lane] = 0
        book[RESTED, lane] = 0
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
        end = _go_on(m, lane, body, pieces[here], book, codes)
        if end == MOVING:
            return 1
        _write(m, lane, end, here, codes, impacts, directions)
    # Idle lanes are balanced on a still base, where nothing ever happens.
    book[CELL, lane] = -1
    m[:, lane] = 0.0
    m[PHI, lane] = 0.5
    m[FINISH, lane] = FOR_EVER
    return 0


@lent
def _go_on(m: FloatArray, lane: int, body: FloatArray, pieces: FloatArray, book: Numbers, codes: Codes) -> int:
    """Take the lane over the end of its piece and through any rest: MOVING, or what becomes of it."""
    while True:
        if m[TAU, lane] >= m[FINISH, lane]:
            book[PIECE, lane] += 1
            if book[PIECE, lane] >= pieces.shape[0]:
                return verdict(m, lane, body)
            take_piece(m, lane, body, pieces, book[PIECE, lane])
            continue
        if m[SIDE, lane] != 0.0:
            return MOVING
        found = lift(m, lane, body, pieces[book[PIECE, lane]])
        if found == MOVING:
            codes[book[CELL, lane]] = ROCKED
        if found != STANDING:
            return found


@lent
def _write(m: FloatArray, lane: int, end: int, here: int, codes: Codes, impacts: Counts, directions: Signs) -> None:
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
