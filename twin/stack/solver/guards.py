"""Series of what must stay above zero during a step: gaps of open interfaces, pressure of closed ones.

The normal force N_i and the moment Q_i about the middle of interface i are what everything above asks of it (Newton and
Euler). With U and V the components of the force-weighted levers of the part that is tied to block i, in its own frame,

    N = s Fx + c Fz,   Q = c U - s V + I phi'',

c and s being cos and sin of the rotation of the face. A closed interface holds while c_i N + Q and c_i N - Q are above
zero: the first reaches zero where the centre of pressure reaches the +x corner, the second at the -x corner.
"""

from __future__ import annotations

from twin.rocking.compiled import FloatArray
from twin.stack.solver.chain import GRAVITY, Chain, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.series import Series


@lent
def gap_series(n: int, state: State, order: int, s: Series) -> None:
    """Write the gaps of the open interfaces, signed; each starts from the state's own gap and rate."""
    for i in range(n):
        if state.side[i] == 0.0:
            continue
        g = s.group[i]
        side = state.side[i]
        s.gap[i, 0] = side * state.gap[i]
        s.gap[i, 1] = side * state.rate[i]
        for k in range(2, order + 1):
            y = s.angle[g, k]
            if g > 0:
                y -= s.angle[g - 1, k]
            s.gap[i, k] = side * y


@lent
def contact_series(chain: Chain, n: int, count: int, state: State, order: int, s: Series) -> None:
    """Write normal force of every interface, and moment of the closed ones, up to `order` - 2."""
    for i in range(n):
        fx = s.spare[0]
        fz = s.spare[1]
        for k in range(order - 1):
            x = s.above[i, 0] * s.base[k]
            z = 0.0
            if k == 0:
                z = s.above[i, 0] * chain.scales[GRAVITY]
            twice = (k + 1.0) * (k + 2.0)
            for h in range(count):
                c = twice * s.cosine[h, k + 2]
                d = twice * s.sine[h, k + 2]
                x += s.lever[i, h, 0] * c + s.lever[i, h, 1] * d
                z += s.lever[i, h, 1] * c - s.lever[i, h, 0] * d
            fx[k] = x
            fz[k] = z
        face = -1
        if chain.upper_face[i] != 0.0:
            face = s.group[i]
        elif i > 0:
            face = s.group[i - 1]
        _across(face, fx, fz, order, s, s.normal[i])
        if state.side[i] != 0.0:
            continue
        u = s.spare[2]
        v = s.spare[3]
        g = s.group[i]
        for k in range(order - 1):
            y = s.above[i, 2] * s.base[k]
            x = s.above[i, 1] * s.base[k]
            if k == 0:
                y -= s.above[i, 1] * chain.scales[GRAVITY]
                x += s.above[i, 2] * chain.scales[GRAVITY]
            twice = (k + 1.0) * (k + 2.0)
            for h in range(count):
                c = twice * s.cosine[h, k + 2]
                d = twice * s.sine[h, k + 2]
                y += s.lever[i, h, 2] * d - s.lever[i, h, 3] * c
                x += s.lever[i, h, 2] * c + s.lever[i, h, 3] * d
            u[k] = y
            v[k] = -x
        _across(g, v, u, order, s, s.moment[i])
        if g >= 0:
            for k in range(order - 1):
                s.moment[i, k] += s.own[i] * s.second[g, k]


@lent
def _across(group: int, x: FloatArray, z: FloatArray, order: int, s: Series, result: FloatArray) -> None:
    """Write s x + c z, s and c being those of a group's angle (0 and 1 for what stands with the base)."""
    for k in range(order - 1):
        if group < 0:
            result[k] = z[k]
            continue
        y = 0.0
        for j in range(k + 1):
            y += s.sine[group, j] * x[k - j] + s.cosine[group, j] * z[k - j]
        result[k] = y
