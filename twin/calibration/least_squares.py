"""The unknowns of a course that its samples say best: least squares after Levenberg and Marquardt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.calibration.course import (
    OTHERS,
    BoolArray,
    Flights,
    Modelled,
    course,
    normal_equations,
    possible,
)
from twin.rocking_data.noise import FloatArray

ITERATIONS = 60
FIRST_DAMPING, LEAST_DAMPING, MOST_DAMPING = 1e-3, 1e-9, 1e9
CONVERGED = 1e-4
"""Steps end where one would lower the sum of squares, in units of the noise's variance, by less than this."""
ZERO_SPREAD = 0.02
"""What is known of the sensor's zero before, one standard deviation, rad: only where the samples say nothing of it."""


@dataclass(frozen=True, eq=False)
class Known:
    """What is known of slenderness and frequency parameter before.

    Attributes
    ----------
    values : ndarray, shape (2,)
        ln alpha and ln p, p in rad/s.
    spreads : ndarray, shape (2,)
        One standard deviation of each: 0 where it is fixed, infinite where nothing is known.
    """

    values: FloatArray
    spreads: FloatArray

    @classmethod
    def nothing(cls) -> Known:
        """Nothing is known."""
        return cls(np.zeros(2), np.full(2, np.inf))

    @property
    def fixed(self) -> BoolArray:
        """Which of them are."""
        return self.spreads == 0.0

    @property
    def weights(self) -> FloatArray:
        """Inverse variances; 0 for a fixed one."""
        with np.errstate(divide="ignore"):
            return np.where(self.fixed, 0.0, self.spreads**-2.0)


@dataclass(frozen=True, eq=False)
class Adjusted:
    """The answer.

    Attributes
    ----------
    x : ndarray, shape (n,)
        Instants, s, then `OTHERS`.
    normal : ndarray, shape (n, n)
        J^T J over the noise's variance, with what was known before; rows of fixed unknowns are those of 1.
    squares : float
        Sum of squared residuals over the noise's variance, and of deviations from what was known.
    modelled : Modelled
    misfit : ndarray, shape (m,)
        Measured minus modelled, rad, of all samples, kept or not.
    kept : ndarray of bool
    free : ndarray of bool, shape (n,)
    converged : bool
    """

    x: FloatArray
    normal: FloatArray
    squares: float
    modelled: Modelled
    misfit: FloatArray
    kept: BoolArray
    free: BoolArray
    converged: bool

    @property
    def covariance(self) -> FloatArray:
        """Inverse of `normal`; rows and columns of fixed unknowns are 0."""
        scale = 1.0 / np.sqrt(np.diagonal(self.normal))
        inverse = np.linalg.pinv(self.normal * scale[:, None] * scale[None, :], hermitian=True)
        both = self.free[:, None] & self.free[None, :]
        return np.where(both, inverse * scale[:, None] * scale[None, :], 0.0)


def adjust(flights: Flights, start: FloatArray, noise: float, known: Known, kept: BoolArray | None = None) -> Adjusted:
    """Return the unknowns with the least sum of squares near `start`, which must be `possible`."""
    chosen = np.ones(flights.time.size, dtype=np.bool_) if kept is None else kept
    others = slice(flights.instants, flights.instants + 2)
    free = np.ones(start.size, dtype=np.bool_)
    free[others] = ~known.fixed
    prior = np.zeros(start.size)
    prior[others] = known.weights
    prior[flights.instants + OTHERS - 1] = ZERO_SPREAD**-2.0
    goal = np.zeros(start.size)
    goal[others] = known.values
    x = start.copy()
    x[others] = np.where(known.fixed, known.values, x[others])
    damping = FIRST_DAMPING
    modelled = course(flights, x)
    misfit = flights.rotation - modelled.rotation
    squares = _squares(misfit, chosen, noise, prior, goal - x)
    normal, right = _equations(flights, modelled, misfit, chosen, noise, prior, goal - x, free)
    converged = False
    for _ in range(ITERATIONS):
        step = _solved(normal, right, damping)
        # What the linear model promises: s (J^T r) - s N s / 2, twice that for the sum of squares.
        gain = float(2.0 * step @ right - step @ normal @ step)
        trial = x + step
        new = course(flights, trial) if possible(flights, trial) else None
        rest = misfit if new is None else flights.rotation - new.rotation
        better = np.inf if new is None else _squares(rest, chosen, noise, prior, goal - trial)
        if new is not None and better <= squares:
            x, modelled, misfit = trial, new, rest
            converged = squares - better <= CONVERGED and gain <= CONVERGED
            squares = better
            normal, right = _equations(flights, modelled, misfit, chosen, noise, prior, goal - x, free)
            damping = max(0.1 * damping, LEAST_DAMPING)
        else:
            converged = gain <= CONVERGED
            damping *= 10.0
        if converged or damping > MOST_DAMPING:
            break
    return Adjusted(x, normal, squares, modelled, misfit, chosen, free, converged)


def _squares(misfit: FloatArray, kept: BoolArray, noise: float, prior: FloatArray, off: FloatArray) -> float:
    return float(np.sum(misfit[kept] ** 2) / noise**2 + np.sum(prior * off**2))


def _equations(
    flights: Flights,
    modelled: Modelled,
    misfit: FloatArray,
    kept: BoolArray,
    noise: float,
    prior: FloatArray,
    off: FloatArray,
    free: BoolArray,
) -> tuple[FloatArray, FloatArray]:
    normal, right = normal_equations(flights, modelled.slope, misfit, kept)
    normal, right = normal / noise**2 + np.diag(prior), right / noise**2 + prior * off
    both = free[:, None] & free[None, :]
    return np.where(both, normal, np.eye(free.size)), np.where(free, right, 0.0)


def _solved(normal: FloatArray, right: FloatArray, damping: float) -> FloatArray:
    diagonal = np.maximum(np.diagonal(normal), 1e-300)
    scale = 1.0 / np.sqrt(diagonal)
    damped = normal * scale[:, None] * scale[None, :] + damping * np.eye(right.size)
    try:
        solved = np.linalg.solve(damped, right * scale)
    except np.linalg.LinAlgError:
        solved = np.linalg.lstsq(damped, right * scale)[0]
    return np.asarray(solved * scale, dtype=np.float64)
