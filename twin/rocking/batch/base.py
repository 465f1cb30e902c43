"""The base under one cell of a batch: its pieces, when a resting block lifts, and what becomes of it on a still base.

As in march.py, but an answer is given only where the bound of the error cannot change it; DOUBT says that it could,
and the cell goes to the accurate method.
"""

from __future__ import annotations

import math

from twin.rocking.batch.compiled import lent
from twin.rocking.batch.step import (
    AMPLITUDE,
    BARRIER,
    BEGIN,
    C0,
    C1,
    ERROR,
    FINISH,
    HALF_SINE,
    OMEGA,
    PHASE,
    PHI,
    PSI,
    RATE,
    RATE_ERROR,
    RESIDUE,
    SHIFT,
    SIDE,
    STEEPEST,
    STRONGEST,
    TAU,
)
from twin.rocking.compiled import FloatArray
from twin.rocking.series import AMPLITUDE as PIECE_AMPLITUDE
from twin.rocking.series import C0 as PIECE_C0
from twin.rocking.series import C1 as PIECE_C1
from twin.rocking.series import OMEGA as PIECE_OMEGA
from twin.rocking.series import PHASE as PIECE_PHASE
from twin.rocking.series import T0, T1, base_acceleration
from twin.rocking.state import ALPHA, GRAVITY, RESTITUTION, THRESHOLD, P
from twin.rocking.uplift import UPLIFT_TOLERANCE, first_uplift

MOVING, STRUCK, FALLEN, STANDING, FALLS_OVER, DOUBT, LIES = range(7)
# Nearer than this to the threshold of uplift, relatively, or to the end of a piece, 1/p: left to the accurate method.
CLOSE = 1e-9
FOR_EVER = 1e300


@lent
def take_piece(
    m: FloatArray, lane: int, body: FloatArray, pieces: FloatArray, tops: FloatArray | None, motion: int, index: int
) -> None:
    """Give a lane the `index`-th row of the pieces of a motion, in units of 1/p and g.

    `tops` are from `strongest_from`, or None.
    """
    piece = pieces[motion, index]
    p = body[P]
    g = body[GRAVITY]
    m[BEGIN, lane] = p * piece[T0]
    m[FINISH, lane] = p * piece[T1]
    m[TAU, lane] = m[BEGIN, lane]
    m[C0, lane] = piece[PIECE_C0] / g
    m[C1, lane] = piece[PIECE_C1] / (g * p)
    m[AMPLITUDE, lane] = piece[PIECE_AMPLITUDE] / g
    m[OMEGA, lane] = piece[PIECE_OMEGA] / p
    m[PHASE, lane] = piece[PIECE_PHASE]
    # A shift in time does not shift a jump of the base acceleration: it becomes an error of the state.
    m[ERROR, lane] += m[SHIFT, lane] * abs(m[RATE, lane])
    strongest = _strongest(piece) / g
    m[RATE_ERROR, lane] += m[SHIFT, lane] * (1.0 + max(m[STRONGEST, lane], strongest))
    m[SHIFT, lane] = 0.0
    m[STRONGEST, lane] = strongest
    m[STEEPEST, lane] = abs(m[C1, lane]) + abs(m[AMPLITUDE, lane]) * m[OMEGA, lane]
    top = _top(pieces, tops, motion, index) / g
    # atan(x) < pi x / (1 + 2 sqrt(1 + x^2)) (Shafer 1966), at a fifth of its cost.
    m[BARRIER, lane] = -math.pi * top / (1.0 + 2.0 * math.sqrt(1.0 + top * top))


@lent
def _top(pieces: FloatArray, tops: FloatArray | None, motion: int, index: int) -> float:
    """Return a bound of |a| over the `index`-th piece and all after it, m/s2."""
    if tops is not None:
        return tops[motion, index]
    top = 0.0
    for k in range(index, pieces.shape[1]):
        top = max(top, _strongest(pieces[motion, k]))
    return top


@lent
def still_base(m: FloatArray, lane: int) -> None:
    """Let a lane go on for ever on a still base, once its last piece is over; before that, nothing changes."""
    if m[TAU, lane] < m[FINISH, lane]:
        return
    m[FINISH, lane] = FOR_EVER
    m[C0, lane] = 0.0
    m[C1, lane] = 0.0
    m[AMPLITUDE, lane] = 0.0
    m[STRONGEST, lane] = 0.0
    m[STEEPEST, lane] = 0.0


@lent
def _strongest(piece: FloatArray) -> float:
    """Return a bound of |a| over a piece, m/s2."""
    ends = max(abs(piece[PIECE_C0]), abs(piece[PIECE_C0] + piece[PIECE_C1] * (piece[T1] - piece[T0])))
    return ends + abs(piece[PIECE_AMPLITUDE])


@lent
def strongest_from(pieces: FloatArray, tops: FloatArray) -> None:
    """Write into `tops`, shape (motions, n), a bound of |a| over each piece and all after it, m/s2."""
    for motion in range(pieces.shape[0]):
        top = 0.0
        for k in range(pieces.shape[1] - 1, -1, -1):
            top = max(top, _strongest(pieces[motion, k]))
            tops[motion, k] = top


@lent
def lift(m: FloatArray, lane: int, body: FloatArray, piece: FloatArray) -> int:
    """Leave a resting block at rest to the end of its piece (STANDING), or start it where it lifts (MOVING)."""
    a = abs(piece[PIECE_AMPLITUDE])
    limit = body[THRESHOLD] * (1.0 + UPLIFT_TOLERANCE)
    tau = m[TAU, lane]
    finish = m[FINISH, lane]
    positive = piece[PIECE_C0] > 0.0
    if a == 0.0 and piece[PIECE_C1] == 0.0:
        if abs(piece[PIECE_C0]) <= limit:
            m[TAU, lane] = finish
            return STANDING
    elif piece[PIECE_C0] == 0.0 and piece[PIECE_C1] == 0.0:
        if a <= limit:
            m[TAU, lane] = finish
            return STANDING
        ratio = body[THRESHOLD] / a
        q = m[OMEGA, lane] * (tau - m[BEGIN, lane]) + m[PHASE, lane]
        now = 0.0 if q == 0.0 else abs(math.sin(q))
        halves = math.floor(q / math.pi)
        if abs(now - ratio) <= CLOSE * ratio:
            return DOUBT
        if now < ratio:
            inside = q - math.pi * halves
            turn = math.asin(ratio)
            if inside > turn:
                turn += math.pi
                halves += 1.0
            tau += (turn - inside) / m[OMEGA, lane]
        positive = (piece[PIECE_AMPLITUDE] > 0.0) == (halves % 2.0 == 0.0)
    else:
        start = max(tau / body[P], piece[T0])
        found = first_uplift(piece, start, piece[T1], body[THRESHOLD])
        if found < 0.0:
            m[TAU, lane] = finish
            return STANDING
        if found == start:
            # Above the threshold already: by how little, a rounding of the start may decide.
            now = base_acceleration(piece, start)
            if abs(now) <= limit * (1.0 + CLOSE):
                return DOUBT
        else:
            tau = max(tau, body[P] * found)
        positive = base_acceleration(piece, found) > 0.0
    if abs(tau - finish) <= CLOSE:
        return DOUBT
    if tau > finish:
        m[TAU, lane] = finish
        return STANDING
    m[TAU, lane] = tau
    m[SIDE, lane] = -1.0 if positive else 1.0
    m[PHI, lane] = 0.0
    m[PSI, lane] = body[ALPHA]
    m[RATE, lane] = 0.0
    m[ERROR, lane] = 0.0
    m[RATE_ERROR, lane] = m[RESIDUE, lane]
    m[SHIFT, lane] = 0.0
    return MOVING


@lent
def force(m: FloatArray, lane: int, tau: float) -> float:
    """Return a / g of a lane's piece."""
    d = tau - m[BEGIN, lane]
    return m[C0, lane] + m[C1, lane] * d + m[AMPLITUDE, lane] * math.sin(m[OMEGA, lane] * d + m[PHASE, lane])


@lent
def verdict(m: FloatArray, lane: int, body: FloatArray) -> int:
    """Return what becomes of a lane if the base stays still: STANDING, FALLEN, FALLS_OVER (after an impact), DOUBT."""
    if m[SIDE, lane] == 0.0:
        return STANDING
    shift = m[SHIFT, lane]
    error = m[ERROR, lane] + shift * abs(m[RATE, lane])
    rate_error = m[RATE_ERROR, lane] + shift * (1.0 + m[STRONGEST, lane])
    # The rule of verdict.py.
    half = math.sin(0.5 * m[PSI, lane])
    base = m[HALF_SINE, lane]
    v = m[RATE, lane]
    ahead = v - 2.0 * half
    if not abs(ahead) > 2.0 * (error + rate_error) + 1e-14:
        return DOUBT
    if ahead > 0.0:
        return FALLEN
    strike = math.sqrt(max(1e-300, v * v + 4.0 * (base - half) * (base + half)))
    around = body[RESTITUTION] * strike - 2.0 * base
    # Its derivatives are eta sin(psi) / strike and eta v / strike.
    if not abs(around) > 2.0 * (error + abs(v) * rate_error) / strike + 1e-14:
        return DOUBT
    return FALLS_OVER if around > 0.0 else STANDING
