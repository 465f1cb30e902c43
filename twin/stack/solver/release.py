"""What closed interfaces do when accelerations jump: stay closed, or open about a corner.

A candidate stands where the relative accelerations of what it opens point the right way, where the pressure of what it
keeps closed lies inside the contact, and where its pivots push. What is closed and can stay closed does.
"""

from __future__ import annotations

from twin.stack.solver.chain import GRAVITY, Chain, Place, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.motion import Room, accelerate

# Relative to gravity.
EXCESS = 1e-13


@lent
def release(chain: Chain, n: int, state: State, a: float, place: Place, room: Room) -> int:
    """Open what cannot stay closed under base acceleration `a` / p2; return how many candidates there were.

    1: `state.side` is right now. Otherwise it is left as it is.
    """
    count = 0
    for i in range(n):
        room.side[i] = state.side[i]
        if state.gap[i] == 0.0 and state.rate[i] == 0.0:
            room.side[i] = 0.0
            room.near[count] = i
            count += 1
    if count == 0 or _stands(chain, n, state, a, place, room):
        for i in range(n):
            state.side[i] = room.side[i]
        return 1
    total = 1
    for _ in range(count):
        total *= 3
    found = 0
    for number in range(total):
        left = number
        for k in range(count):
            room.side[int(room.near[k])] = left % 3 - 1.0
            left //= 3
        if _stands(chain, n, state, a, place, room):
            found += 1
            for i in range(n):
                room.best_side[i] = room.side[i]
    if found == 1:
        for i in range(n):
            state.side[i] = room.best_side[i]
    return found


@lent
def _stands(chain: Chain, n: int, state: State, a: float, place: Place, room: Room) -> bool:
    if not accelerate(chain, n, room.side, state.gap, state.rate, a, place, room):
        return False
    weight = 0.0
    for i in range(n):
        weight += chain.mass[i] * chain.scales[GRAVITY]
    for i in range(n):
        side = room.side[i]
        half = chain.half[i]
        if side == 0.0:
            if half * place.normal[i] - abs(place.moment[i]) < -EXCESS * weight * half:
                return False
        elif state.gap[i] == 0.0 and state.rate[i] == 0.0:
            if side * room.change[i] * chain.height[i] <= EXCESS * chain.scales[GRAVITY]:
                return False
            if place.normal[i] < -EXCESS * weight:
                return False
    return True
