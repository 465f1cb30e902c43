"""Impacts: the bodies' velocities projected onto the motions of a candidate, and which candidate the contacts allow.

A candidate lets each geometrically closed interface stick or open about either corner. Its velocities are those that
leave no angular momentum, of any sub-stack about its pivot, unbalanced: the projection in the metric of kinetic energy,
with impulses at the candidate's contacts only. Everything is computed as a change, so that it is as exact in the last
impacts of a chatter as in its first. The candidate stands where its rates open the right way and its impulses push,
inside the contact where it sticks.
"""

from __future__ import annotations

from twin.rocking.compiled import FloatArray
from twin.stack.solver.chain import ANGULAR_MOMENTUM, LOST, PULLS, RULE, STICK, Chain, Place, State, reactions, set_out
from twin.stack.solver.compiled import lent
from twin.stack.solver.motion import Room, loads, solve_for_gaps

# Relative to the impact's own rates and impulses.
LEAST_RATE = 1e-9
LEAST_PUSH = 1e-9
SAME_RATE = 1e-7


@lent
def strike(chain: Chain, n: int, state: State, place: Place, room: Room) -> int:
    """Resolve an impact at the interfaces whose gap is 0 and closing: change sides and rates.

    Returns
    -------
    int
        How many different candidates the contacts allow: 1 and the state is changed; otherwise it is left as it is.
        Below zero: so many would be allowed if the pivots of open interfaces elsewhere could pull.
    """
    scale = 0.0
    count = 0
    set_out(chain, n, state.side, state.gap, place)
    for i in range(n):
        room.side[i] = state.side[i]
        room.old[i, 0] = place.pivot[i, 0]
        room.old[i, 1] = place.pivot[i, 1]
        if state.side[i] == 0.0 or state.gap[i] == 0.0:
            room.near[count] = i
            count += 1
            if state.side[i] * state.rate[i] < 0.0:
                scale = max(scale, abs(state.rate[i]))
    if scale <= chain.scales[STICK]:
        for i in range(n):
            if state.gap[i] == 0.0 and state.side[i] * state.rate[i] < 0.0:
                room.side[i] = 0.0
        if not jump(chain, n, state, room.side, place, room):
            return 0
        room.lost[0] = energy_lost(chain, n, state, place, room)
        _take(n, state, room.side, room.right)
        return 1
    if chain.scales[RULE] == ANGULAR_MOMENTUM:
        return _passed_on(chain, n, state, place, room)
    pulls = chain.scales[LOST] == PULLS
    while True:
        found = _choose(chain, n, state, scale, count, pulls, place, room)
        if found > 0 or pulls:
            break
        pulls = True
    if pulls and chain.scales[LOST] != PULLS:
        return -found
    if found == 1:
        _take(n, state, room.best_side, room.best_rate)
    return found


@lent
def _choose(chain: Chain, n: int, state: State, scale: float, count: int, pulls: bool, place: Place, room: Room) -> int:
    """Try every candidate, keep an allowed one, and return how many different ones there are."""
    found = 0
    total = 1
    for _ in range(count):
        total *= 3
    for number in range(total):
        left = number
        for k in range(count):
            room.side[int(room.near[k])] = left % 3 - 1.0
            left //= 3
        if not jump(chain, n, state, room.side, place, room):
            continue
        if not allowed(chain, n, state, scale, pulls, place, room):
            continue
        if found > 0 and _same(n, scale, room):
            continue
        found += 1
        room.lost[0] = energy_lost(chain, n, state, place, room)
        for i in range(n):
            room.best_side[i] = room.side[i]
            room.best_rate[i] = room.right[i]
    return found


@lent
def jump(chain: Chain, n: int, state: State, side: FloatArray, place: Place, room: Room) -> bool:
    """Write rates after (`room.right`), their changes and the impulses of one candidate; False where it has none.

    `room.old` holds the pivots before.
    """
    set_out(chain, n, side, state.gap, place)
    for k in range(n):
        room.field[k, 0] = 0.0
        room.field[k, 1] = 0.0
        room.field[k, 2] = 0.0
    for i in range(n):
        room.test[i, 0] = place.pivot[i, 0]
        room.test[i, 1] = place.pivot[i, 1]
        w = state.rate[i]
        near = state.side[i] == 0.0 or state.gap[i] == 0.0
        if not near or w == 0.0:
            continue
        # What the bodies above have, and lack when the same rates turn them about the new pivots.
        if side[i] == 0.0:
            for k in range(i, n):
                room.field[k, 0] += w * (place.centre[k, 1] - room.old[i, 1])
                room.field[k, 1] -= w * (place.centre[k, 0] - room.old[i, 0])
                room.field[k, 2] += w
            continue
        dx = w * (place.pivot[i, 1] - room.old[i, 1])
        dz = -w * (place.pivot[i, 0] - room.old[i, 0])
        for k in range(i, n):
            room.field[k, 0] += dx
            room.field[k, 1] += dz
        if side[i] == -state.side[i] and side[i] * w > 0.0:
            share = chain.share[i]
            for axis in range(2):
                room.test[i, axis] = place.middle[i, axis] + share * (place.pivot[i, axis] - place.middle[i, axis])
    if not solve_for_gaps(chain, n, side, place, room):
        return False
    loads(chain, n, place, room)
    reactions(chain, n, place)
    for i in range(n):
        room.right[i] = 0.0 if side[i] == 0.0 else state.rate[i] + room.change[i]
    return True


@lent
def allowed(chain: Chain, n: int, state: State, scale: float, pulls: bool, place: Place, room: Room) -> bool:
    """Tell whether the candidate just computed opens and pushes where it should.

    `scale` is the largest closing rate; with `pulls`, pivots of interfaces open before and after may pull.
    """
    strength = 0.0
    for k in range(n):
        strength += abs(place.force[k, 0]) + abs(place.force[k, 1])
    for i in range(n):
        side = room.side[i]
        near = state.side[i] == 0.0 or state.gap[i] == 0.0
        if near and side != 0.0 and not side * room.right[i] > LEAST_RATE * scale:
            return False
        if (near or not pulls) and place.normal[i] < -LEAST_PUSH * strength:
            return False
        if side == 0.0:
            half = chain.half[i]
            if half * place.normal[i] - abs(place.moment[i]) < -LEAST_PUSH * strength * half:
                return False
    return energy_lost(chain, n, state, place, room) >= -LEAST_RATE * scale * strength * chain.height[0]


@lent
def energy_lost(chain: Chain, n: int, state: State, place: Place, room: Room) -> float:
    """Return the kinetic energy that the candidate just computed takes away, J / p2.

    Impulses times the mean of the velocities before and after, body by body; the pivots before are in `room.old`.
    """
    lost = 0.0
    for k in range(n):
        vx = 0.0
        vz = 0.0
        spin = 0.0
        for i in range(k + 1):
            w = state.rate[i]
            vx += w * (place.centre[k, 1] - room.old[i, 1])
            vz -= w * (place.centre[k, 0] - room.old[i, 0])
            spin += w
        vx += 0.5 * place.force[k, 0] / chain.mass[k]
        vz += 0.5 * place.force[k, 1] / chain.mass[k]
        spin += 0.5 * place.force[k, 2] / chain.inertia[k]
        lost -= place.force[k, 0] * vx + place.force[k, 1] * vz + place.force[k, 2] * spin
    return lost


@lent
def _passed_on(chain: Chain, n: int, state: State, place: Place, room: Room) -> int:
    """Let every interface that struck pass to its other corner, the others staying as they are (the thesis' rule)."""
    for i in range(n):
        if state.gap[i] == 0.0 and state.side[i] * state.rate[i] < 0.0:
            room.side[i] = -state.side[i]
    for _ in range(n + 1):
        if not jump(chain, n, state, room.side, place, room):
            return 0
        settled = True
        for i in range(n):
            if state.gap[i] == 0.0 and room.side[i] != 0.0 and room.side[i] * room.right[i] <= 0.0:
                room.side[i] = 0.0
                settled = False
        if settled:
            room.lost[0] = energy_lost(chain, n, state, place, room)
            _take(n, state, room.side, room.right)
            return 1
    return 0


@lent
def _same(n: int, scale: float, room: Room) -> bool:
    most = 0.0
    for i in range(n):
        most = max(most, abs(room.right[i] - room.best_rate[i]))
    return most <= SAME_RATE * scale


@lent
def _take(n: int, state: State, side: FloatArray, rate: FloatArray) -> None:
    for i in range(n):
        if side[i] == 0.0:
            state.gap[i] = 0.0
        state.side[i] = side[i]
        state.rate[i] = rate[i]
