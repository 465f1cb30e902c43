"""Restitution from fitted flights: at each impact, and overall where impacts scatter more than the noise explains."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from twin.calibration.course import halves
from twin.calibration.fit import Fit
from twin.calibration.flight import shape_of
from twin.rocking_data.noise import FloatArray

USUAL_SCATTER = 0.005
"""How much restitution scatters from impact to impact, relative, before the recording says it."""
LARGEST_SCATTER = 0.1
"""End of what is tried, unless the ratios themselves scatter more."""
GRID = 60
TINY = 1e-18
"""Added to variances: covariance matrices are all but singular where the noise is all but nothing."""
BISECTIONS = 60
REACH = 50.0
"""An interval of a logarithm ends here."""


@dataclass(frozen=True, eq=False)
class Ratios:
    """Restitution at each impact between two fitted flights.

    Attributes
    ----------
    time : ndarray, shape (n,)
        s.
    rate : ndarray
        |Angular velocity| before it, rad/s.
    direction : ndarray of int
        +1 where the block goes on to positive rotations.
    ratio, error : ndarray
        Ratio of angular velocities, and its standard deviation.
    logarithm : ndarray
        ln of the ratio.
    covariance : ndarray, shape (n, n)
        Of the logarithms.
    with_unknowns : ndarray, shape (n, m)
        Covariance of the logarithms with the unknowns of the fit.
    """

    time: FloatArray
    rate: FloatArray
    direction: FloatArray
    ratio: FloatArray
    error: FloatArray
    logarithm: FloatArray
    covariance: FloatArray
    with_unknowns: FloatArray


@dataclass(frozen=True, eq=False)
class Overall:
    """Restitution of all impacts together.

    Attributes
    ----------
    value, error, low, high : float
        Ratio, its standard deviation, and its 95 % interval.
    scatter, scatter_error : float
        Standard deviation of single impacts about it beyond the noise, relative, and its own.
    weights : ndarray, shape (n,)
        Of the impacts' logarithms.
    quantile : float
        Half width of its interval, in deviations.
    trend, trend_error : float
        Change of ln(restitution) when the rate before the impact grows e-fold; NaN with fewer than four impacts.
    """

    value: float
    error: float
    low: float
    high: float
    scatter: float
    scatter_error: float
    weights: FloatArray
    quantile: float
    trend: float
    trend_error: float


def energy_slopes(fit: Fit) -> tuple[FloatArray, FloatArray]:
    """Return ln E of each flight, E = v^2 at its contacts in units of p^2, and its derivatives by the unknowns."""
    flights, x = fit.flights, fit.adjusted.x
    half, _ = halves(flights, x)
    long = fit.p * half
    shape = shape_of(long, fit.alpha)
    energy = shape.speed**2
    # E = 2 (cos psi0 - cos alpha), d psi0 = (d alpha - v dU) / Y
    sine = np.sin(shape.valley)
    by_half = 2.0 * sine * shape.speed / shape.growth / energy
    by_alpha = 2.0 * (math.sin(fit.alpha) - sine / shape.growth) / energy
    slopes = np.zeros((half.size, x.size))
    rows = np.arange(half.size)
    of_half = np.full(half.size, 0.5)
    if flights.entry:
        of_half[0] = 1.0
    slopes[rows, flights.left] = -by_half * fit.p * of_half
    slopes[rows, flights.right] = by_half * fit.p * of_half
    slopes[:, flights.instants] = by_alpha * fit.alpha
    slopes[:, flights.instants + 1] = by_half * long
    return np.log(energy), slopes


def ratios(fit: Fit) -> Ratios:
    """Return the restitution at each impact between two neighbouring flights of the fit."""
    energy, slopes = energy_slopes(fit)
    flights = fit.flights
    before = np.flatnonzero(flights.right[:-1] == flights.left[1:])
    logarithm = 0.5 * (energy[before + 1] - energy[before])
    slope = 0.5 * (slopes[before + 1] - slopes[before])
    with_unknowns = slope @ fit.covariance
    covariance = with_unknowns @ slope.T
    ratio = np.exp(logarithm)
    return Ratios(
        time=fit.adjusted.x[flights.right[before]],
        rate=fit.p * np.exp(0.5 * energy[before]),
        direction=flights.side[before + 1].astype(np.float64),
        ratio=ratio,
        error=ratio * np.sqrt(np.maximum(np.diagonal(covariance), 0.0)),
        logarithm=logarithm,
        covariance=covariance,
        with_unknowns=with_unknowns,
    )


def overall(found: Ratios) -> Overall:
    """Return the restitution of all impacts: that of a further impact of this block, on average.

    Each logarithm is mu + scatter + noise, the noise with its full covariance (neighbours share a flight). How large
    the scatter is the impacts say only roughly, so that mu is averaged over it: restricted likelihood times `_prior`
    (A. Gelman, Bayesian Analysis 1, 2006). Its interval is that of the mixture.
    """
    y, count = found.logarithm, found.logarithm.size
    grid = np.concatenate([[0.0], np.geomspace(1e-5, max(LARGEST_SCATTER, 3.0 * float(np.std(y))), GRID)])
    means, variances, chances = np.zeros(grid.size), np.zeros(grid.size), np.zeros(grid.size)
    rows = np.zeros((grid.size, count))
    values, vectors = np.linalg.eigh(found.covariance)
    ones, turned = vectors.T @ np.ones(count), vectors.T @ y
    for k, scatter in enumerate(grid.tolist()):
        total = np.maximum(values, 0.0) + scatter**2 + TINY
        information = float(np.sum(ones**2 / total))
        means[k] = float(np.sum(ones * turned / total)) / information
        variances[k] = 1.0 / information
        rows[k] = vectors @ (ones / total) / information
        off = turned - ones * means[k]
        chances[k] = -0.5 * float(np.sum(off**2 / total) + np.sum(np.log(total)) + math.log(information))
    chances = np.exp(chances - np.max(chances)) * _prior(grid) * np.gradient(grid)
    chances /= np.sum(chances)
    mean = float(chances @ means)
    error = math.sqrt(float(chances @ (variances + (means - mean) ** 2)))
    low, high = (_quantile(part, means, np.sqrt(variances), chances) for part in (0.025, 0.975))
    weights = chances @ rows
    scatter = float(chances @ grid)
    spread = math.sqrt(max(float(chances @ grid**2) - scatter**2, 0.0))
    value = math.exp(mean)
    trend, trend_error = _trend(found, found.covariance + (scatter**2 + TINY) * np.eye(count))
    quantile = 0.5 * (high - low) / error
    return Overall(
        value,
        value * error,
        math.exp(max(low, -REACH)),
        math.exp(min(high, REACH)),
        scatter,
        spread,
        weights,
        quantile,
        trend,
        trend_error,
    )


def _prior(scatter: FloatArray) -> FloatArray:
    """Return the density of the scatter before: half of Student's, four degrees of freedom, scale `USUAL_SCATTER`."""
    return (1.0 + (scatter / USUAL_SCATTER) ** 2 / 4.0) ** -2.5


def _quantile(part: float, means: FloatArray, errors: FloatArray, chances: FloatArray) -> float:
    """Return the quantile of a mixture of normal variables, by bisection."""
    low, high = float(np.min(means - 40.0 * errors)), float(np.max(means + 40.0 * errors))
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        below = float(chances @ ndtr((middle - means) / errors))
        low, high = (middle, high) if below < part else (low, middle)
    return 0.5 * (low + high)


def _trend(found: Ratios, total: FloatArray) -> tuple[float, float]:
    if found.logarithm.size < 4:
        return math.nan, math.nan
    columns = np.stack([np.ones(found.rate.size), np.log(found.rate)], axis=1)
    solved = np.linalg.solve(total, columns)
    inverse = np.linalg.pinv(columns.T @ solved)
    return float((inverse @ (solved.T @ found.logarithm))[1]), math.sqrt(max(float(inverse[1, 1]), 0.0))
