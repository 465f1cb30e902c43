"""The solvers of the chart: our methods over their settings, and the peers that are installed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from twin.chart.task import Answer, Task
from twin.rocking.compiled import FloatArray
from twin.rocking.methods import METHODS, NONLINEAR
from twin.rocking.response import Outcome, Response
from twin.simulation import simulate

TOLERANCE, STEP, NONE = "tolerance", "step", ""
MODEL_TOLERANCE = 0.01
"""Relative error the simpler models are judged by, and "auto" is asked for: the default of `simulate`."""
TOLERANCE_ASKED = 1e-10
"""Error of the rotation asked for where a setting says nothing else, rad: the default of `simulate`."""

Run = Callable[[Task, float | None], Answer]


@dataclass(frozen=True, slots=True)
class Solver:
    """One column of the chart.

    Attributes
    ----------
    name : str
    run : callable
        (task, setting) -> answer; raises `ValueError` where it refuses. None as setting: its default.
    knob : str
        "tolerance" (rad), "step" (s) or "": what a setting is.
    settings : tuple of float
        The range for one trajectory; none where there is no knob.
    quick : tuple of float
        Fewer of them, for a quick chart.
    relative : float
        Share of an answer by which a simpler model may be off; 0 for the nonlinear equation.
    peer : bool
        Somebody else's code: it tells neither when the block comes to rest nor its peak.
    """

    name: str
    run: Run
    knob: str = NONE
    settings: tuple[float, ...] = ()
    quick: tuple[float, ...] = ()
    relative: float = 0.0
    peer: bool = False


_TOLERANCES = (1e-3, 1e-5, 1e-7, 1e-9, 1e-11, 1e-13)
_FEW_TOLERANCES = (1e-4, 1e-7, 1e-10, 1e-13)
_STEPS = (1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5)
_FEW_STEPS = (5e-3, 1e-3, 2e-4)
_STEPPED = ("newmark", "rk4")


def own_solvers() -> list[Solver]:
    """Return our methods, then the simpler models and "auto"."""
    solvers: list[Solver] = []
    for name in METHODS:
        run = partial(_ours, method=name)
        if name == "closed-form":
            solvers.append(Solver(name, run))
        elif name in _STEPPED:
            solvers.append(Solver(name, run, STEP, _STEPS, _FEW_STEPS))
        else:
            slow = name == "dop853"
            many, few = (_FEW_TOLERANCES, _FEW_TOLERANCES[::2]) if slow else (_TOLERANCES, _FEW_TOLERANCES)
            solvers.append(Solver(name, run, TOLERANCE, many, few))
    for model in ("linearised", "quasi-linear", "auto"):
        run = partial(_ours, method=None, model=model)
        solvers.append(Solver(f"model {model}", run, relative=MODEL_TOLERANCE))
    return solvers


def _ours(task: Task, setting: float | None, *, method: str | None, model: str = NONLINEAR) -> Answer:
    stepped = method in _STEPPED
    response = simulate(
        task.block,
        task.pulse,
        restitution=task.restitution,
        initial_rotation=task.rotation,
        initial_angular_velocity=task.rate,
        duration=task.duration,
        tolerance=TOLERANCE_ASKED if setting is None or stepped else setting,
        step=setting if stepped else None,
        method=method,
        model=model,
    )
    return as_answer(response)


def as_answer(response: Response) -> Answer:
    """Return what the chart looks at in a response of `simulate`."""
    outcome = response.outcome

    def rotation(times: FloatArray) -> FloatArray:
        return np.asarray(response.rotation(times))

    return Answer(
        uplift=response.uplift_time,
        impacts=response.impact_times,
        rates=response.impact_rates,
        rest=response.rest_time,
        overturning=response.overturning_time,
        overturned=None if outcome is Outcome.UNDECIDED else outcome is Outcome.OVERTURNED,
        peak=response.peak_rotation,
        stated=max(response.rotation_error, TOLERANCE_ASKED),
        end=response.end_time,
        rotation=rotation,
    )
