"""`simulate`: a block or a stack, a base motion, and what happens."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, overload

from twin.rocking.block import Block
from twin.rocking.march import HALF_TURN
from twin.rocking.methods import MODELS, NONLINEAR, MethodRefused, Problem, Solution, default_method
from twin.rocking.methods import method as method_called
from twin.rocking.methods.taylor import overturns
from twin.rocking.models.ladder import AT_REST, AUTO, MODEL_TOLERANCE, choose
from twin.rocking.response import Response
from twin.rocking.restitution import Restitution, restitution_ratio
from twin.rocking.run import STILL_BASE
from twin.stack.stack import Stack

if TYPE_CHECKING:
    from excitation import Pulse
    from twin.stack.response import StackResponse

__all__ = ["overturns", "simulate"]

CLOSED_FORM = "closed-form"


@overload
def simulate(
    block: Block,
    pulse: Pulse | None = None,
    *,
    restitution: Restitution = None,
    initial_rotation: float = 0.0,
    initial_angular_velocity: float = 0.0,
    duration: float | None = None,
    tolerance: float = 1e-10,
    method: str | None = None,
    step: float | None = None,
    model: str = "nonlinear",
    model_tolerance: float = MODEL_TOLERANCE,
) -> Response: ...
@overload
def simulate(
    block: Stack,
    pulse: Pulse | None = None,
    *,
    initial_rotation: float | Sequence[float] = 0.0,
    initial_angular_velocity: float | Sequence[float] = 0.0,
    duration: float | None = None,
    tolerance: float = 1e-10,
    impact_rule: str | None = None,
    pulling_pivot: str | None = None,
) -> StackResponse: ...
def simulate(
    block: Block | Stack,
    pulse: Pulse | None = None,
    *,
    restitution: Restitution = None,
    initial_rotation: float | Sequence[float] = 0.0,
    initial_angular_velocity: float | Sequence[float] = 0.0,
    duration: float | None = None,
    tolerance: float = 1e-10,
    method: str | None = None,
    step: float | None = None,
    model: str = "nonlinear",
    model_tolerance: float = MODEL_TOLERANCE,
    impact_rule: str | None = None,
    pulling_pivot: str | None = None,
) -> Response | StackResponse:
    """Return how `block` answers `pulse`: nonlinear equation, every impact at its exact time.

    Parameters
    ----------
    block : Block or Stack
        For a stack see `twin.stack.simulation.simulate_stack`: it takes an initial rotation and velocity for each of
        its blocks, no `restitution` (its interfaces have `impulse_shares`) and neither method, step nor model.
    pulse : Pulse, optional
        Base motion; None for free rocking.
    restitution : float or Improved, optional
        Ratio of angular velocities after and before an impact, 0 to 1, or `Improved(k)`. None: Housner's.
    initial_rotation, initial_angular_velocity : float
        rad (|rotation| below pi/2) and rad/s, signed: positive leans towards +x.
    duration : float, optional
        Length of the run, s: a longer pulse ends there. None: until the block rests or lies. A block that hardly loses
        anything is followed over 100 000 impacts; where that is not enough, `Response.end_time` says how far it got.
    tolerance : float
        Absolute error of the rotation along the run, rad, above 0, for the methods that choose their own steps; see
        `Response.rotation_error`.
    method : str, optional
        "taylor" (default of the nonlinear model), "closed-form" (default of the others, and where nothing is forced),
        "dop853" (reference; default of the quasi-linear model under a wave or a record), "rk4" or "newmark".
    step : float, optional
        Time step of rk4 and newmark, s; None: 1 ms. Each states its error in `Response.rotation_error`.
    model : str
        "nonlinear", "quasi-linear" (small rotation), "linearised" (small rotation and slenderness), or "auto": the
        simplest whose error is bounded to stay inside `model_tolerance`, "at rest" among them, with `method` for the
        nonlinear one; see `twin.rocking.models.ladder`, and `model` and `model_reason` of the response.
    model_tolerance : float
        With "auto", the relative error of the peak rotation and of the times of impacts and rest (from uplift on)
        allowed to a simpler model, above 0 and below 1.
    impact_rule, pulling_pivot : str, optional
        Of a stack; see `simulate_stack`.

    Returns
    -------
    Response or StackResponse
        The outcome of one block is for ever: once the pulse is over, the state decides, whatever the duration.

    Raises
    ------
    ValueError
        Where an argument is not finite or outside its range.
    MethodRefused
        A `ValueError`: where the method cannot do what is asked.

    Examples
    --------
    >>> simulate(Block(0.06, 0.27), initial_rotation=0.15).outcome
    <Outcome.ROCKED: 'rocked'>

    References
    ----------
    G. W. Housner, Bull. Seism. Soc. Am. 53(2), 1963; N. Ceh, doctoral thesis, Rijeka 2018, chapter 3.
    """
    if isinstance(block, Stack):
        settings = (restitution, method, step, None if model == NONLINEAR else model)
        if settings != (None,) * 4 or model_tolerance != MODEL_TOLERANCE:
            raise ValueError("a stack has its own restitution and one method: give impulse_shares to the Stack instead")
        return _stacked(
            block, pulse, initial_rotation, initial_angular_velocity, duration, tolerance, impact_rule, pulling_pivot
        )
    if impact_rule is not None or pulling_pivot is not None:
        raise ValueError("impact_rule and pulling_pivot are for a stack; for one block give restitution")
    if isinstance(initial_rotation, Sequence) or isinstance(initial_angular_velocity, Sequence):
        raise ValueError("one block has one initial rotation and one initial angular velocity: give numbers")
    eta = restitution_ratio(block, restitution)
    _check(initial_rotation, initial_angular_velocity, duration, tolerance, step, model, model_tolerance)
    problem = Problem(
        block=block,
        eta=eta,
        pieces=STILL_BASE[:0] if pulse is None else pulse.pieces,
        rotation=initial_rotation,
        rate=initial_angular_velocity,
        end=math.inf if duration is None else duration,
        tolerance=tolerance,
        step=step,
        model=NONLINEAR if model == AUTO else model,
    )
    reason = f"{model}: asked for"
    if model not in (NONLINEAR, AUTO):
        reason += "; nothing is claimed about the nonlinear answer"
    if model == AUTO:
        choice = choose(problem, _closed_form, model_tolerance)
        model, reason = choice.model, choice.reason
        if choice.solution is not None:
            how = "none" if model == AT_REST else CLOSED_FORM
            return Response(block, eta, how, model, choice.solution, pulse, reason)
    solver = method_called(default_method(problem) if method is None else method)
    if model not in solver.models:
        raise MethodRefused(f"{solver.name} solves the {', '.join(solver.models)} model; asked for {model}")
    return Response(block, eta, solver.name, model, solver.solve(problem), pulse, reason)


def _stacked(
    stack: Stack,
    pulse: Pulse | None,
    rotation: float | Sequence[float],
    rate: float | Sequence[float],
    duration: float | None,
    tolerance: float,
    impact_rule: str | None,
    pulling_pivot: str | None,
) -> StackResponse:
    # Its machine code is not loaded in vain.
    from twin.stack.simulation import IMPACT_RULES, PULLING_PIVOTS, simulate_stack

    return simulate_stack(
        stack,
        pulse,
        initial_rotation=rotation,
        initial_angular_velocity=rate,
        duration=duration,
        tolerance=tolerance,
        impact_rule=next(iter(IMPACT_RULES)) if impact_rule is None else impact_rule,
        pulling_pivot=next(iter(PULLING_PIVOTS)) if pulling_pivot is None else pulling_pivot,
    )


def _closed_form(problem: Problem) -> Solution:
    return method_called(CLOSED_FORM).solve(problem)


def _check(
    rotation: float,
    rate: float,
    duration: float | None,
    tolerance: float,
    step: float | None,
    model: str,
    model_tolerance: float,
) -> None:
    if not abs(rotation) < HALF_TURN:
        raise ValueError(f"initial rotation is {rotation:g} rad; it must lie inside -pi/2 to pi/2")
    if not math.isfinite(rate):
        raise ValueError(f"initial angular velocity is {rate:g} rad/s; it must be finite")
    if duration is not None and not 0.0 < duration < math.inf:
        raise ValueError(f"duration is {duration:g} s; it must be above 0 and finite")
    if not 0.0 < tolerance < math.inf:
        raise ValueError(f"tolerance is {tolerance:g} rad; it must be above 0 and finite")
    if step is not None and not 0.0 < step < math.inf:
        raise ValueError(f"step is {step:g} s; it must be above 0 and finite")
    if model not in (*MODELS, AUTO):
        raise ValueError(f"there is no model {model!r}; there are {', '.join((*MODELS, AUTO))}")
    if not 0.0 < model_tolerance < 1.0:
        raise ValueError(f"model tolerance is {model_tolerance:g}; it is a relative error, above 0 and below 1")
