"""How large the error of the state is: its covariance, carried along with the step and over the impact.

Each step adds its own rounding and truncation, the linearised flow carries what is there, an impact reflects it
(saltation matrix). The result decides nothing but whether an outcome has to be looked at twice.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.polynomial import slope, value
from twin.rocking.series import ORDER
from twin.rocking.state import DOUBT, E11, E12, E22, PHI, RATE, WORST

EPSILON = 2.3e-16
TANGENT_ORDER = 12
LEFT_OUT = 0.1
# Beyond this standard deviation (rad) or this relative change of the impact rate, the linear picture is not trusted.
LARGEST_LINEAR = 1e-6
LARGEST_IMPACT_CHANGE = 1e-3


@compiled
def carry(state: FloatArray, f: FloatArray, forced: int, work: FloatArray, h: float, tolerance: float) -> None:
    """Carry the ellipse over a step of length `h` (1/p), called before the state itself is advanced.

    delta'' = K delta, K = C - f S, whose series follow from those of the step (rows 0 and 1 of `work`; row 2 is
    overwritten).
    """
    stiffness = work[2]
    for k in range(TANGENT_ORDER):
        total = work[1, k]
        for j in range(min(k + 1, forced)):
            total -= f[j] * work[0, k - j]
        stiffness[k] = total
    c, q = _transition(stiffness, 1.0, 0.0, h)
    s, r = _transition(stiffness, 0.0, 1.0, h)
    grow(state, c, s, q, r, f[0], h, LEFT_OUT * tolerance)


@compiled
def grow(state: FloatArray, c: float, s: float, q: float, r: float, force: float, h: float, left_out: float) -> None:
    """Carry the ellipse over a stretch of length `h` with transition matrix [[c, s], [q, r]], and add its own error.

    Rounding of the sums, one rounding of the forcing `force` over the stretch, and the terms `left_out` of the series:
    0.9^24 of its tolerance, what the step's length allows them.
    """
    e11, e12, e22 = state[E11], state[E12], state[E22]
    state[E11] = c * c * e11 + 2.0 * c * s * e12 + s * s * e22
    state[E12] = c * q * e11 + (c * r + s * q) * e12 + s * r * e22
    state[E22] = q * q * e11 + 2.0 * q * r * e12 + r * r * e22
    d = EPSILON * min(abs(state[PHI]) + abs(state[RATE]) * h, 2.0)
    w = EPSILON * (abs(state[RATE]) + (1.0 + abs(force)) * h)
    state[E11] += d * d + w * w * h * h + left_out * left_out
    state[E22] += w * w
    if left_out > 0.0:
        state[E22] += (ORDER * left_out / h) ** 2
    worst = math.sqrt(state[E11])
    state[WORST] = max(state[WORST], worst)
    if worst > LARGEST_LINEAR:
        state[DOUBT] = 1.0


@compiled
def _transition(stiffness: FloatArray, displacement: float, rate: float, h: float) -> tuple[float, float]:
    """Return delta and delta' after `h`, from the given ones: a short series is enough for an error of an error."""
    d = np.empty(TANGENT_ORDER + 2)
    d[0] = displacement
    d[1] = rate
    for k in range(TANGENT_ORDER):
        total = 0.0
        for j in range(k + 1):
            total += stiffness[j] * d[k - j]
        d[k + 2] = total / ((k + 1) * (k + 2))
    return value(d, TANGENT_ORDER + 1, h), slope(d, TANGENT_ORDER + 1, h)


@compiled
def reflect(state: FloatArray, alpha: float, eta: float, before: float, force: float) -> None:
    """Carry the ellipse over an impact at rate `before` < 0 under f = `force` on the side that is left.

    d(phi)+ = -eta d(phi);  d(v)+ = -eta d(v) + (eta F- + F+) / v- d(phi),  F-+ = -sin(alpha) -+ f cos(alpha).
    """
    sine = math.sin(alpha)
    cosine = math.cos(alpha)
    saltate(state, eta, before, -sine - force * cosine, -sine + force * cosine)


@compiled
def saltate(state: FloatArray, eta: float, before: float, leaving: float, entering: float) -> None:
    """Carry the ellipse over an impact at rate `before` < 0: `leaving` and `entering` are phi'' just before and after.

    d(phi)+ = -eta d(phi);  d(v)+ = -eta d(v) + (eta phi''- + phi''+) / v- d(phi).
    """
    if before == 0.0:
        state[DOUBT] = 1.0
        return
    m = (eta * leaving + entering) / before
    if math.sqrt(state[E11]) * abs(leaving) > LARGEST_IMPACT_CHANGE * before * before:
        state[DOUBT] = 1.0
    e11, e12, e22 = state[E11], state[E12], state[E22]
    state[E11] = eta * eta * e11
    state[E12] = eta * eta * e12 - eta * m * e11
    state[E22] = eta * eta * e22 - 2.0 * eta * m * e12 + m * m * e11
