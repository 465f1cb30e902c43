"""The three equations of motion, the uplift and the barriers that go with each; time in units of 1/p.

With phi = |theta| on side s, f = s a / g, S = sin(alpha), C = cos(alpha):

    nonlinear       phi'' = -sin(alpha - phi) - f cos(alpha - phi)      uplift at g tan(alpha)
    quasi-linear    phi'' = -(S - phi C) - f (C + phi S)                uplift at g tan(alpha)
    linearised      phi'' = phi - alpha - f                             uplift at g alpha

(N. Ceh, doctoral thesis, Rijeka 2018, chapter 3). On a still base the last two are phi'' = lam^2 (phi - c), unstable at
the centre c: lam^2 = C, c = tan(alpha); lam = 1, c = alpha. psi = c - phi is carried beside phi (c = alpha in the
nonlinear equation), so that neither is the difference of nearly equal numbers.
"""

from __future__ import annotations

import math

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.methods.problem import LINEARISED, MODELS, MethodRefused, Problem
from twin.rocking.rest import remaining_time
from twin.rocking.run import local_tolerance, parameters
from twin.rocking.verdict import barrier_margins

FULL_EQUATION, SMALL_ROTATION, SMALL_BOTH = 0, 1, 2
REST_TERMS = 6


def model_code(model: str) -> int:
    """Return the number the compiled code knows a model by."""
    return MODELS.index(model)


def uplift_threshold(block: Block, model: str) -> float:
    """Return the base acceleration above which the block lifts off, m/s2."""
    return block.gravity * block.slenderness if model == LINEARISED else block.uplift_acceleration


def model_parameters(problem: Problem) -> FloatArray:
    """Return `parameters` of the problem's block, with the model's own uplift; refuses what a model cannot be.

    The quasi-linear equilibrium tan(alpha) must lie below pi/2, or a block "overturns" that it then pulls back.
    """
    body = parameters(problem.block, problem.eta, local_tolerance(problem.tolerance))
    body[4] = uplift_threshold(problem.block, problem.model)
    if centre(model_code(problem.model), float(body[0])) >= 0.5 * math.pi:
        raise MethodRefused(
            f"the {problem.model} model has its equilibrium at tan(alpha) = {math.tan(body[0]):.4g} rad; "
            "it must lie below pi/2"
        )
    return body


@compiled
def centre(model: int, alpha: float) -> float:
    """Return the unstable equilibrium on a still base, rad."""
    return math.tan(alpha) if model == SMALL_ROTATION else alpha


@compiled
def growth(model: int, alpha: float) -> float:
    """Return lam, the rate of growth next to it, units of p."""
    return math.sqrt(math.cos(alpha)) if model == SMALL_ROTATION else 1.0


@compiled
def acceleration(model: int, alpha: float, phi: float, psi: float, f: float) -> float:
    """Return phi''."""
    if model == FULL_EQUATION:
        return -math.sin(psi) - f * math.cos(psi)
    if model == SMALL_ROTATION:
        return -math.cos(alpha) * psi - f * (math.cos(alpha) + phi * math.sin(alpha))
    return -psi - f


@compiled
def margins(model: int, alpha: float, eta: float, psi: float, v: float) -> tuple[float, float]:
    """Return how far a state lies beyond the two barriers of a still base; it overturns if either is above zero.

    As `twin.rocking.verdict.barrier_margins`; in the linear models the barrier ahead is v + lam (phi - c) > 0 and the
    one the way round eta v0 > lam c, v0^2 = v^2 + lam^2 (c^2 - psi^2).
    """
    if model == FULL_EQUATION:
        return barrier_margins(alpha, eta, psi, v)
    c = centre(model, alpha)
    lam = growth(model, alpha)
    strike = math.sqrt(max(0.0, v * v + lam * lam * (c - psi) * (c + psi)))
    return v - lam * psi, eta * strike - lam * c


@compiled
def margin_slopes(model: int, alpha: float, psi: float, v: float) -> tuple[float, float, float]:
    """Return d(ahead)/d(phi) and the derivatives of the strike rate v0 by phi and by v."""
    if model == FULL_EQUATION:
        base = math.sin(0.5 * alpha)
        half = math.sin(0.5 * psi)
        strike = math.sqrt(max(1e-300, v * v + 4.0 * (base - half) * (base + half)))
        return math.cos(0.5 * psi), math.sin(psi) / strike, v / strike
    c = centre(model, alpha)
    lam = growth(model, alpha)
    strike = math.sqrt(max(1e-300, v * v + lam * lam * (c - psi) * (c + psi)))
    return lam, lam * lam * psi / strike, v / strike


@compiled
def time_to_rest(model: int, alpha: float, eta: float, v: float) -> float:
    """Return p times the time from an impact left at a small rate `v` to rest on a still base; infinite for eta = 1.

    Linear models: a flight lasts (2 / lam) atanh(v / (lam c)); each power of its series is summed over the impacts.
    """
    if model == FULL_EQUATION or v == 0.0 or eta >= 1.0:
        return remaining_time(v, alpha, eta)
    lam = growth(model, alpha)
    y = v / (lam * centre(model, alpha))
    total = 0.0
    power = y
    damped = eta
    for n in range(REST_TERMS):
        total += power / ((2 * n + 1) * (1.0 - damped))
        power *= y * y
        damped *= eta * eta
    return 2.0 * total / lam
