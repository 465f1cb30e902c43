"""The default: Taylor series of order 24, every impact at its exact time, an error carried with the state.

Source: A. Jorba & M. Zou, Exp. Math. 14(1), 2005 (series arithmetic and step length); the events are this project's
(`twin.rocking.march`). Nonlinear equation, any pieces. Where the base stands still, before or after the excitation,
nothing is stepped: the flights have a closed form (`free`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import STUCK
from twin.rocking.methods.after import Stages, free_stage, joined
from twin.rocking.methods.equations import FULL_EQUATION
from twin.rocking.methods.judgement import sorted_events, still_base_verdict
from twin.rocking.methods.problem import NONLINEAR, MethodRefused, Problem, Solution
from twin.rocking.methods.rounding import settled
from twin.rocking.run import MOST_STEPS, Run, initial_state, local_tolerance, parameters
from twin.rocking.state import PEAK, SIDE

ERROR_DEVIATIONS = 8.0
TIGHT = 1e-10
"""A tolerance, rad, at which truncation is below rounding: no outcome is left undecided for a looser one's sake."""


@dataclass(frozen=True, slots=True)
class Steps:
    """History of recorded steps: rows of start s, length 1/p, side, coefficients of |theta| in p (t - start)."""

    rows: FloatArray
    p: float

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation and angular velocity at `times`."""
        if not self.rows.shape[0]:
            return np.zeros_like(times), np.zeros_like(times)
        rows = np.searchsorted(self.rows[:, 0], times, side="right") - 1
        steps = self.rows[rows]
        x = np.clip(self.p * (times - steps[:, 0]), 0.0, steps[:, 1])
        c = steps[:, 3:]
        n = c.shape[1] - 1
        y = c[:, n].copy()
        d = c[:, n] * n
        for k in range(n - 1, 0, -1):
            y = y * x + c[:, k]
            d = d * x + k * c[:, k]
        y = y * x + c[:, 0]
        return steps[:, 2] * y, steps[:, 2] * d * self.p


@dataclass(frozen=True, slots=True)
class Taylor:
    """See the module."""

    name: str = "taylor"
    models: tuple[str, ...] = (NONLINEAR,)
    source: str = "Jorba & Zou 2005, order 24"

    def solve(self, problem: Problem) -> Solution:
        """Return the answer to `problem`; refuses a run of more than `MOST_STEPS` steps."""
        end, shaking, pieces = problem.end, problem.shaking, problem.pieces
        body = parameters(problem.block, problem.eta, local_tolerance(problem.tolerance))
        run = Run(body, initial_state(body, problem.rotation, problem.rate))
        run.advance(pieces, end)
        if run.code == STUCK:
            raise MethodRefused(
                f"the run needs more than {MOST_STEPS} steps: it got to {run.time:.6g} s of {min(end, shaking):.6g} s; "
                "give a shorter duration"
            )
        verdict, doubt = still_base_verdict(FULL_EQUATION, body, run.state, run.code)
        overturned: bool | None = verdict
        if (doubt or run.doubtful) and problem.tolerance > TIGHT:
            return self.solve(replace(problem, tolerance=TIGHT))
        if doubt or run.doubtful:
            overturned = _settled(body, pieces, end, problem.rotation, problem.rate, verdict)
        started = problem.rotation != 0.0 or problem.rate != 0.0
        return _solution(run, overturned, end, shaking, started=started)


def overturns(
    body: FloatArray, pieces: FloatArray, *, rotation: float = 0.0, angular_velocity: float = 0.0, end: float = math.inf
) -> bool | None:
    """Return whether the block overturns, None where one rounding of an input decides; no history is kept.

    `body` is from `parameters`; `end` cuts the pieces, s; the initial rotation (rad) and rate (rad/s) are signed.
    """
    verdict, doubt = _first_verdict(body, pieces, end, rotation, angular_velocity)
    return _settled(body, pieces, end, rotation, angular_velocity, verdict) if doubt else verdict


def _first_verdict(body: FloatArray, pieces: FloatArray, end: float, rotation: float, rate: float) -> tuple[bool, bool]:
    """Return whether the block overturns, and whether that has to be looked at again."""
    run = Run(body, initial_state(body, rotation, rate), record=False)
    run.advance(pieces, end)
    verdict, doubt = still_base_verdict(FULL_EQUATION, body, run.state, run.code)
    return verdict, doubt or run.doubtful


def _settled(
    body: FloatArray, pieces: FloatArray, end: float, rotation: float, rate: float, verdict: bool
) -> bool | None:
    def again(changed: FloatArray, shaken: FloatArray, theta: float, omega: float) -> bool:
        return _first_verdict(changed, shaken, end, theta, omega)[0]

    return settled(verdict, again, body, pieces, rotation, rate)


def _solution(run: Run, overturned: bool | None, end: float, shaking: float, *, started: bool) -> Solution:
    forced, lift, rest = sorted_events(run.events)
    uplift = 0.0 if started else lift
    state = run.state
    shaken_until = run.time
    fell = run.fallen
    after = free_stage(FULL_EQUATION, run.body, state, shaken_until if fell else end)
    overturning_time = shaken_until if fell else after.overturning_time
    resting = bool(state[SIDE] == 0.0)
    rest_time = rest if after.rest_time is None else after.rest_time
    impact_times, impact_rates = joined(forced, after.impacts)
    return Solution(
        uplift_time=uplift,
        impact_times=impact_times,
        impact_rates=impact_rates,
        rest_time=rest_time if resting and uplift is not None else None,
        overturning_time=overturning_time,
        side=int(state[SIDE]) if overturning_time is not None else 0,
        overturned=overturned,
        resting=resting,
        peak=float(state[PEAK]),
        error=ERROR_DEVIATIONS * run.worst_error,
        end_time=math.inf if resting or overturning_time is not None else min(end, max(run.time, shaking)),
        history=Stages(Steps(run.steps, float(run.body[1])), shaken_until, after),
    )
