"""Outcome and direction of overturning over tilt and amplitude, and over tilt and slenderness, in each model."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import NONLINEAR
from twin.sensitivity.case import Case
from twin.sensitivity.pulses import LEFT, REFUSED, RIGHT, UNDECIDED, Classes, Counts, row_of, scaled

UNIT = np.ones(1)


@dataclass(frozen=True, slots=True)
class Panel:
    """One model's answers over initial tilt and something else.

    Attributes
    ----------
    tilts : ndarray, shape (m,)
        In units of alpha, signed.
    others : ndarray, shape (n,)
        Factors on the scene's amplitude, or slendernesses alpha, rad.
    classes : ndarray of uint8, shape (n, m)
        See `pulses`.
    impacts : ndarray of int32, shape (n, m)
        Before overturning.
    """

    tilts: FloatArray
    others: FloatArray
    classes: Classes
    impacts: Counts

    def count(self, *wanted: int) -> int:
        """Return the number of cells of these classes."""
        return int(np.count_nonzero(np.isin(self.classes, wanted)))


@dataclass(frozen=True, slots=True)
class Difference:
    """A simpler model's panel against the nonlinear one on the same cells.

    `outcome` and `direction` count the cells where it says another outcome (falls or not), and falls to the other side;
    `compared` those where both decide, `refused` those where it gives no answer.
    """

    model: str
    compared: int
    outcome: int
    direction: int
    refused: int


def fell(classes: Classes) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
    """Return where the block overturns."""
    return (classes == LEFT) | (classes == RIGHT)


def other_outcomes(
    truth: Classes, simpler: Classes
) -> tuple[np.ndarray[tuple[int, ...], np.dtype[np.bool_]], np.ndarray[tuple[int, ...], np.dtype[np.bool_]]]:
    """Return where a simpler model says another outcome, and where it says another direction of the same fall."""
    both = ~(np.isin(truth, (UNDECIDED, REFUSED)) | np.isin(simpler, (UNDECIDED, REFUSED)))
    outcome = both & (fell(truth) != fell(simpler))
    return outcome, both & fell(truth) & fell(simpler) & (truth != simpler)


def difference(model: str, truth: Panel, simpler: Panel) -> Difference:
    """Count where a simpler model differs."""
    outcome, direction = other_outcomes(truth.classes, simpler.classes)
    both = ~(np.isin(truth.classes, (UNDECIDED, REFUSED)) | np.isin(simpler.classes, (UNDECIDED, REFUSED)))
    return Difference(model, int(np.sum(both)), int(np.sum(outcome)), int(np.sum(direction)), simpler.count(REFUSED))


def over_amplitude(case: Case, tilts: FloatArray, factors: FloatArray, model: str = NONLINEAR) -> Panel:
    """Return the answers over tilts (in alpha) and factors on the amplitude."""
    alpha, grid = case.block.slenderness, scaled(case, factors)
    return _panel(tilts, factors, lambda tilt: row_of(case, grid, tilt * alpha, model))


def over_slenderness(case: Case, tilts: FloatArray, alphas: FloatArray, model: str = NONLINEAR) -> Panel:
    """Return the answers over tilts (in alpha) and slendernesses (rad), at the scene's amplitude and diagonal."""
    cases = [case.of_slenderness(float(alpha)) for alpha in alphas]
    grids = [scaled(one, UNIT) for one in cases]

    def column(tilt: float) -> tuple[Classes, Counts]:
        found = [row_of(one, grid, tilt * one.block.slenderness, model) for one, grid in zip(cases, grids, strict=True)]
        return np.concatenate([cells for cells, _ in found]), np.concatenate([hits for _, hits in found])

    return _panel(tilts, alphas, column)


def _panel(tilts: FloatArray, others: FloatArray, column: Callable[[float], tuple[Classes, Counts]]) -> Panel:
    with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="sensitivity") as pool:
        found = list(pool.map(column, map(float, tilts)))
    return Panel(
        tilts, others, np.stack([cells for cells, _ in found], axis=1), np.stack([hits for _, hits in found], axis=1)
    )


def has_closed_form(case: Case) -> bool:
    """Tell whether the quasi-linear model answers the case's pulse without stepping: constant accelerations only."""
    return case.pulse is None or not np.any(case.pulse.pieces[:, 3:5])
