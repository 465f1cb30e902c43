"""One step of the classical schemes: RK4 and Newmark's average acceleration, and their steps that end at a given value.

Units of 1/p. A step returns the change of phi, not phi, so that psi loses no digits either.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.methods.equations import FULL_EQUATION, SMALL_ROTATION, acceleration
from twin.rocking.series import base_acceleration

RK4, NEWMARK = 0, 1
MOST_ITERATIONS = 30
# Newton-Raphson ends where a correction is rounding.
CONVERGED = 4e-16
# Share of the tangent 4 / h^2 the stiffness must leave: at h = 2 it takes all of it.
LEAST_TANGENT = 0.05


@compiled
def stiffness(model: int, alpha: float, psi: float, f: float) -> float:
    """Return d(phi'') / d(phi)."""
    if model == FULL_EQUATION:
        return math.cos(psi) - f * math.sin(psi)
    if model == SMALL_ROTATION:
        return math.cos(alpha) - f * math.sin(alpha)
    return 1.0


@compiled
def take_step(
    scheme: int,
    model: int,
    alpha: float,
    piece: FloatArray,
    t: float,
    scale: float,
    p: float,
    start: FloatArray,
    h: float,
) -> tuple[float, float, bool]:
    """Return the change of phi, the new rate and whether the step has an answer.

    `start` is (phi, psi, v); `scale` is s / g; `t` the time of the start, s.
    """
    phi, psi, v = start[0], start[1], start[2]
    f0 = scale * base_acceleration(piece, t)
    f1 = scale * base_acceleration(piece, t + h / p)
    a0 = acceleration(model, alpha, phi, psi, f0)
    if scheme == RK4:
        # Kutta 1901
        fm = scale * base_acceleration(piece, t + 0.5 * h / p)
        v2 = v + 0.5 * h * a0
        d2 = 0.5 * h * v
        a2 = acceleration(model, alpha, phi + d2, psi - d2, fm)
        v3 = v + 0.5 * h * a2
        d3 = 0.5 * h * v2
        a3 = acceleration(model, alpha, phi + d3, psi - d3, fm)
        v4 = v + h * a3
        d4 = h * v3
        a4 = acceleration(model, alpha, phi + d4, psi - d4, f1)
        return h * (v + 2.0 * v2 + 2.0 * v3 + v4) / 6.0, v + h * (a0 + 2.0 * a2 + 2.0 * a3 + a4) / 6.0, True
    # Newmark 1959, gamma = 1/2, beta = 1/4:  d = h v + h^2 (a0 + a1) / 4;  v1 = v + h (a0 + a1) / 2
    d = h * (v + 0.5 * h * a0)
    quarter = 0.25 * h * h
    for _ in range(MOST_ITERATIONS):
        a1 = acceleration(model, alpha, phi + d, psi - d, f1)
        tangent = 1.0 - quarter * stiffness(model, alpha, psi - d, f1)
        if tangent < LEAST_TANGENT:
            return d, v, False
        change = (d - h * v - quarter * (a0 + a1)) / tangent
        d -= change
        if abs(change) <= CONVERGED * (abs(d) + h * abs(v) + quarter):
            a1 = acceleration(model, alpha, phi + d, psi - d, f1)
            return d, v + 0.5 * h * (a0 + a1), True
    return d, v, False


@compiled
def step_to(
    scheme: int,
    model: int,
    alpha: float,
    piece: FloatArray,
    t: float,
    scale: float,
    p: float,
    start: FloatArray,
    wanted: float,
    longest: float,
) -> tuple[float, float, bool]:
    """Return the length of the step, at most `longest`, that changes phi by `wanted`; the rate there; success.

    The step is repeated with its length unknown (N. Ceh, doctoral thesis, Rijeka 2018, section 3.4): Newton's method
    in h, whose slope is the rate, kept inside the bracket.
    """
    left = 0.0
    right = longest
    h = longest
    sign = 1.0 if wanted > 0.0 else -1.0
    rate = 0.0
    for _ in range(100):
        d, rate, good = take_step(scheme, model, alpha, piece, t, scale, p, start, h)
        if not good:
            return h, rate, False
        y = sign * (d - wanted)
        if y < 0.0:
            left = h
        else:
            right = h
        new = h - (d - wanted) / rate if rate != 0.0 else left
        if not left <= new <= right:
            new = 0.5 * (left + right)
        if abs(new - h) <= 2.5e-16 * h or not left < new < right:
            _, rate, good = take_step(scheme, model, alpha, piece, t, scale, p, start, new)
            return new, rate, good
        h = new
    return h, rate, True
