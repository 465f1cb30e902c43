"""What happens first within a step: roots of the guards' polynomials."""

from __future__ import annotations

from twin.rocking.compiled import FloatArray
from twin.rocking.polynomial import NO_ROOT, first_root
from twin.stack.solver.chain import HALF_TURN, LOST, PULLS, Chain, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.series import Series

NOTHING, CLOSES, OPENS, PULLED, LIES = range(5)


@lent
def first_event(
    chain: Chain, n: int, groups: int, state: State, order: int, h: float, s: Series
) -> tuple[int, int, int, float]:
    """Return what happens first within `h`: kind, interface (or block), corner, and when.

    An interface of -1 says that the interface named as corner cannot open.
    """
    what = NOTHING
    which = 0
    corner = 0
    for i in range(n):
        side = state.side[i]
        if side == 0.0:
            continue
        known = 0
        if s.gap[i, 0] <= 0.0:
            known = 1
            if state.rate[i] == 0.0:
                # Opening: the relative acceleration is zero at the corner itself, where rounding may leave it below.
                known = 2
                if s.gap[i, 2] <= 0.0:
                    s.gap[i, 2] = 0.0
                    known = 3
            if s.gap[i, known] <= 0.0:
                return NOTHING, -1, i, 0.0
        x, _ = first_root(s.gap[i, known:], order - known, h)
        if x != NO_ROOT:
            what = CLOSES
            which = i
            h = x
    for i in range(n):
        if state.side[i] != 0.0:
            if chain.scales[LOST] == PULLS:
                continue
            x = _first_below(s.normal[i], order - 2, h)
            if x != NO_ROOT and x < h:
                what = PULLED
                which = i
                h = x
            continue
        for k in range(order - 1):
            weight = chain.half[i] * s.normal[i, k]
            s.spare[0, k] = weight + s.moment[i, k]
            s.spare[1, k] = weight - s.moment[i, k]
        for row in range(2):
            x = _first_below(s.spare[row], order - 2, h)
            if x != NO_ROOT and x < h:
                what = OPENS
                which = i
                corner = 1 - 2 * row
                h = x
    for g in range(groups):
        x = _lies(s.angle[g], order, h, s.spare[0])
        if x != NO_ROOT and x < h:
            what = LIES
            which = s.first[g]
            h = x
        if g > 0:
            i = s.first[g]
            x = _lies(s.gap[i], order, h, s.spare[0])
            if x != NO_ROOT and x < h:
                what = LIES
                which = i
                h = x
    return what, which, corner, h


@lent
def _first_below(c: FloatArray, n: int, h: float) -> float:
    """Return where a guard is first no longer above zero on [0, h]; one that starts at its zero and rises is armed."""
    room = c[0]
    power = h
    for k in range(1, n + 1):
        room -= abs(c[k]) * power
        power *= h
    if room > 0.0:
        return NO_ROOT
    if c[0] > 0.0:
        x, grazing = first_root(c, n, h)
        return NO_ROOT if grazing else x
    if c[1] > 0.0:
        x, grazing = first_root(c[1:], n - 1, h)
        return NO_ROOT if grazing else x
    return 0.0


@lent
def _lies(c: FloatArray, n: int, h: float, room: FloatArray) -> float:
    """Return where |c| first reaches pi/2 on (0, h]."""
    most = abs(c[0])
    power = h
    for k in range(1, n + 1):
        most += abs(c[k]) * power
        power *= h
    if most < HALF_TURN:
        return NO_ROOT
    best = NO_ROOT
    for turn in (-1.0, 1.0):
        for k in range(n + 1):
            room[k] = turn * c[k]
        room[0] += HALF_TURN
        if room[0] > 0.0:
            x, _ = first_root(room, n, h)
            if x != NO_ROOT and (best == NO_ROOT or x < best):
                best = x
    return best
