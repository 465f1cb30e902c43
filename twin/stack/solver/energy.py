"""Energy of a stack, and when it is too little for anything to fall.

In each configuration the potential energy is a sum over the blocks of functions of one rotation each, concave while the
rotations are moderate, and the rotations are sums of the gaps q_i. So over the simplex sum |q_i| / alpha_i <= 1, with
alpha_i the rotation at which everything above interface i, as one body, balances on its corner, the energy on the far
face is nowhere below that of its corners: the barriers B_i of those bodies. A stack on a still base that lies inside
with less energy than the least of them stays inside for ever: impacts only take energy.
"""

from __future__ import annotations

import math

from twin.stack.solver.chain import GRAVITY, Chain, Place, State, set_out
from twin.stack.solver.compiled import lent

# Less than the least barrier by this much, relative, so that rounding cannot matter.
MARGIN = 1e-9


@lent
def energies(chain: Chain, n: int, state: State, place: Place) -> tuple[float, float]:
    """Return kinetic and potential energy (0 at rest), J / p2, on a still base."""
    set_out(chain, n, state.side, state.gap, place)
    kinetic = 0.0
    potential = 0.0
    base = 0.0
    for k in range(n):
        vx = 0.0
        vz = 0.0
        spin = 0.0
        for i in range(k + 1):
            vx += state.rate[i] * (place.centre[k, 1] - place.pivot[i, 1])
            vz -= state.rate[i] * (place.centre[k, 0] - place.pivot[i, 0])
            spin += state.rate[i]
        kinetic += 0.5 * (chain.mass[k] * (vx * vx + vz * vz) + chain.inertia[k] * spin * spin)
        potential += chain.mass[k] * chain.scales[GRAVITY] * (place.centre[k, 1] - base - 0.5 * chain.height[k])
        base += chain.height[k]
    return kinetic, potential


@lent
def safe(chain: Chain, n: int, state: State, place: Place) -> bool:
    """Tell whether nothing of the stack can ever fall, the base staying still."""
    least = math.inf
    reach = 0.0
    widest = 0.0
    share = 0.0
    for i in range(n):
        mass = 0.0
        moment = 0.0
        base = 0.0
        for k in range(i, n):
            mass += chain.mass[k]
            moment += chain.mass[k] * (base + 0.5 * chain.height[k])
            base += chain.height[k]
        centre = moment / mass
        half = chain.half[i]
        alpha = math.atan2(half, centre)
        least = min(least, chain.scales[GRAVITY] * mass * (math.hypot(half, centre) - centre))
        reach += alpha
        share += abs(state.gap[i]) / alpha
        # A block's own function leans by at most atan(|X| / Z): X holds half widths of both its contacts.
        over = chain.half[i + 1] if i + 1 < n else 0.0
        x = chain.mass[i] * half + (mass - chain.mass[i]) * (half + over)
        z = chain.mass[i] * 0.5 * chain.height[i] + (mass - chain.mass[i]) * chain.height[i]
        widest = max(widest, math.atan2(x, z))
    if share >= 1.0 or reach + widest >= 0.5 * math.pi:
        return False
    kinetic, potential = energies(chain, n, state, place)
    return kinetic + potential < least * (1.0 - MARGIN)
