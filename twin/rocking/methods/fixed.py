"""A run with steps of a fixed length, from Python."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import FELL, FULL, REACHED
from twin.rocking.methods.comparison import Track, begin, solution
from twin.rocking.methods.equations import centre, model_code, model_parameters
from twin.rocking.methods.fixed_march import FIXED_COLUMNS, NO_ANSWER, evaluate_fixed, fixed_march
from twin.rocking.methods.problem import MethodRefused, Problem, Solution
from twin.rocking.run import STILL_BASE
from twin.rocking.series import OMEGA
from twin.rocking.state import ALPHA, EVENT_COLUMNS, SIDE, TIME

DEFAULT_STEP = 1e-3
"""s: the thesis' own."""
MOST_STEPS = 2_000_000
LONGEST_SHARE = 0.5
"""A step above this, in 1/p or in 1/omega of the excitation, resolves nothing."""


@dataclass(frozen=True, slots=True)
class FixedSteps:
    """History of fixed steps: rows of `fixed_march`, a cubic in each."""

    rows: FloatArray
    p: float

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation and angular velocity at `times`."""
        rotation, rate = np.zeros_like(times), np.zeros_like(times)
        if self.rows.shape[0]:
            evaluate_fixed(self.rows, np.ascontiguousarray(times), self.p, rotation, rate)
        return rotation, rate


def solve_fixed(problem: Problem, name: str, scheme: int, order: float) -> Solution:
    """Return the answer of a scheme at the problem's step, compared with twice the step."""
    step = DEFAULT_STEP if problem.step is None else problem.step
    fastest = float(np.max(problem.pieces[:, OMEGA], initial=problem.block.frequency_parameter))
    longest = LONGEST_SHARE / fastest
    if step > longest:
        raise MethodRefused(f"{name} is asked for a step of {step:g} s; this scene needs {longest:.6g} s or less")
    refuse_endless(problem)
    fine = run_fixed(problem, name, scheme, step, 2)
    coarse = run_fixed(problem, name, scheme, 2.0 * step, 1)
    return solution(problem, fine, coarse, order)


def refuse_endless(problem: Problem) -> None:
    """Refuse a run that only a closed form could follow to its end."""
    if problem.eta == 1.0 and math.isinf(problem.end):
        raise MethodRefused("without loss at its impacts the block never rests; give a duration")


def run_fixed(problem: Problem, name: str, scheme: int, step: float, parts: int) -> Track:
    """Return one run at `step` s; see `fixed_march` for `parts`.

    Raises
    ------
    MethodRefused
        Where a step has no answer, or the run takes more than `MOST_STEPS`.
    """
    model = model_code(problem.model)
    body = model_parameters(problem)
    state = begin(problem, body, centre(model, float(body[ALPHA])))
    rows, events, used = np.empty((1024, FIXED_COLUMNS)), np.empty((64, EVENT_COLUMNS)), np.zeros(2)
    code = REACHED

    def advance(piece: FloatArray, until: float) -> int:
        nonlocal rows, events
        while True:
            code = fixed_march(scheme, model, body, state, piece, until, step, parts, rows, events, used)
            if code != FULL:
                break
            if len(rows) >= MOST_STEPS:
                raise MethodRefused(
                    f"{name} needs more than {MOST_STEPS} steps of {step:g} s: it got to {state[TIME]:.6g} s; "
                    "give a shorter duration"
                )
            rows = np.concatenate([rows, np.empty_like(rows)])
            events = np.concatenate([events, np.empty_like(events)])
        if code == NO_ANSWER:
            raise MethodRefused(
                f"a step of {name} at {state[TIME]:.6g} s has no answer; give one shorter than {step:g} s"
            )
        return code

    for piece in problem.pieces:
        if float(piece[0]) >= problem.end or code != REACHED:
            break
        code = advance(piece, min(float(piece[1]), problem.end))
    standing, fallen_before = state.copy(), code == FELL
    if code == REACHED and problem.end > problem.shaking and state[SIDE] != 0.0:
        code = advance(STILL_BASE[0], problem.end)
    history = FixedSteps(rows[: int(used[0])], float(body[1]))
    return Track(model, body, standing, fallen_before, state, code == FELL, events[: int(used[1])], history)
