"""What a configuration fixes: which blocks turn as one, and the constant vectors of the chain summed over them."""

from __future__ import annotations

from twin.rocking.compiled import FloatArray
from twin.stack.solver.chain import Chain
from twin.stack.solver.compiled import lent
from twin.stack.solver.series import Series


@lent
def gather(chain: Chain, n: int, side: FloatArray, s: Series) -> int:
    """Write what a configuration fixes; return its number of groups."""
    count = 0
    for i in range(n):
        if side[i] != 0.0:
            s.first[count] = i
            count += 1
        s.group[i] = count - 1
    for k in range(n):
        for g in range(count):
            s.arm[k, g, 0] = 0.0
            s.arm[k, g, 1] = 0.0
        for j in range(k + 1):
            g = s.group[j]
            if g >= 0:
                x, z = _link(chain, side, j, k)
                s.arm[k, g, 0] += x
                s.arm[k, g, 1] += z
    for g in range(count):
        s.spin[g] = 0.0
        s.load[g, 0] = 0.0
        s.load[g, 1] = 0.0
        for h in range(count):
            even = 0.0
            odd = 0.0
            for k in range(n):
                even += chain.mass[k] * (s.arm[k, g, 0] * s.arm[k, h, 0] + s.arm[k, g, 1] * s.arm[k, h, 1])
                odd += chain.mass[k] * (s.arm[k, g, 0] * s.arm[k, h, 1] - s.arm[k, g, 1] * s.arm[k, h, 0])
            s.even[g, h] = even
            s.odd[g, h] = odd
        for k in range(n):
            s.load[g, 0] += chain.mass[k] * s.arm[k, g, 0]
            s.load[g, 1] += chain.mass[k] * s.arm[k, g, 1]
            if s.group[k] == g:
                s.spin[g] += chain.inertia[k]
    for i in range(n):
        _gather_interface(chain, n, side, i, count, s)
    return count


@lent
def _link(chain: Chain, side: FloatArray, j: int, k: int) -> tuple[float, float]:
    """Return the vector that block `j` adds on the way to the centre of block `k` >= j."""
    x = -side[j] * chain.half[j]
    if j == k:
        return x, 0.5 * chain.height[j]
    return x + side[j + 1] * chain.half[j + 1], chain.height[j]


@lent
def _gather_interface(chain: Chain, n: int, side: FloatArray, i: int, count: int, s: Series) -> None:
    for column in range(3):
        s.above[i, column] = 0.0
    for g in range(count):
        for column in range(4):
            s.lever[i, g, column] = 0.0
    s.own[i] = 0.0
    for k in range(i, n):
        m = chain.mass[k]
        x = 0.0
        z = 0.0
        for j in range(i, k + 1):
            if s.group[j] == s.group[i]:
                dx, dz = _link(chain, side, j, k)
                x += dx
                z += dz
        if s.group[k] == s.group[i]:
            s.own[i] += chain.inertia[k]
        s.above[i, 0] += m
        s.above[i, 1] += m * x
        s.above[i, 2] += m * z
        for g in range(count):
            ax = s.arm[k, g, 0]
            az = s.arm[k, g, 1]
            s.lever[i, g, 0] += m * ax
            s.lever[i, g, 1] += m * az
            s.lever[i, g, 2] += m * (x * ax + z * az)
            s.lever[i, g, 3] += m * (x * az - z * ax)
