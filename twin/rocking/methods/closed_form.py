"""Closed forms: linear equations piece by piece, the nonlinear one where nothing is forced.

* linearised: any pieces (constant, ramp, harmonic of any phase), from rest, from uplift or from a tilt;
* quasi-linear: pieces of constant acceleration, free rocking, and the free stage after them;
* nonlinear: free rocking, by elliptic integrals and functions.

Source: N. Ceh, doctoral thesis, Rijeka 2018, chapter 3; G. W. Housner, Bull. Seism. Soc. Am. 53(2), 1963. The contact
is found as a root of the closed form, with a bound that cannot jump one (`segment`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import FELL, FULL, REACHED, STUCK
from twin.rocking.methods.after import Stages, free_stage, joined
from twin.rocking.methods.equations import model_code, model_parameters
from twin.rocking.methods.judgement import sorted_events, still_base_verdict
from twin.rocking.methods.linear_march import linear_march
from twin.rocking.methods.problem import LINEARISED, MODELS, NONLINEAR, QUASI_LINEAR, MethodRefused, Problem, Solution
from twin.rocking.methods.rounding import settled
from twin.rocking.methods.segment import COLUMNS, evaluate_rows
from twin.rocking.run import initial_state
from twin.rocking.series import AMPLITUDE, C1, T0, T1
from twin.rocking.state import ALPHA, DOUBT, EVENT_COLUMNS, PEAK, PSI, SIDE, TIME, WORST

MOST_ROWS = 400_000


@dataclass(frozen=True, slots=True)
class Stretches:
    """History of a linear block on a moving base: rows of `segment`."""

    rows: FloatArray
    p: float

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation and angular velocity at `times`."""
        rotation, rate = np.zeros_like(times), np.zeros_like(times)
        if self.rows.shape[0]:
            evaluate_rows(self.rows, np.ascontiguousarray(times), self.p, rotation, rate)
        return rotation, rate


class _Linear:
    """One forced run: state, rows and events."""

    def __init__(self, model: int, body: FloatArray, rotation: float, rate: float) -> None:
        self.model, self.body = model, body
        self.state = initial_state(body, rotation, rate)
        self.state[PSI] = (math.tan(body[ALPHA]) if model == 1 else body[ALPHA]) - abs(rotation)
        self.code = REACHED
        self._rows = np.empty((64, COLUMNS))
        self._events = np.empty((64, EVENT_COLUMNS))
        self._used = np.zeros(2)

    @property
    def rows(self) -> FloatArray:
        return self._rows[: int(self._used[0])]

    @property
    def events(self) -> FloatArray:
        return self._events[: int(self._used[1])]

    def advance(self, pieces: FloatArray, end: float) -> None:
        for piece in pieces:
            if piece[T0] >= end or self.code != REACHED:
                return
            self.code = FULL
            while self.code == FULL:
                until = min(float(piece[T1]), end)
                self.code = linear_march(
                    self.model, self.body, self.state, piece, until, self._rows, self._events, self._used
                )
                if self.code == FULL:
                    if len(self._rows) >= MOST_ROWS:
                        self.code = STUCK
                        return
                    self._rows = np.concatenate([self._rows, np.empty_like(self._rows)])
                    self._events = np.concatenate([self._events, np.empty_like(self._events)])

    def verdict(self) -> tuple[bool, bool]:
        """Return whether the block overturns on a base that stays still from now on, and whether rounding decides."""
        falls, doubt = still_base_verdict(self.model, self.body, self.state, self.code)
        return falls, doubt or bool(self.state[DOUBT])


@dataclass(frozen=True, slots=True)
class ClosedForm:
    """See the module."""

    name: str = "closed-form"
    models: tuple[str, ...] = MODELS
    source: str = "Ceh 2018, chapter 3; Housner 1963; Byrd & Friedman 1971"

    def solve(self, problem: Problem) -> Solution:
        """Return the answer; refuses where the model has no closed form for the excitation."""
        pieces, end = problem.pieces, problem.end
        _refuse(problem)
        model = model_code(problem.model)
        body = model_parameters(problem)
        run = _Linear(model, body, problem.rotation, problem.rate)
        run.advance(pieces, end)
        if run.code == STUCK:
            raise MethodRefused(
                f"the run needs more than {MOST_ROWS} stretches: it got to {run.state[TIME]:.6g} s; "
                "give a shorter duration"
            )
        verdict, doubt = run.verdict()
        overturned: bool | None = verdict
        if doubt:

            def again(changed: FloatArray, shaken: FloatArray, theta: float, omega: float) -> bool:
                other = _Linear(model, changed, theta, omega)
                other.advance(shaken, end)
                return other.verdict()[0]

            overturned = settled(verdict, again, body, pieces, problem.rotation, problem.rate)
        return _solution(problem, run, overturned)


def _refuse(problem: Problem) -> None:
    if problem.model == NONLINEAR and np.any(problem.pieces[:, 2:5]):
        raise MethodRefused("the nonlinear equation has no closed form on a moving base; closed-form solves it free")
    if problem.model == QUASI_LINEAR and np.any(problem.pieces[:, (C1, AMPLITUDE)]):
        raise MethodRefused(
            "the quasi-linear equation has a closed form under constant accelerations only; "
            f"the {LINEARISED} one under any pulse"
        )


def _solution(problem: Problem, run: _Linear, overturned: bool | None) -> Solution:
    forced, lift, rest = sorted_events(run.events)
    started = problem.rotation != 0.0 or problem.rate != 0.0
    uplift = 0.0 if started else lift
    shaken_until = float(run.state[TIME])
    fallen = run.code == FELL
    side = int(run.state[SIDE]) if fallen else 0
    after = free_stage(run.model, run.body, run.state, shaken_until if fallen else problem.end)
    resting = not fallen and bool(run.state[SIDE] == 0.0)
    rest_time = rest if after.rest_time is None else after.rest_time
    impact_times, impact_rates = joined(forced, after.impacts)
    lying = shaken_until if fallen else after.overturning_time
    if after.overturning_time is not None:
        side = int(run.state[SIDE])
    return Solution(
        uplift_time=uplift,
        impact_times=impact_times,
        impact_rates=impact_rates,
        rest_time=rest_time if resting and uplift is not None else None,
        overturning_time=lying,
        side=side,
        overturned=overturned,
        resting=resting,
        peak=float(run.state[PEAK]),
        error=8.0 * float(run.state[WORST]),
        end_time=math.inf if resting or lying is not None else float(run.state[TIME]),
        history=Stages(Stretches(run.rows, float(run.body[1])), shaken_until, after),
    )
