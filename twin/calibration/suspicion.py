"""What the data show that is no rocking in a plane about two corners: bouncing, sliding, motion in three dimensions."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from twin.calibration.course import normal_equations
from twin.calibration.dips import dips
from twin.calibration.fit import Fit
from twin.calibration.whole_flights import misfits
from twin.rocking_data.flights import median_of_three
from twin.rocking_data.noise import STILL, STILL_SAMPLES

if TYPE_CHECKING:
    from twin.calibration.restitution import Ratios
    from twin.rocking_data.noise import FloatArray

BOUNCING, SLIDING, NOT_PLANE, UNEVEN, NOT_FREE = "bouncing", "sliding", "three-dimensional", "uneven sides", "not free"
SURE = 5.0
"""Deviations from which on a drift, a difference of the sides, a gain of energy is one."""
LEAST_DRIFT = 0.005
"""Smallest shift of the zero worth a word, in parts of the highest peak."""
LEAST_UNEVEN = 0.003
"""Smallest half difference of the slenderness of the two sides worth a word, relative."""
REST = 3.0
"""A block is at rest where nothing moves for so many times its last flight."""
MANY = 0.15
"""Part of the flights that may not fit, by chance and an odd sample."""


@dataclass(frozen=True)
class Suspicion:
    """One thing that is not rocking: what kind, and a sentence."""

    kind: str
    sentence: str


def suspicions(fit: Fit, ratios: Ratios) -> tuple[Suspicion, ...]:
    """Return what speaks against pure rocking."""
    found = [_bouncing(fit), *_zero(fit), *_sides(fit), _gains(ratios), _misfit(fit)]
    return tuple(suspicion for suspicion in found if suspicion is not None)


def _bouncing(fit: Fit) -> Suspicion | None:
    times = dips(fit.time, median_of_three(fit.rotation - fit.zero), fit.impacts)
    if not times.size:
        return None
    shown = ", ".join(f"{time:.3f}" for time in times[:4]) + (" ..." if times.size > 4 else "")
    return Suspicion(
        BOUNCING,
        f"{times.size} time{'s' * (times.size > 1)} (at {shown} s) the block comes down to the contact and goes up "
        "again on the same side: it bounces, or is touched",
    )


def _extra(fit: Fit, column: FloatArray) -> tuple[float, float]:
    """Return the value one more unknown would have, to first order, and its standard deviation.

    `column`: derivative of the samples' rotations by it.
    """
    adjusted, flights = fit.adjusted, fit.flights
    kept = adjusted.kept
    weight = fit.noise**-2.0
    _, cross = normal_equations(flights, adjusted.modelled.slope, column, kept)
    cross = np.where(adjusted.free, cross * weight, 0.0)
    own = float(np.sum(column[kept] ** 2)) * weight
    right = float(np.sum((column * adjusted.misfit)[kept])) * weight
    left = own - float(cross @ adjusted.covariance @ cross)
    if left <= 1e-9 * own:
        return 0.0, math.inf
    return right / left, math.sqrt(fit.inflation / left)


def _zero(fit: Fit) -> list[Suspicion]:
    """Drifts of the zero between impacts, and its place at rest against that during rocking."""
    time = fit.flights.time
    lasting = float(np.ptp(time))
    peak = float(np.max(np.abs(fit.rotation - fit.zero)))
    # From -1/2 to 1/2 over the flights fitted: the value is the shift from the first to the last.
    drift, error = _extra(fit, (time - 0.5 * (np.max(time) + np.min(time))) / lasting)
    least = max(LEAST_DRIFT * peak, fit.white)
    if abs(drift) > max(SURE * error, least):
        return [
            Suspicion(
                SLIDING,
                f"the zero drifts by {1e3 * drift:+.2f} mrad (standard deviation {1e3 * error:.2f}) while it rocks: "
                "the block slides or turns on its base, or the sensor drifts",
            )
        ]
    still = _at_rest(fit)
    if still is None:
        return []
    moved = still - fit.zero
    error = math.sqrt(fit.covariance[-1, -1] + fit.noise**2 / STILL_SAMPLES)
    if abs(moved) <= max(SURE * error, least):
        return []
    return [
        Suspicion(
            SLIDING,
            f"at rest the sensor reads {1e3 * moved:+.2f} mrad off the zero about which the block rocked (standard "
            f"deviation {1e3 * error:.2f}): it slid or turned on its base",
        )
    ]


def _at_rest(fit: Fit) -> float | None:
    """Return what the sensor reads in the end, where that is still for longer than flights lasted; None elsewhere."""
    flights, x = fit.flights, fit.adjusted.x
    latest = REST * float(x[flights.right[-1]] - x[flights.left[-1]])
    rest = fit.rotation[fit.time > float(fit.time[-1]) - latest]
    middle = float(np.median(rest))
    still = rest.size >= 2 * STILL_SAMPLES and float(fit.time[-1]) - latest > float(x[flights.right[-1]])
    return float(np.mean(rest)) if still and np.all(np.abs(rest - middle) <= STILL * fit.noise) else None


def _sides(fit: Fit) -> list[Suspicion]:
    """Return whether the two sides have the slenderness of one block on a level base."""
    slope = fit.adjusted.modelled.slope[:, 2]
    side = fit.flights.side[fit.flights.flight]
    if np.min(fit.flights.side) == np.max(fit.flights.side):
        return []
    uneven, error = _extra(fit, slope * side)
    if abs(uneven) <= max(SURE * error, LEAST_UNEVEN):
        return []
    return [
        Suspicion(
            UNEVEN,
            f"slenderness is {100.0 * uneven:+.2f} % on the +x side and the opposite on the other (standard deviation "
            f"{100.0 * error:.2f} %): the base leans by {1e3 * uneven * fit.alpha:+.2f} mrad, the block is not "
            "symmetrical, or it rocks out of its plane",
        )
    ]


def _gains(ratios: Ratios) -> Suspicion | None:
    gains = np.flatnonzero(ratios.logarithm > SURE * np.sqrt(np.maximum(np.diagonal(ratios.covariance), 1e-18)))
    if not gains.size:
        return None
    worst = int(gains[np.argmax(ratios.ratio[gains])])
    return Suspicion(
        NOT_PLANE,
        f"{gains.size} impact{'s' * (gains.size > 1)} would gain energy (restitution {ratios.ratio[worst]:.3f} at "
        f"{ratios.time[worst]:.3f} s): motion in three dimensions gives some back, or the base moves",
    )


def _misfit(fit: Fit) -> Suspicion | None:
    bad = misfits(fit.flights, fit.adjusted, fit.white)
    count, number = int(np.count_nonzero(bad)), bad.size
    worse = fit.noise / fit.white
    if count > max(MANY * number, 1.0) or worse > 2.0:
        return Suspicion(
            NOT_FREE,
            f"{count} of {number} flights are not those of a free block: residuals are {worse:.1f} times the noise; "
            "the block rocks out of its plane or is not rigid, the base moves, or something touches it",
        )
    return None
