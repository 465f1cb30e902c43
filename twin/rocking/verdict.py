"""Whether a block on a still base overturns: decided from its state, without stepping."""

from __future__ import annotations

import math

from twin.rocking.compiled import compiled


@compiled
def barrier_margins(alpha: float, restitution: float, psi: float, v: float) -> tuple[float, float]:
    """Return how far a state lies beyond the two barriers, in units of p; it overturns if either is above zero.

    The first is the way ahead: states that overturn on this side lie above the stable branch of the separatrix,
    v = 2 sin(psi / 2) with psi = alpha - phi (E = v2/2 + cos(psi) - 1 = 0, approaching the equilibrium). The second is
    the way round: the block falls back, strikes at v0, and passes the other side's barrier where
    eta v0 > 2 sin(alpha / 2). No later impact can overturn it, so the two are the whole rule.

    Parameters
    ----------
    alpha, restitution : float
        Slenderness angle, rad; ratio of rates over an impact.
    psi, v : float
        alpha - |theta|, rad, and d|theta|/d(p t).
    """
    ahead = v - 2.0 * math.sin(0.5 * psi)
    half = math.sin(0.5 * psi)
    base = math.sin(0.5 * alpha)
    # v0^2 = v^2 + 2 cos(psi) - 2 cos(alpha), written without the difference of cosines.
    strike_squared = v * v + 4.0 * (base - half) * (base + half)
    strike = math.sqrt(max(0.0, strike_squared))
    return ahead, restitution * strike - 2.0 * base


@compiled
def impact_slope(alpha: float, psi: float, v: float) -> tuple[float, float]:
    """Return the derivatives of the strike rate v0 by phi and by v (for the error of the second margin)."""
    base = math.sin(0.5 * alpha)
    half = math.sin(0.5 * psi)
    strike = math.sqrt(max(1e-300, v * v + 4.0 * (base - half) * (base + half)))
    return math.sin(psi) / strike, v / strike
