"""Calibrate a block from its free rocking: restitution, slenderness, frequency parameter, tilt, with their errors."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.calibration.course import halves
from twin.calibration.estimate import Estimate
from twin.calibration.fit import Fit, fit_free_rocking
from twin.calibration.flight import shape_of
from twin.calibration.least_squares import Known
from twin.calibration.restitution import Overall, Ratios, overall, ratios
from twin.calibration.suspicion import Suspicion, suspicions
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking_data.noise import FloatArray

RESTITUTION, K, SLENDERNESS, FREQUENCY = "restitution", "k", "slenderness", "frequency parameter"
TILT, ZERO, STIFFNESS = "initial tilt", "zero", "p2 sin alpha"
WIDTH, HEIGHT = "width", "height"
"""Names of the estimates."""
OPEN = 0.5
"""A slenderness less certain than this, relative, is none."""


@dataclass(frozen=True, eq=False)
class Calibration:
    """A block as its free rocking says it is.

    Attributes
    ----------
    fit : Fit
    restitution : Ratios
        Impact by impact.
    overall : Overall
    estimates : dict of str to Estimate
        "restitution", "k" (of the improved formula), "slenderness" (rad), "frequency parameter" (rad/s),
        "p2 sin alpha" (1/s2), "zero" (what the sensor reads at rest, rad), "width" and "height" (of the homogeneous
        block of that slenderness and frequency parameter, m); "initial tilt" (peak of the first flight, signed, rad)
        where that was seen.
    correlation : float
        Of slenderness and frequency parameter; NaN where one is fixed.
    suspicions : tuple of Suspicion
        What speaks against pure rocking.
    nominal : Block or None
        Geometry given.
    gravity : float
        m/s2.
    """

    fit: Fit
    restitution: Ratios
    overall: Overall
    estimates: dict[str, Estimate]
    correlation: float
    suspicions: tuple[Suspicion, ...]
    nominal: Block | None
    gravity: float

    @property
    def housner(self) -> Estimate:
        """Housner's restitution, 1 - 3/2 sin2(alpha), of the slenderness found."""
        alpha = self.estimates[SLENDERNESS]
        value = max(0.0, 1.0 - 1.5 * math.sin(alpha.value) ** 2)
        return Estimate.plain(value, 1.5 * math.sin(2.0 * alpha.value) * alpha.error)


def calibrate(
    time: FloatArray,
    rotation: FloatArray,
    *,
    nominal: Block | None = None,
    spread: float | None = None,
    fixed: frozenset[str] = frozenset(),
    gravity: float = 9.81,
) -> Calibration:
    """Calibrate a block from its free rocking.

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        s, increasing; rad, NaN where missing. The base stands still throughout.
    nominal : Block, optional
        Geometry as measured: where the search begins; what is known before with `spread`; what is kept with `fixed`.
    spread : float, optional
        Standard deviation of the nominal slenderness and frequency parameter, relative, above 0.
    fixed : set of str
        "slenderness", "frequency": taken from `nominal` as they are.
    gravity : float
        m/s2.

    Raises
    ------
    InputError
        There is nothing to calibrate from, in one sentence.
    """
    known = Known.nothing()
    if nominal is not None:
        start = np.log([nominal.slenderness, nominal.frequency_parameter])
        wide = np.inf if spread is None else spread
        spreads = np.array([0.0 if name in fixed else wide for name in (SLENDERNESS, "frequency")])
        known = Known(np.where(np.isfinite(spreads), start, 0.0), spreads)
    fit = fit_free_rocking(np.asarray(time, np.float64), np.asarray(rotation, np.float64), known)
    found = ratios(fit)
    if not found.ratio.size:
        raise InputError("no two neighbouring flights are seen whole: no impact says a restitution")
    place = fit.flights.instants
    if fit.covariance[place, place] > OPEN**2:
        raise InputError(
            f"{fit.flights.left.size} flights of this recording leave the slenderness open: give --width-mm and "
            "--height-mm with --fix slenderness, or with --geometry-percent"
        )
    whole = overall(found)
    return Calibration(
        fit, found, whole, _estimates(fit, found, whole, gravity), _correlation(fit), suspicions(fit, found), nominal,
        gravity,
    )  # fmt: skip


def improved_k(restitution: float, alpha: float) -> float:
    """Return k of the improved formula, eta = (4 - 3 s (1 + k)) / (4 - 3 s (1 - k)), s = sin2(alpha).

    Examples
    --------
    >>> from twin.rocking.restitution import Improved
    >>> block = Block(0.06, 0.27)
    >>> round(improved_k(Improved(0.7).ratio(block), block.slenderness), 12)
    0.7
    """
    s = math.sin(alpha) ** 2
    return (4.0 - 3.0 * s) * (1.0 - restitution) / (3.0 * s * (1.0 + restitution))


def _estimates(fit: Fit, found: Ratios, whole: Overall, gravity: float) -> dict[str, Estimate]:
    covariance, place = fit.covariance, fit.flights.instants
    alpha, p = fit.alpha, fit.p
    by_alpha, by_p = covariance[place, place], covariance[place + 1, place + 1]
    both = covariance[place, place + 1]
    cot = alpha / math.tan(alpha)
    # ln(p^2 sin alpha): d = 2 d ln p + alpha cot(alpha) d ln alpha
    stiff = math.sqrt(max(4.0 * by_p + cot**2 * by_alpha + 4.0 * cot * both, 0.0))
    # R = 3 g / (4 p^2); b = 2 R sin(alpha), h = 2 R cos(alpha)
    radius = 0.75 * gravity / p**2
    wide = math.sqrt(max(4.0 * by_p + cot**2 * by_alpha - 4.0 * cot * both, 0.0))
    tan = alpha * math.tan(alpha)
    high = math.sqrt(max(4.0 * by_p + tan**2 * by_alpha + 4.0 * tan * both, 0.0))
    estimates = {
        RESTITUTION: Estimate(whole.value, whole.error, whole.low, whole.high),
        K: _k(fit, found, whole),
        SLENDERNESS: Estimate.positive(alpha, math.sqrt(max(by_alpha, 0.0))),
        FREQUENCY: Estimate.positive(p, math.sqrt(max(by_p, 0.0))),
        STIFFNESS: Estimate.positive(p**2 * math.sin(alpha), stiff),
        ZERO: Estimate.plain(fit.zero, math.sqrt(max(covariance[-1, -1], 0.0))),
        WIDTH: Estimate.positive(2.0 * radius * math.sin(alpha), wide),
        HEIGHT: Estimate.positive(2.0 * radius * math.cos(alpha), high),
    }
    if fit.flights.entry:
        estimates[TILT] = _tilt(fit)
    return estimates


def _k(fit: Fit, found: Ratios, whole: Overall) -> Estimate:
    place = fit.flights.instants
    alpha, eta = fit.alpha, whole.value
    value = improved_k(eta, alpha)
    s = math.sin(alpha) ** 2
    by_eta = -2.0 * (4.0 - 3.0 * s) / (3.0 * s * (1.0 + eta) ** 2)
    by_s = -4.0 * (1.0 - eta) / (3.0 * s**2 * (1.0 + eta))
    by_alpha = by_s * math.sin(2.0 * alpha) * alpha
    cross = float(whole.weights @ found.with_unknowns[:, place]) * eta
    variance = (
        (by_eta * whole.error) ** 2
        + by_alpha**2 * float(fit.covariance[place, place])
        + 2.0 * by_eta * by_alpha * cross
    )  # fmt: skip
    return Estimate.plain(value, math.sqrt(max(variance, 0.0)), whole.quantile)


def _tilt(fit: Fit) -> Estimate:
    """Return the peak of the first flight: alpha - psi0, signed, and its deviation."""
    flights, x = fit.flights, fit.adjusted.x
    half, _ = halves(flights, x)
    shape = shape_of(fit.p * half[:1], fit.alpha)
    valley, growth, speed = float(shape.valley[0]), float(shape.growth[0]), float(shape.speed[0])
    slope = np.zeros(x.size)
    # d psi0 = (d alpha - v dU) / Y, U = p (t1 - t0)
    slope[flights.left[0]], slope[flights.right[0]] = -speed * fit.p / growth, speed * fit.p / growth
    slope[flights.instants] = fit.alpha * (1.0 - 1.0 / growth)
    slope[flights.instants + 1] = speed * fit.p * half[0] / growth
    error = math.sqrt(max(float(slope @ fit.covariance @ slope), 0.0))
    return Estimate.plain(int(flights.side[0]) * (fit.alpha - valley), error)


def _correlation(fit: Fit) -> float:
    place = fit.flights.instants
    block = fit.covariance[place : place + 2, place : place + 2]
    if not np.all(np.diagonal(block) > 0.0):
        return math.nan
    return float(block[0, 1] / math.sqrt(block[0, 0] * block[1, 1]))
