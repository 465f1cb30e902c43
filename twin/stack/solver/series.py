"""Taylor series of a stack's motion about one instant.

Blocks tied by closed interfaces turn as one group; a closed base ties the lowest to theta = 0. With D_kg the sum of the
chain's vectors of group g up to the centre of mass of block k, a constant of the configuration,

    G_k = const + sum_g r(phi_g) D_kg,
    sum_h M_gh phi_h'' + N_gh phi_h'^2 = g (X c + Z s)_g - a (Z c - X s)_g,
    M_gh = A cos(phi_h - phi_g) + B sin(phi_h - phi_g),  N_gh = -A sin(..) + B cos(..),
    A_gh = sum_k m_k D_kg . D_kh,  B_gh = sum_k m_k D_kg x D_kh,  (X, Z)_g = sum_k m_k D_kg,

c and s being cos and sin of phi_g. The series of sines and cosines follow Jorba & Zou (2005); that of phi'' is solved
for coefficient by coefficient with the one matrix M at the instant itself.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.rocking.series import ORDER, forcing_series
from twin.stack.solver.chain import GRAVITY, TOLERANCE, Chain, P, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.dense import factor, solve

LONGEST_STEP = 1.0


class Series(NamedTuple):
    """Room for one step: what its configuration fixes, and the coefficients in powers of p t."""

    group: NDArray[np.int64]  # of each block; -1 where it stands with the base
    first: NDArray[np.int64]  # lowest block of each group
    arm: FloatArray  # (block, group, 2): D
    even: FloatArray  # A
    odd: FloatArray  # B
    load: FloatArray  # (group, 2): X, Z
    spin: FloatArray  # inertia of each group's own spins
    above: FloatArray  # (interface, 3): mass above, and of the tied part above: sum m x, sum m z about the interface
    lever: FloatArray  # (interface, group, 4): sum m x, sum m z, and of the tied part: A and B with the group
    own: FloatArray  # (interface): inertia of the tied part above
    base: FloatArray  # coefficients of a / p2
    angle: FloatArray  # (group, ORDER + 1): phi
    sine: FloatArray
    cosine: FloatArray
    square: FloatArray  # phi'^2
    second: FloatArray  # phi''
    pair_sine: FloatArray  # (group, group, ORDER + 1), of phi_h - phi_g for g < h
    pair_cosine: FloatArray
    matrix: FloatArray
    order: FloatArray
    right: FloatArray
    gap: FloatArray  # (interface, ORDER + 1)
    normal: FloatArray
    moment: FloatArray
    spare: FloatArray  # (4, ORDER + 1)


def new_series(n: int) -> Series:
    """Return room for `n` blocks."""
    m = ORDER + 1
    ints = np.zeros(n, dtype=np.int64)
    return Series(
        ints,
        ints.copy(),
        np.zeros((n, n, 2)),
        np.zeros((n, n)),
        np.zeros((n, n)),
        np.zeros((n, 2)),
        np.zeros(n),
        np.zeros((n, 3)),
        np.zeros((n, n, 4)),
        np.zeros(n),
        np.zeros(m),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((n, n, m)),
        np.zeros((n, n, m)),
        np.zeros((n, n)),
        np.zeros(n),
        np.zeros(n),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((n, m)),
        np.zeros((4, m)),
    )


@lent
def motion_series(
    chain: Chain, n: int, count: int, state: State, piece: FloatArray, t: float, order: int, s: Series
) -> bool:
    """Write the coefficients of every angle, sine and cosine up to `order`; False where the matrix is singular."""
    p = chain.scales[P]
    gravity = chain.scales[GRAVITY]
    forced = forcing_series(piece, t, 1.0 / (p * p), p, s.base)
    angle = 0.0
    rate = 0.0
    for i in range(n):
        angle += state.gap[i]
        rate += state.rate[i]
        g = s.group[i]
        if g >= 0 and s.first[g] == i:
            s.angle[g, 0] = angle
            s.angle[g, 1] = rate
    for k in range(order + 1):
        _circle(count, k, s)
        if k > order - 2:
            continue
        for g in range(count):
            y = 0.0
            for j in range(k + 1):
                y += (j + 1) * s.angle[g, j + 1] * (k - j + 1) * s.angle[g, k - j + 1]
            s.square[g, k] = y
            x0 = s.load[g, 0]
            z0 = s.load[g, 1]
            y = gravity * (x0 * s.cosine[g, k] + z0 * s.sine[g, k])
            for j in range(min(k + 1, forced)):
                y -= s.base[j] * (z0 * s.cosine[g, k - j] - x0 * s.sine[g, k - j])
            s.right[g] = y
        for g in range(count):
            for h in range(g + 1, count):
                _pull(g, h, k, s)
        if k == 0:
            for g in range(count):
                s.matrix[g, g] = s.even[g, g] + s.spin[g]
                for h in range(g + 1, count):
                    y = s.even[g, h] * s.pair_cosine[g, h, 0] + s.odd[g, h] * s.pair_sine[g, h, 0]
                    s.matrix[g, h] = y
                    s.matrix[h, g] = y
            if not factor(s.matrix, count, s.order):
                return False
        solve(s.matrix, count, s.order, s.right)
        for g in range(count):
            s.second[g, k] = s.right[g]
            s.angle[g, k + 2] = s.right[g] / ((k + 1) * (k + 2))
    return True


@lent
def _circle(count: int, k: int, s: Series) -> None:
    """Add coefficient `k` of every sine and cosine: k S_k = sum j phi_j C_(k-j), k C_k = -sum j phi_j S_(k-j)."""
    for g in range(count):
        if k == 0:
            s.sine[g, 0] = np.sin(s.angle[g, 0])
            s.cosine[g, 0] = np.cos(s.angle[g, 0])
        else:
            ds = 0.0
            dc = 0.0
            for j in range(1, k + 1):
                moved = j * s.angle[g, j]
                ds += moved * s.cosine[g, k - j]
                dc -= moved * s.sine[g, k - j]
            s.sine[g, k] = ds / k
            s.cosine[g, k] = dc / k
        for h in range(g + 1, count):
            if k == 0:
                s.pair_sine[g, h, 0] = np.sin(s.angle[h, 0] - s.angle[g, 0])
                s.pair_cosine[g, h, 0] = np.cos(s.angle[h, 0] - s.angle[g, 0])
            else:
                ds = 0.0
                dc = 0.0
                for j in range(1, k + 1):
                    moved = j * (s.angle[h, j] - s.angle[g, j])
                    ds += moved * s.pair_cosine[g, h, k - j]
                    dc -= moved * s.pair_sine[g, h, k - j]
                s.pair_sine[g, h, k] = ds / k
                s.pair_cosine[g, h, k] = dc / k


@lent
def _pull(g: int, h: int, k: int, s: Series) -> None:
    """Take from coefficient `k` of the right side what groups g < h do to each other."""
    even = s.even[g, h]
    odd = s.odd[g, h]
    on_g = 0.0
    on_h = 0.0
    for j in range(k + 1):
        c = s.pair_cosine[g, h, j]
        d = s.pair_sine[g, h, j]
        whirl = odd * c - even * d
        on_g += whirl * s.square[h, k - j]
        on_h -= whirl * s.square[g, k - j]
        if j > 0:
            mass = even * c + odd * d
            on_g += mass * s.second[h, k - j]
            on_h += mass * s.second[g, k - j]
    s.right[g] -= on_g
    s.right[h] -= on_h


@lent
def step_length(chain: Chain, count: int, order: int, s: Series) -> float:
    """Return the step, in units of 1/p, after which the last two terms of every angle stay below the tolerance."""
    tolerance = chain.scales[TOLERANCE]
    last = 0.0
    before = 0.0
    for g in range(count):
        last = max(last, abs(s.angle[g, order]))
        before = max(before, abs(s.angle[g, order - 1]))
    h = LONGEST_STEP
    if last > 0.0:
        h = min(h, (tolerance / last) ** (1.0 / order))
    if before > 0.0:
        h = min(h, (tolerance / before) ** (1.0 / (order - 1)))
    return 0.9 * h
