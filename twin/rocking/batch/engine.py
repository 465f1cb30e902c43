"""Whether the block of each of many cells overturns: sixteen at a time, with a bound of the error."""

from __future__ import annotations

import numpy as np

from twin.rocking.batch.base import (
    DOUBT,
    FALLEN,
    FALLS_OVER,
    LIES,
    MOVING,
    STANDING,
    STRUCK,
    still_base,
    strongest_from,
)
from twin.rocking.batch.cells import (
    CELL,
    EVENTS,
    RESTED,
    begin,
    body_of,
    cap_errors,
    go_on,
    motion_of,
    stand,
    write,
)
from twin.rocking.batch.codes import Codes, Counts, Numbers, Signs
from twin.rocking.batch.compiled import lent
from twin.rocking.batch.contact import look, reaches
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.batch.step import LENGTH, LOOK, LOST, NOTICED, ORDER, RATE, ROWS, SIDE, START, advance
from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import HALF_TURN
from twin.rocking.state import P

COARSE, FINE = 1e-9, 1e-16
# A cell with more events goes to the accurate method.
MOST_EVENTS = 20_000


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
    rotations = np.full(1, rotation)
    _run(
        m,
        c,
        book,
        None,
        body.reshape(1, 7),
        pieces,
        None,
        rotations,
        tolerance,
        None,
        codes,
        impacts,
        directions,
        times,
    )


@compiled
def quick_look_at_each(
    bodies: FloatArray,
    pieces: FloatArray,
    motions: Numbers,
    rotations: FloatArray,
    tolerance: float,
    margin: float,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
    times: FloatArray,
) -> None:
    """Do as `quick_look` does where each cell has a body, a rotation and a base motion of its own.

    Impacts are counted from when the block last stood still: one that leans at first rattles to rest before the motion
    comes.

    Parameters
    ----------
    bodies : ndarray, shape (cells, 7)
    pieces : ndarray, shape (number of motions, n, 7)
    motions : ndarray, shape (cells,)
        Which of the `pieces` each cell has.
    rotations : ndarray, shape (cells,)
        Initial rotations, rad, signed; at rest.
    margin : float
        0: the error is bounded all the way, as in `quick_look`. Over long rocking on a moving base that bound grows as
        no error does, and most cells would be left. Above 0: at every event the bounds are cut to `margin` (rad, units
        of 1/p and of p); choose it well above the steps' own error.
    """
    m = np.zeros((ROWS, WIDTH))
    c = np.zeros(ORDER + 1)
    book = np.zeros((5, WIDTH), dtype=np.int64)
    tops = np.zeros(pieces.shape[:2])
    strongest_from(pieces, tops)
    _run(m, c, book, tops, bodies, pieces, motions, rotations, tolerance, margin, codes, impacts, directions, times)


@lent
def _run(
    m: FloatArray,
    c: FloatArray,
    book: Numbers,
    tops: FloatArray | None,
    bodies: FloatArray,
    pieces: FloatArray,
    motions: Numbers | None,
    rotations: FloatArray,
    tolerance: float,
    margin: float | None,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
    times: FloatArray,
) -> None:
    if motions is None:
        for lane in range(WIDTH):
            stand(m, lane, bodies[0])
    timed = times.size > 0
    busy = 0
    for lane in range(WIDTH):
        busy += begin(m, lane, tops, bodies, pieces, motions, rotations, tolerance, book, codes, impacts, directions)
    while busy > 0:
        advance(m, tolerance)
        for lane in range(WIDTH):
            noticed = m[NOTICED, lane]
            here = book[CELL, lane]
            if noticed == 0.0 or here < 0:
                continue
            book[EVENTS, lane] += 1
            body = bodies[body_of(motions, here)]
            if margin is not None:
                cap_errors(m, lane, margin)
            end = MOVING
            if noticed == LOOK:
                end = look(m, lane, body, c)
                if margin is not None:
                    cap_errors(m, lane, margin)
                if end == STRUCK:
                    impacts[here] += 1
                    end = MOVING
                    if m[SIDE, lane] == 0.0 and m[RATE, lane] > 0.0:
                        book[RESTED, lane] = 1
                    if motions is not None and m[SIDE, lane] == 0.0:
                        impacts[here] = 0
                elif end == FALLEN and timed:
                    times[here] = (m[START, lane] + reaches(c, m[LENGTH, lane], HALF_TURN)) / body[P]
                    end = LIES
            elif noticed == LOST and not timed:
                end = FALLEN
            if end == MOVING:
                motion = motion_of(motions, here)
                end = go_on(m, lane, body, pieces, tops, motion, book, codes)
            if motions is None and end not in (MOVING, STANDING) and book[RESTED, lane] != 0:
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
            write(m, lane, end, here, codes, impacts, directions)
            busy -= 1 - begin(
                m, lane, tops, bodies, pieces, motions, rotations, tolerance, book, codes, impacts, directions
            )
