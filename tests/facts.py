"""Answers to many digits, to test against.

Source: the project's facts and failure tables; computed there with two independent codes, or with 25 to 45 digits.
Block B6L is read from N. Ceh's doctoral thesis (University of Rijeka, 2018). Dimensionless: A = a0 / (g tan alpha),
W = omega / p; one cycle of the wave; Housner's restitution; nonlinear equation; g = 9.81 m/s2.
"""

from __future__ import annotations

import math

import numpy as np

from excitation import ConstantPulse, SineWave
from twin import Block

B6L = Block(0.06, 0.27, mass=2.5692)
P = B6L.frequency_parameter
LIMIT = B6L.uplift_acceleration

# Free rocking from 0.15 rad: number of the impact -> (time s, rate before it rad/s).
FREE_IMPACTS = {
    1: (0.2505181298324682, 1.510969548533107),
    2: (0.6314507958539288, 1.404312874519005),
    3: (0.9495878823179852, 1.305184906905899),
    10: (2.369828568764780, 0.781860372390040),
    50: (4.106185517566606, 0.041826914159381),
    100: (4.199172700842597, 0.001076128427011),
}
# The table prints 0.0241963565123033 for the tenth; 40-digit arithmetic from the energy gives the one here.
FREE_PEAKS = {1: 0.115871752871769, 2: 0.0936620692074188, 3: 0.0772456464751771, 10: 0.02419635751230329}
FREE_REST = 4.201628087428982
FREE_ROTATION_AT_2 = -0.0348222856551810

# One full sine wave: (W, A at the boundary, whether it overturns just above it).
BOUNDARIES = (
    (1, 1.102936489032612, True),
    (1, 1.113965870861176, False),
    (1, 1.130219301613210, True),
    (1, 1.416502102151863, False),
    (1, 1.417735232348325, True),
    (2, 1.221298881120159, True),
    (2, 2.333368982702716, False),
    (2, 2.355902324322715, True),
    (4, 1.747342444980309, True),
    (4, 5.070294358330140, False),
    (4, 5.303416685088441, True),
)


def sine(amplitude: float, frequency: float, cycles: float = 1.0) -> SineWave:
    """Return the sine of dimensionless amplitude A and frequency W on B6L."""
    return SineWave(amplitude * LIMIT, frequency * P / (2.0 * math.pi), cycles)


def constant(amplitude: float, duration: float) -> ConstantPulse:
    """Return the constant pulse of dimensionless amplitude A on B6L, lasting `duration` s."""
    return ConstantPulse(amplitude * LIMIT, duration)


def quarter_period(rotation: float, block: Block = B6L) -> float:
    """Return the time from rest at `rotation` (rad, below alpha) to the impact, s, by elliptic integrals."""
    from scipy.special import ellipkinc, ellipkm1

    alpha = block.slenderness
    k = math.cos(0.5 * (alpha - rotation))
    complement = math.sin(0.5 * (alpha - rotation)) ** 2
    whole = float(ellipkm1(complement))
    part = float(ellipkinc(math.asin(math.cos(0.5 * alpha) / k), k * k))
    return (whole - part) / block.frequency_parameter


def scipy_reference(
    block: Block, eta: float, pulse: SineWave | ConstantPulse | None, state: tuple[float, float], end: float
) -> tuple[list[float], float]:
    """Return impact times and the rotation at `end` by SciPy's DOP853 at rtol 1e-12, restarted at each impact.

    Each flight is integrated a little past the contact and the first sign change of the dense output located by
    Brent's method; the leg starts just off the contact, so the restart is never taken for the next impact.
    """
    from scipy.integrate import solve_ivp
    from scipy.optimize import brentq

    alpha, p, g = block.slenderness, block.frequency_parameter, block.gravity

    def rhs(t: float, y: np.ndarray, s: float) -> list[float]:
        a = pulse.acceleration(t) if pulse is not None else 0.0
        return [y[1], -p * p * (math.sin(alpha - y[0]) + s * a / g * math.cos(alpha - y[0]))]

    theta, omega = state
    side = math.copysign(1.0, theta if theta != 0.0 else omega)
    t, y = 0.0, [abs(theta), side * omega]
    breaks = [] if pulse is None else [float(b) for b in pulse.breakpoints if 0.0 < b < end]
    impacts: list[float] = []
    while t < end:
        stop = min([b for b in [*breaks, end] if b > t])
        grid = np.linspace(t, min(stop, t + 0.02), 9)
        leg = solve_ivp(rhs, (t, grid[-1]), y, "DOP853", rtol=1e-12, atol=1e-14, dense_output=True, args=(side,))
        values = leg.sol(grid)[0]
        below = np.nonzero(values[1:] < 0.0)[0]
        if below.size:
            lo, hi = grid[below[0]], grid[below[0] + 1]
            if below[0] == 0:
                lo = lo + 1e-9
            t = float(brentq(lambda x, leg=leg: leg.sol(x)[0], lo, hi, xtol=1e-15))
            impacts.append(t)
            y = [0.0, -eta * float(leg.sol(t)[1])]
            side = -side
        else:
            t, y = float(grid[-1]), [float(v) for v in leg.y[:, -1]]
    return impacts, side * y[0]
