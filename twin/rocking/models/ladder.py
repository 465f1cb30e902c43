"""No more model than a run needs: the lowest rung whose error is proved to stay inside a tolerance.

    at rest        |a| never passes g tan(alpha): no equation at all
    linearised     small rotation and small slenderness, in closed form
    quasi-linear   small rotation, in closed form where there is one
    nonlinear      the equation itself

The error is that of the peak rotation and of the times of all impacts and of rest, the latter counted from the first
uplift, relative to the nonlinear motion. It is bounded by `model_error`, which never solves the nonlinear
equation. A run whose verdict, contacts or their order might differ stays with the nonlinear model, and so does one that
overturns. The simpler rungs are no faster here (the bound costs more than the Taylor method's few microseconds): they
are what a hand calculation, or a table of closed forms, may be trusted with.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from excitation.extremes import extremes
from excitation.pieces import PieceTable
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import LINEARISED, NONLINEAR, QUASI_LINEAR, MethodRefused, Problem, Solution
from twin.rocking.models.flight_error import Unbounded
from twin.rocking.models.model_error import ModelError, model_error, percent
from twin.rocking.uplift import UPLIFT_TOLERANCE

AT_REST = "at rest"
AUTO = "auto"
MODEL_TOLERANCE = 0.01
"""Relative error of peak and times that a simpler model may have, unless told."""

Solve = Callable[[Problem], Solution]


@dataclass(frozen=True, slots=True)
class Choice:
    """The rung taken.

    Attributes
    ----------
    model : str
        "at rest", "linearised", "quasi-linear" or "nonlinear".
    reason : str
        One sentence.
    solution : Solution or None
        The answer; None where the nonlinear equation has still to be solved.
    """

    model: str
    reason: str
    solution: Solution | None


@dataclass(frozen=True, slots=True)
class _Standing:
    """The history of a block that never moves."""

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.zeros_like(times), np.zeros_like(times)


def choose(problem: Problem, solve: Solve, model_tolerance: float = MODEL_TOLERANCE) -> Choice:
    """Return the lowest rung whose error stays inside `model_tolerance` (relative, above 0).

    Parameters
    ----------
    problem : Problem
        Its `model` is not looked at.
    solve : callable
        Solves a problem of one of the simpler models, or raises `MethodRefused`.
    """
    pieces = _cut(problem.pieces, problem.end)
    standing = _at_rest(problem, pieces)
    if standing is not None:
        return standing
    against: list[str] = []
    for model in (LINEARISED, QUASI_LINEAR):
        # The whole future is bounded, whatever the run's length: its outcome is for ever.
        simpler = replace(problem, model=model, pieces=pieces, end=math.inf)
        try:
            solution = solve(simpler)
            error = model_error(simpler, solution, model_tolerance)
            if error.largest > model_tolerance:
                against.append(f"the {model} one may be off by {percent(error.peak)} in its peak rotation")
            elif not _peak_within(problem, simpler, solution, solve, model_tolerance):
                against.append(f"the {model} one is cut before its peak")
            else:
                given = solution if math.isinf(problem.end) else solve(replace(simpler, end=problem.end))
                return Choice(model, _within(model, error, model_tolerance), given)
        except Unbounded as why:
            against.append(f"the {model} one {why}")
        except MethodRefused:
            against.append(f"the {model} one has no closed form here")
    return Choice(NONLINEAR, f"{NONLINEAR}: {'; '.join(against)} ({percent(model_tolerance)} allowed)", None)


def _peak_within(problem: Problem, simpler: Problem, solution: Solution, solve: Solve, tolerance: float) -> bool:
    """Tell whether both blocks are past the flight with their peak when the run ends."""
    if math.isinf(problem.end):
        return True
    before = solution.impact_times[solution.impact_times * (1.0 + tolerance) <= problem.end]
    known = abs(problem.rotation) if not len(before) else solve(replace(simpler, end=float(before[-1]))).peak
    return known >= solution.peak * (1.0 - 1e-9)


def _within(model: str, error: ModelError, allowed: float) -> str:
    return (
        f"{model}: its peak rotation is within {percent(error.peak)} and its impact times within "
        f"{percent(error.times)} of the nonlinear ones ({percent(allowed)} allowed)"
    )


def _cut(pieces: FloatArray, end: float) -> FloatArray:
    """Return the pieces up to `end`, s."""
    if not len(pieces) or pieces[-1, 1] <= end:
        return pieces
    kept = pieces[pieces[:, 0] < end].copy()
    kept[-1, 1] = end
    return kept


def _at_rest(problem: Problem, pieces: FloatArray) -> Choice | None:
    if problem.rotation != 0.0 or problem.rate != 0.0:
        return None
    limit = problem.block.uplift_acceleration
    peak = max(map(abs, extremes(PieceTable(pieces)).acceleration)) if len(pieces) else 0.0
    if peak > limit * (1.0 + UPLIFT_TOLERANCE):
        return None
    reason = f"{AT_REST}: the base acceleration peaks at {peak:.4g} m/s2 and lifts the block above {limit:.4g} m/s2"
    nothing = np.zeros(0)
    return Choice(
        AT_REST,
        reason,
        Solution(
            uplift_time=None,
            impact_times=nothing,
            impact_rates=nothing,
            rest_time=None,
            overturning_time=None,
            side=0,
            overturned=False,
            resting=True,
            peak=0.0,
            error=0.0,
            end_time=math.inf,
            history=_Standing(),
        ),
    )
