"""What a step of one cell of a batch may have met: the base, pi/2, rest; each with the bound of the error.

An answer is given only where the bound cannot change it, otherwise DOUBT.
"""

from __future__ import annotations

import math

from twin.rocking.batch.base import CLOSE, DOUBT, FALLEN, MOVING, STRUCK, force
from twin.rocking.batch.compiled import lent
from twin.rocking.batch.step import (
    COEFFICIENTS,
    COSINE,
    ERROR,
    FAINT,
    FINISH,
    LARGEST_ERROR,
    LENGTH,
    NEARLY_FLAT,
    OMEGA,
    ORDER,
    PHI,
    PSI,
    RATE,
    RATE_ERROR,
    RESIDUE,
    ROUNDING,
    SHIFT,
    SIDE,
    SINE,
    START,
    START_ERROR,
    START_RATE_ERROR,
    STEEPEST,
    STRONGEST,
    TAU,
)
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN
from twin.rocking.polynomial import NO_ROOT, first_root, slope
from twin.rocking.state import ALPHA, RESTITUTION

# Changes that the error may make at an impact, relatively, for the linear picture of it to hold.
LINEAR = 1e-2
# A bound of how fast a flight's pull changes, units of p^3, for that.
STEADY = 1.0
# A slower rebound may come to rest at once, units of p.
SLOW = 0.05
UNCLEAR = -2.0
# Of what counts as a faint rate: a pull as it lifts that is the rounding of the time at which it does.
FLAT = 1e-7
# A Newton step below this share is the last: its error is the square of it.
NEWTON_SHARE = 1e-9


@lent
def reaches(c: FloatArray, h: float, level: float) -> float:
    """Return where the rotation of the step in `c`, below `level` at its start, reaches it, or NO_ROOT."""
    n = c.size - 1
    for k in range(n + 1):
        c[k] = -c[k]
    below = c[0]
    c[0] = level + below
    x, _ = first_root(c, n, h)
    c[0] = below
    for k in range(n + 1):
        c[k] = -c[k]
    return x


@lent
def look(m: FloatArray, lane: int, body: FloatArray, c: FloatArray) -> int:
    """Look at a step that may have met something: MOVING (it did not), STRUCK, FALLEN or DOUBT."""
    if not m[ERROR, lane] + m[SHIFT, lane] <= LARGEST_ERROR:
        return DOUBT
    for k in range(ORDER + 1):
        c[k] = m[COEFFICIENTS + k, lane]
    h = m[LENGTH, lane]
    known = 0
    if c[0] == 0.0:
        known = 1
        if c[1] == 0.0:
            known = 2
            if c[2] <= 1e-15 + FLAT * m[FAINT, lane]:
                c[2] = 0.0
                known = 3
    contact = NO_ROOT
    if known == 1 and c[2] < 0.0 and -2.0 * c[1] < c[2] * -h:
        # A short flight, of about -c1 / c2: judged by the error that it has, not the whole step.
        contact = _contact(m, lane, c, known, -2.0 * c[1] / c[2])
    if contact == NO_ROOT:
        contact = _contact(m, lane, c, known, h)
    if contact == UNCLEAR:
        return DOUBT
    struck = contact != NO_ROOT
    if struck:
        h = contact
    reach = 0.0
    for k in range(ORDER, -1, -1):
        reach = reach * h + abs(c[k])
    if reach > NEARLY_FLAT - 0.01:
        # A shift in time does not matter here, where what lies higher is passed in any case.
        blur = 2.0 * m[ERROR, lane]
        if reaches(c, h, HALF_TURN + blur) != NO_ROOT:
            return FALLEN
        if reaches(c, h, HALF_TURN - blur) != NO_ROOT:
            return DOUBT
    return _strike(m, lane, body, c, h) if struck else MOVING


@lent
def _contact(m: FloatArray, lane: int, c: FloatArray, known: int, h: float) -> float:
    """Return the first root of phi / tau^known in (0, h], NO_ROOT, or UNCLEAR where the error decides.

    A curve that only falls, or only bends downwards, from above zero has one root or none, as its end tells.
    """
    n = ORDER - known
    error, rate_error = _error_after(m, lane, c, h, 0.0)
    blur = 2.0 * error if known == 0 else 2.0 * (error / h + rate_error)
    if known > 1:
        blur /= h ** (known - 1)
    if c[known] <= 10.0 * blur:
        return UNCLEAR
    falling = 0.0
    bending = 0.0
    end = c[ORDER]
    for k in range(n, 0, -1):
        ck = c[known + k]
        up = ck if k < 3 or ck > 0.0 else 0.0
        if k > 1:
            bending = bending * h + k * (k - 1) * up
            up = max(ck, 0.0)
        falling = falling * h + k * up
        end = end * h + c[known + k - 1]
    if falling < 0.0 or bending < 0.0:
        if end > blur:
            return NO_ROOT
        if end >= -blur:
            return UNCLEAR
        return _single_root(c, known, h, end)
    c[known] -= blur
    early, _ = first_root(c[known:], n, h)
    c[known] += blur
    if early == NO_ROOT:
        return NO_ROOT
    contact, grazing = first_root(c[known:], n, h)
    if contact == NO_ROOT or grazing:
        return UNCLEAR
    if (early - contact) * slope(c[known:], n, contact) > 4.0 * blur + 1e-15:
        return UNCLEAR
    return contact


@lent
def _single_root(c: FloatArray, known: int, h: float, end: float) -> float:
    """Return the only root in (0, h] of a curve above zero at 0 and at `end` < 0 at h (Newton, kept in its bracket)."""
    left = 0.0
    right = h
    x = h * c[known] / (c[known] - end)
    for _ in range(60):
        y = c[ORDER]
        d = 0.0
        for k in range(ORDER - 1, known - 1, -1):
            d = d * x + y
            y = y * x + c[k]
        if y > 0.0:
            left = x
        else:
            right = x
        new = x - y / d if d < 0.0 else 0.5 * (left + right)
        if not left <= new <= right:
            new = 0.5 * (left + right)
        if abs(new - x) <= NEWTON_SHARE * x:
            return new
        x = new
    return x


@lent
def _strike(m: FloatArray, lane: int, body: FloatArray, c: FloatArray, h: float) -> int:
    """Put a lane on its other corner, `h` after the start of its step.

    An error (e, e') at the contact, struck at rate v, makes it early or late by e / v and the rate there wrong by
    e' - e phi'' / v; what follows begins at phi = 0 all the same, so that the first is a shift in time.
    """
    before = slope(c, c.size - 1, h)
    eta = body[RESTITUTION]
    tau = m[START, lane] + h
    base = force(m, lane, tau)
    against = m[SIDE, lane] * base
    leaving = -m[SINE, lane] - against * m[COSINE, lane]
    if before >= 0.0:
        return DOUBT
    error, rate_error = _error_after(m, lane, c, h, leaving / before)
    if -eta * before < m[FAINT, lane] and _faint(m, lane, body, base, -eta * before, error, rate_error):
        m[TAU, lane] = min(tau, m[FINISH, lane])
        return STRUCK
    slack = (abs(leaving) + STEADY * abs(before)) * error / (before * before)
    if slack > LINEAR or rate_error > -LINEAR * before:
        return DOUBT
    v = -eta * before
    m[TAU, lane] = min(tau, m[FINISH, lane])
    m[SIDE, lane] = -m[SIDE, lane]
    m[PHI, lane] = 0.0
    m[PSI, lane] = body[ALPHA]
    m[RATE, lane] = v
    m[SHIFT, lane] += (1.0 + 4.0 * slack) * error / -before
    m[ERROR, lane] = 0.0
    m[RATE_ERROR, lane] = (1.0 + 4.0 * slack) * eta * rate_error + 1e-16
    if v < SLOW:
        weak = m[SINE, lane] - abs(base) * m[COSINE, lane]
        left = _time_to_rest(m, lane, body, weak, v)
        if m[TAU, lane] + left <= m[FINISH, lane]:
            m[TAU, lane] += left
            m[SIDE, lane] = 0.0
        elif v == 0.0 and weak > -CLOSE:
            return DOUBT
    return STRUCK


@lent
def _faint(m: FloatArray, lane: int, body: FloatArray, base: float, v: float, error: float, rate_error: float) -> bool:
    """Put a block that rebounds at a faint rate `v` to rest, if its weight holds it down; tell whether it did.

    What it would still have done stays within `v` of rest: the next time it lifts, that is an error of its rate.
    """
    weak = m[SINE, lane] - abs(base) * m[COSINE, lane]
    if weak <= 0.0 or v * v > 0.05 * weak * weak:
        return False
    left_out = v + rate_error + math.sqrt(4.0 * error)
    m[RESIDUE, lane] = max(m[RESIDUE, lane], left_out)
    m[SIDE, lane] = 0.0
    m[PHI, lane] = 0.0
    m[PSI, lane] = body[ALPHA]
    m[RATE, lane] = 0.0
    m[ERROR, lane] = 0.0
    m[RATE_ERROR, lane] = 0.0
    m[SHIFT, lane] = 0.0
    return True


@lent
def _error_after(m: FloatArray, lane: int, c: FloatArray, h: float, pull: float) -> tuple[float, float]:
    """Return the bounds of e and of e' - e `pull`, `h` after the start of a step, as in `batch_step.advance`.

    But for small shares of the stiffness and of what bends the forcing, e and e' are e + e' h + T D h^2 / 2 and
    e' + T D h, and the second bound takes them with their signs: in the short flights of a block coming to rest they
    cancel, where unsigned bounds would grow by a factor at every impact.
    """
    stiffness = 1.0 + m[STRONGEST, lane]
    x = stiffness * h * h
    growth = math.exp(math.sqrt(x))
    cosh = 0.5 * (growth + 1.0 / growth)
    e = m[START_ERROR, lane]
    r = m[START_RATE_ERROR, lane]
    pushed = m[SHIFT, lane] * m[STEEPEST, lane] * h
    dropped = 8.0 * (abs(c[ORDER]) * h + abs(c[ORDER - 1])) * h ** (ORDER - 1)
    rounding = ROUNDING * (1.0 + abs(c[1]) + abs(c[2]) * h)
    error = (e + (r + 0.5 * pushed) * h) * cosh + dropped + rounding * min(h, 1.0)
    signed = abs(1.0 - pull * h) * r + abs(pull) * e + abs(1.0 - 0.5 * pull * h) * pushed
    reach = 1.0 + abs(pull) * h
    uneven = pushed * h * (m[OMEGA, lane] + 2.0 * (abs(c[1]) + abs(c[2]) * h))
    bent = (e * stiffness * h + (r + pushed) * x + uneven) * cosh * reach
    return error, signed + bent + (ORDER * dropped / h + rounding) + abs(pull) * (dropped + rounding * h)


@lent
def _time_to_rest(m: FloatArray, lane: int, body: FloatArray, weak: float, v: float) -> float:
    """Return a time, 1/p, within which a block that rebounds at `v` is sure to be at rest; infinite where it is not.

    A flight under a pull of at least weak / 2 lasts at most 4 v / weak. While the pull changes by at most a fifth of
    `weak` in all, the flights' own gains multiply the rates by less than e^(2/5) altogether, so that the flights last
    less than 8 v / (weak (1 - eta)). The block rises by less than 2 v^2 / weak.
    """
    if weak <= 0.0 or v * v > 0.05 * weak * weak:
        return math.inf
    if v == 0.0:
        return 0.0
    left = 8.0 * v / (weak * max(1.0 - body[RESTITUTION], 1e-300))
    return left if m[STEEPEST, lane] * left * m[COSINE, lane] <= 0.2 * weak else math.inf
