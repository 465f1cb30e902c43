"""The whole study of a scene: free rocking, outcomes over tilt, amplitude and slenderness, perturbed initial states."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.errors import InputError
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import LINEARISED, NONLINEAR, QUASI_LINEAR
from twin.scene import Scene
from twin.sensitivity.case import Case, case_of
from twin.sensitivity.cloud import Cloud, cloud_of, default_rate_spread
from twin.sensitivity.free import FreeRocking, free_times, over_slenderness, over_tilt, release_ratio
from twin.sensitivity.outcomes import Difference, Panel, difference, has_closed_form, over_amplitude
from twin.sensitivity.outcomes import over_slenderness as outcomes_over_slenderness
from twin.sensitivity.pulses import LEFT, RIGHT

TILT_SPAN = 0.6
"""Panels reach from minus to plus this, in units of alpha."""
FACTORS = (0.4, 2.4)
"""Panels reach over these multiples of the scene's amplitude."""
SLENDER = (0.6, 1.6)
"""And over these multiples of its slenderness angle."""
RECORD_PIECES = 200
"""A pulse of more pieces is a record: the quasi-linear model would take minutes, and is left out."""
CELLS, RECORD_CELLS = 61, 13
DRAWS, RECORD_DRAWS = 1000, 200


@dataclass(frozen=True, slots=True)
class Settings:
    """How much is asked.

    Attributes
    ----------
    cells : int or None
        Rows, and columns, of a panel; None: 61, or 13 of a record.
    sparse : int
        Rows, and columns, of the quasi-linear panel where that model has no closed form and is stepped; 0: none.
    draws : int or None
        Perturbed initial states; None: 1000, or 200 of a record.
    tilt_spread : float or None
        One standard deviation, rad; None: the scene's `initial_tilt_spread_deg`.
    rate_spread : float or None
        rad/s; None: p times the spread of the tilt.
    seed : int
    """

    cells: int | None = None
    sparse: int = 7
    draws: int | None = None
    tilt_spread: float | None = None
    rate_spread: float | None = None
    seed: int = 1


USUAL = Settings()


@dataclass(frozen=True, slots=True)
class Forced:
    """The pulse's panels: by the nonlinear and linearised models everywhere, the quasi-linear where it is affordable.

    `sparse` is the quasi-linear panel over amplitude, and `sparse_truth` the nonlinear one on the same cells.
    """

    nonlinear: Panel
    linearised: Panel
    sparse: Panel | None
    sparse_truth: Panel | None
    slender: Panel
    slender_linearised: Panel

    @property
    def differences(self) -> list[Difference]:
        """Return the simpler models against the nonlinear one over tilt and amplitude."""
        found = [difference(LINEARISED, self.nonlinear, self.linearised)]
        if self.sparse is not None and self.sparse_truth is not None:
            found.append(difference(QUASI_LINEAR, self.sparse_truth, self.sparse))
        return found

    @property
    def slender_difference(self) -> Difference:
        """Return the linearised model against the nonlinear one over tilt and slenderness."""
        return difference(LINEARISED, self.slender, self.slender_linearised)

    def nearest_tilts(self, relative_tilt: float) -> tuple[float | None, float | None]:
        """Return the nearest tilts below and above, in alpha, of another outcome or direction at the scene's amplitude.

        To the grid's step; None where there is none in the panel.
        """
        panel = self.nonlinear
        row = panel.classes[int(np.argmin(np.abs(panel.others - 1.0)))]
        here = int(np.argmin(np.abs(panel.tilts - relative_tilt)))
        falls = np.where(np.isin(row, (LEFT, RIGHT)), row, 0)
        other = np.nonzero(falls != falls[here])[0]
        below, above = other[other < here], other[other > here]
        return (
            float(panel.tilts[below[-1]]) if below.size else None,
            float(panel.tilts[above[0]]) if above.size else None,
        )


@dataclass(frozen=True, slots=True)
class Study:
    """Everything that was found about a scene.

    `at` are the three models' times of first impact and rest, s, from `ratio` alpha.
    """

    scene: Scene
    case: Case
    ratio: float
    at: dict[str, tuple[float, float]]
    tilt: FreeRocking
    slenderness: FreeRocking
    forced: Forced | None
    cloud: Cloud


def study_scene(scene: Scene, settings: Settings = USUAL) -> Study:
    """Study a scene; its pulse is taken alone, unclipped, from the scene's tilt.

    Raises
    ------
    InputError
        Where a setting is out of range, or the scene's pulse cannot be made.
    """
    _check(settings)
    case = case_of(scene)
    ratio = release_ratio(case)
    spread = settings.tilt_spread
    if spread is None:
        spread = math.radians(scene.twin.initial_tilt_spread_deg)
    rate = default_rate_spread(case, spread) if settings.rate_spread is None else settings.rate_spread
    draws = settings.draws or (RECORD_DRAWS if _is_record(case) else DRAWS)
    released = Case(case.block, case.restitution, None, ratio * case.block.slenderness)
    return Study(
        scene,
        case,
        ratio,
        free_times(released),
        over_tilt(case),
        over_slenderness(case),
        None if case.pulse is None else _forced(case, settings),
        cloud_of(case, spread, rate, draws, settings.seed),
    )


def _forced(case: Case, settings: Settings) -> Forced:
    centre, cells = case.relative_tilt, _cells(case, settings)
    tilts = np.linspace(centre - TILT_SPAN, centre + TILT_SPAN, cells)
    # The tilts of a row include the scene's own, the rows its own amplitude.
    factors = _through(1.0, FACTORS, cells)
    alpha = case.block.slenderness
    alphas = _through(alpha, (SLENDER[0] * alpha, min(SLENDER[1] * alpha, 1.4)), cells)
    closed = has_closed_form(case)
    affordable = closed or (settings.sparse > 0 and not _is_record(case))
    every = slice(None) if closed else _thinned(cells, min(settings.sparse, cells))
    return Forced(
        nonlinear=over_amplitude(case, tilts, factors),
        linearised=over_amplitude(case, tilts, factors, LINEARISED),
        sparse=over_amplitude(case, tilts[every], factors[every], QUASI_LINEAR) if affordable else None,
        sparse_truth=over_amplitude(case, tilts[every], factors[every], NONLINEAR) if affordable else None,
        slender=outcomes_over_slenderness(case, tilts, alphas),
        slender_linearised=outcomes_over_slenderness(case, tilts, alphas, LINEARISED),
    )


def _cells(case: Case, settings: Settings) -> int:
    if settings.cells is not None:
        return settings.cells
    return RECORD_CELLS if _is_record(case) else CELLS


def _is_record(case: Case) -> bool:
    return case.pulse is not None and len(case.pulse.pieces) >= RECORD_PIECES


def _through(value: float, span: tuple[float, float], count: int) -> FloatArray:
    """Return `count` even steps over about `span`, one of them exactly `value`."""
    step = (span[1] - span[0]) / (count - 1)
    before = round((value - span[0]) / step)
    return value + step * (np.arange(count, dtype=np.float64) - before)


def _thinned(cells: int, wanted: int) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return about `wanted` even places of `cells`, the ends left out."""
    return np.unique(np.linspace(0, cells - 1, wanted + 2).round().astype(np.int64)[1:-1])


def _check(settings: Settings) -> None:
    if settings.cells is not None and not 5 <= settings.cells <= 1001:
        raise InputError(f"--cells is {settings.cells}; a panel has 5 to 1001 rows and columns")
    if settings.sparse < 0:
        raise InputError(f"--quasi-linear is {settings.sparse}; it must not be negative")
    if settings.draws is not None and not 10 <= settings.draws <= 1_000_000:
        raise InputError(f"--draws is {settings.draws}; it must be 10 to 1000000")
    if settings.seed < 0:
        raise InputError(f"--seed is {settings.seed}; it must not be negative")
    for name, spread in (("tilt", settings.tilt_spread), ("rate", settings.rate_spread)):
        if spread is not None and not (math.isfinite(spread) and spread >= 0.0):
            raise InputError(f"--{name}-spread is {spread:g}; it must be finite and not negative")
