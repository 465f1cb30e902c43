"""Free rocking in the three models: the first quarter period and the time to rest, over tilt and over slenderness."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import LINEARISED, MODELS, NONLINEAR, QUASI_LINEAR, MethodRefused
from twin.sensitivity.case import Case

SIMPLER = (LINEARISED, QUASI_LINEAR)
TILTS = np.linspace(0.02, 0.98, 49)
"""In units of alpha."""
SLENDERNESSES = np.linspace(0.03, 0.75, 49)
"""rad: from a pole to a block nearly as wide as high."""
HALF_WAY = 0.5
"""Tilt at which the slenderness is varied, in units of alpha, unless the scene has one."""


@dataclass(frozen=True, slots=True)
class FreeRocking:
    """Times of free rocking from rest at a tilt, of each model.

    Attributes
    ----------
    at : ndarray, shape (n,)
        Tilt in units of alpha, or slenderness alpha, rad.
    quarters, rests : dict of str to ndarray, shape (n,)
        Model -> time of the first impact, and of rest, s; nan where the model refuses or the block falls.
    """

    at: FloatArray
    quarters: dict[str, FloatArray]
    rests: dict[str, FloatArray]

    def quarter_errors(self, model: str) -> FloatArray:
        """Return the relative error of a model's first quarter period against the nonlinear one."""
        return self.quarters[model] / self.quarters[NONLINEAR] - 1.0

    def rest_errors(self, model: str) -> FloatArray:
        """Return the relative error of a model's time to rest against the nonlinear one."""
        return self.rests[model] / self.rests[NONLINEAR] - 1.0

    def reaches(self, model: str, allowed: float) -> float | None:
        """Return the last place up to which a model's first quarter stays within `allowed`, None if nowhere."""
        outside = np.nonzero(~(np.abs(self.quarter_errors(model)) <= allowed))[0]
        within = int(outside[0]) if outside.size else len(self.at)
        return float(self.at[within - 1]) if within else None


def over_tilt(case: Case) -> FreeRocking:
    """Return the block let go from ever larger tilts."""
    alpha = case.block.slenderness
    return _times(TILTS, (replace(case, tilt=ratio * alpha) for ratio in TILTS))


def over_slenderness(case: Case) -> FreeRocking:
    """Return blocks of the same diagonal, ever bulkier, let go from the same share of alpha."""
    start = replace(case, tilt=release_ratio(case) * case.block.slenderness)
    return _times(SLENDERNESSES, map(start.of_slenderness, map(float, SLENDERNESSES)))


def release_ratio(case: Case) -> float:
    """Return the tilt, in units of alpha, at which slendernesses are compared: the scene's where it has one."""
    ratio = abs(case.relative_tilt)
    return ratio if 0.0 < ratio < 1.0 else HALF_WAY


def free_times(case: Case) -> dict[str, tuple[float, float]]:
    """Return model -> time of first impact and of rest, s, of a case without its pulse; nan where there is none."""
    free = replace(case, pulse=None)
    return {model: _free(free, model) for model in MODELS}


def _times(at: FloatArray, cases: Iterable[Case]) -> FreeRocking:
    found = [free_times(case) for case in cases]
    quarters = {model: np.array([times[model][0] for times in found]) for model in MODELS}
    return FreeRocking(at, quarters, {model: np.array([times[model][1] for times in found]) for model in MODELS})


def _free(case: Case, model: str) -> tuple[float, float]:
    try:
        response = case.response(model)
    except MethodRefused:
        return math.nan, math.nan
    if not len(response.impact_times) or response.rest_time is None:
        return math.nan, math.nan
    return float(response.impact_times[0]), response.rest_time
