"""How much each of the things that are not known exactly has to do with falling or standing."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.batch.codes import OVERTURNED
from twin.rocking.batch.many import Outcomes
from twin.rocking.compiled import FloatArray
from twin.uncertainty.population import CAUSES, GAIN, RESTITUTION_, SIZE, SLENDERNESS, TILT, Population
from twin.uncertainty.probability import Probability
from twin.uncertainty.shaking import DELAY, NOISE, REBOUND, Shaking, shaking_of
from twin.uncertainty.table import TableResponse

BINS = 20
FEWEST = 200
"""Futures asked again without each cause, at least; a quarter of them all otherwise."""


@dataclass(frozen=True, slots=True)
class Cause:
    """One thing that is not known exactly.

    Attributes
    ----------
    name : str
    spread : str
        Its distribution in words.
    without : Probability
        Of falling, were this one at its mean and all others as they are.
    share : float or None
        Of the outcomes' variance, what this cause explains alone: Var(E[fell | cause]) / Var(fell), the first-order
        index of I. M. Sobol (1993), from the futures in `BINS` classes of the cause, less what chance alone would
        give. None where all futures end alike, and of causes that are several base motions.
    """

    name: str
    spread: str
    without: Probability
    share: float | None


def causes_of(
    rehearsal: Rehearsal, response: TableResponse, population: Population, shaking: Shaking, found: Outcomes
) -> tuple[Cause, ...]:
    """Return the causes there are, that with the greatest effect first.

    Each is asked about with the same draws of all the others, so that a small difference is no chance.
    """
    count = max(population.count // 4, min(population.count, FEWEST))
    fell = found.codes == OVERTURNED
    causes: list[Cause] = []
    for k, name in enumerate(CAUSES):
        if _deviation(rehearsal, name) == 0.0:
            continue
        still = Population.of(rehearsal, count, without=name)
        probability = still.probability(shaking.variants)
        causes.append(Cause(name, _words(rehearsal, name), probability, first_order(population.values[:, k], fell)))
    for name in shaking.spread:
        other = shaking_of(rehearsal, response, without=name)
        probability = population.first(count).probability(other.variants)
        causes.append(Cause(name, _words(rehearsal, name), probability, None))
    here = Probability(count, int(np.sum(fell[:count]))).estimate
    return tuple(sorted(causes, key=lambda cause: -abs(cause.without.estimate - here)))


def first_order(values: FloatArray, fell: NDArray[np.bool_]) -> float | None:
    """Return the share of the variance of `fell` that `values` alone explain, 0 to 1; see `Cause.share`.

    Examples
    --------
    >>> x = np.random.default_rng(1).standard_normal((20_000, 2))
    >>> fell = x[:, 0] > 0.0
    >>> share = [first_order(x[:, k], fell) for k in (0, 1)]
    >>> [round(s, 2) for s in share if s is not None]
    [0.98, 0.0]
    """
    n = len(fell)
    mean = float(np.mean(fell))
    variance = mean * (1.0 - mean)
    bins = min(BINS, n // 20)
    if variance == 0.0 or bins < 2:
        return None
    order = np.argsort(values, kind="stable")
    classes: list[FloatArray] = np.array_split(fell[order].astype(np.float64), bins)
    between = sum(len(part) * (float(np.mean(part)) - mean) ** 2 for part in classes) / n
    within = sum(len(part) * float(np.var(part)) for part in classes) / (n - bins)
    return min(max((between - within * (bins - 1) / n) / variance, 0.0), 1.0)


def _deviation(rehearsal: Rehearsal, name: str) -> float:
    spreads = rehearsal.scene.spreads
    if name == GAIN and rehearsal.given is None:
        return 0.0
    return {
        RESTITUTION_: spreads.restitution,
        SLENDERNESS: spreads.slenderness_percent,
        SIZE: spreads.size_percent,
        TILT: spreads.initial_tilt_deg,
        GAIN: spreads.table.gain_percent,
    }[name].deviation


def _words(rehearsal: Rehearsal, name: str) -> str:
    spreads = rehearsal.scene.spreads
    table = spreads.table
    if name == NOISE:
        return f"{table.noise_m_s2:g} m/s2 up to {table.noise_hz:g} Hz"
    part, unit, own = {
        RESTITUTION_: (spreads.restitution, "", rehearsal.restitution),
        SLENDERNESS: (spreads.slenderness_percent, "%", 0.0),
        SIZE: (spreads.size_percent, "%", 0.0),
        TILT: (spreads.initial_tilt_deg, "deg", math.degrees(initial_rotation(rehearsal.scene))),
        GAIN: (table.gain_percent, "%", 0.0),
        DELAY: (table.delay_ms, "ms", 0.0),
        REBOUND: (table.rebound, "", math.nan),
    }[name]
    return part.words(unit, own)
