"""Accelerations of a stack in a given configuration, and what its contacts give meanwhile.

Coordinates are the gaps q_i of the open interfaces: q_i turns everything above interface i about its pivot P_i. With
perp(x, z) = (z, -x), the derivative of a vector by its rotation,

    M_il = sum over k >= max(i, l) of m_k (G_k - P_i).(G_k - P_l) + I_k,
    sum_l M_il q_l'' = - sum over k >= i of m_k perp(G_k - P_i).(gamma_k + (a, g)),

gamma_k being the centripetal part of the acceleration of G_k. The Taylor series (`series`) come from another form of
the same equations; tests hold the two against each other.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.stack.solver.chain import GRAVITY, Chain, Place, reactions, set_out
from twin.stack.solver.compiled import lent
from twin.stack.solver.dense import factor, solve


class Room(NamedTuple):
    """Room for one small linear system and what surrounds it; every row a block or interface."""

    matrix: FloatArray  # (n, n)
    order: FloatArray
    right: FloatArray
    change: FloatArray  # q'' or the jump of q', in units of p
    open: FloatArray  # numbers of the open interfaces
    field: FloatArray  # (n, 3): centripetal acceleration, or what a jump has to make good; x, z, spin
    test: FloatArray  # (n, 2): points that moments are taken about
    old: FloatArray  # (n, 2): pivots before an impact
    side: FloatArray  # of the candidate in hand
    best_side: FloatArray
    best_rate: FloatArray
    near: FloatArray  # numbers of the interfaces that may change
    lost: FloatArray  # energy lost in the last impact, J / p2


def new_room(n: int) -> Room:
    """Return room for `n` blocks."""
    return Room(
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros((n, 3)),
        np.zeros((n, 2)),
        np.zeros((n, 2)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(n),
        np.zeros(1),
    )


@lent
def solve_for_gaps(chain: Chain, n: int, side: FloatArray, place: Place, room: Room) -> bool:
    """Write into `room.change` the gaps' accelerations (or jumps) that leave no moment of `room.field`; 0 where closed.

    Moments are taken about `room.test`; motions are turns about `place.pivot`. False where there is no answer.
    """
    count = 0
    for i in range(n):
        room.change[i] = 0.0
        if side[i] != 0.0:
            room.open[count] = i
            count += 1
    for row in range(count):
        i = int(room.open[row])
        tx = room.test[i, 0]
        tz = room.test[i, 1]
        y = 0.0
        for k in range(i, n):
            y += chain.mass[k] * (place.centre[k, 1] - tz) * room.field[k, 0]
            y -= chain.mass[k] * (place.centre[k, 0] - tx) * room.field[k, 1]
            y += chain.inertia[k] * room.field[k, 2]
        room.right[row] = y
        for column in range(count):
            other = int(room.open[column])
            px = place.pivot[other, 0]
            pz = place.pivot[other, 1]
            y = 0.0
            for k in range(max(i, other), n):
                x1 = place.centre[k, 0]
                z1 = place.centre[k, 1]
                y += chain.mass[k] * ((x1 - tx) * (x1 - px) + (z1 - tz) * (z1 - pz)) + chain.inertia[k]
            room.matrix[row, column] = y
    if not factor(room.matrix, count, room.order):
        return False
    solve(room.matrix, count, room.order, room.right)
    for row in range(count):
        room.change[int(room.open[row])] = room.right[row]
    return True


@lent
def loads(chain: Chain, n: int, place: Place, room: Room) -> None:
    """Write into `place.force` what the bodies ask for: mass times (turns by `room.change` less `room.field`)."""
    for k in range(n):
        vx = -room.field[k, 0]
        vz = -room.field[k, 1]
        spin = -room.field[k, 2]
        for i in range(k + 1):
            if room.change[i] != 0.0:
                vx += room.change[i] * (place.centre[k, 1] - place.pivot[i, 1])
                vz -= room.change[i] * (place.centre[k, 0] - place.pivot[i, 0])
                spin += room.change[i]
        place.force[k, 0] = chain.mass[k] * vx
        place.force[k, 1] = chain.mass[k] * vz
        place.force[k, 2] = chain.inertia[k] * spin


@lent
def accelerate(
    chain: Chain, n: int, side: FloatArray, gap: FloatArray, rate: FloatArray, a: float, place: Place, room: Room
) -> bool:
    """Write the gaps' accelerations (`room.change`, units of p2) and the contacts' forces; `a` is the base's, over p2.

    False where the configuration has no motion.
    """
    set_out(chain, n, side, gap, place)
    gx = a
    gz = chain.scales[GRAVITY]
    spin = 0.0
    under = 0.0
    for i in range(n):
        spin += rate[i]
        # d2/dt2 of a body's vector: -spin2 times it.
        square = spin * spin
        below_x = 0.0 if i == 0 else place.middle[i, 0]
        below_z = 0.0 if i == 0 else place.middle[i, 1]
        gx -= under * (place.pivot[i, 0] - below_x)
        gz -= under * (place.pivot[i, 1] - below_z)
        room.field[i, 0] = -(gx - square * (place.centre[i, 0] - place.pivot[i, 0]))
        room.field[i, 1] = -(gz - square * (place.centre[i, 1] - place.pivot[i, 1]))
        room.field[i, 2] = 0.0
        if i + 1 < n:
            gx -= square * (place.middle[i + 1, 0] - place.pivot[i, 0])
            gz -= square * (place.middle[i + 1, 1] - place.pivot[i, 1])
        under = square
        room.test[i, 0] = place.pivot[i, 0]
        room.test[i, 1] = place.pivot[i, 1]
    if not solve_for_gaps(chain, n, side, place, room):
        return False
    loads(chain, n, place, room)
    reactions(chain, n, place)
    return True
