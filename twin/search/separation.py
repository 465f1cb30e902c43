"""Runs that tell two restitutions apart: what a measured rotation shows, in deviations of the sensor and the spreads.

The restitution itself is the question, and its own spread is left out; everything else is drawn as the scene says.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtri  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from twin.rehearsal import Rehearsal
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Outcome
from twin.scene import Scene
from twin.search.field import peaks_apart
from twin.search.judge import Judge, Verdict, interval
from twin.search.proposal import Proposal, admitted, use_words
from twin.search.survey import Survey
from twin.simulation import simulate
from twin.uncertainty.motion import BaseMotion, scaled
from twin.uncertainty.population import Population
from twin.uncertainty.probability import Probability

IMPACTS = 12
"""Impacts whose times, and the peaks behind them, are compared."""
INSIDE = 7
"""Instants between two impacts at which the rotation is looked at for its peak."""
SCOUTS, JURY = 10, 120
"""Futures in which a cell of the field, and a candidate, is followed in full."""
ROWS, COLUMNS = 32, 14
"""So many of the field's sizes and shapes are looked at."""
SHOWN = 0.9
"""Share of the futures in which an observable must exist to count."""
STANDS = 0.01
"""Probability of overturning up to which a run counts as one where the block stays up."""


@dataclass(frozen=True, slots=True)
class Difference:
    """What tells two restitutions apart in one run.

    Attributes
    ----------
    sigmas : float
        Difference of the means over the root of the mean square deviation, the sensor's noise in it.
    what : str
        What differs, with its two values.
    """

    sigmas: float
    what: str


@dataclass(frozen=True, slots=True)
class Seen:
    """What a sensor would see of each future: (futures, observables), nan where there is none; and its noise there."""

    values: FloatArray
    noise: FloatArray
    fallen: int


def find_separating(field: Survey, judge: Judge, etas: tuple[float, float], most: int, seed: int) -> Iterator[Proposal]:
    """Yield proposals, unsorted: those where the block stays up score above all others."""
    scouts = [Population.of(field.rehearsal, SCOUTS, seed, restitution=eta) for eta in etas]
    juries = [Population.of(field.rehearsal, JURY, seed + 1, restitution=eta) for eta in etas]
    sure = [Population.of(field.rehearsal, judge.jury.count, seed + 2, restitution=eta) for eta in etas]
    scene = field.family.scene
    score = np.full(field.possible.shape, np.nan)
    for i in range(0, len(field.sizes), max(1, len(field.sizes) // ROWS)):
        for j in range(0, len(field.shapes), max(1, len(field.shapes) // COLUMNS)):
            if field.inside[i, j]:
                rows = field.pieces[i * len(field.shapes) + j]
                score[i, j] = _score(
                    _difference([_seen(scene, field.rehearsal, one, rows[None]) for one in scouts], etas)
                )
    for k, (i, j) in enumerate(peaks_apart(score, score > 0.0, field.sizes, field.shapes)):
        if k == 2 * most:
            return
        size, shape = field.family.rounded(float(field.sizes[i]), float(field.shapes[j]), down=True)
        rehearsal = admitted(field.family, size, shape)
        if rehearsal is None:
            continue
        variants = judge.variants(rehearsal)
        both = [one.probability(variants) for one in sure]
        worst = max(both, key=lambda one: one.high)
        seen = [_seen(scene, rehearsal, one, variants) for one in juries]
        difference = _difference(seen, etas)
        if difference is None or difference.sigmas <= 0.0:
            continue
        stands = worst.high < STANDS
        where = (
            f"the block stays up (overturns in {interval(worst)} of futures)"
            if stands
            else f"but the block overturns in {interval(both[0])} and {interval(both[1])} of futures"
        )
        why = f"{difference.what}: {difference.sigmas:.1f} sigma apart; {where}; {use_words(rehearsal)}"
        verdict = Verdict(size, shape, rehearsal, worst, Probability(worst.count, 0))
        yield judge.proposal(verdict, why, difference.sigmas + (1e6 if stands else 0.0), sigmas=difference.sigmas)


def _score(difference: Difference | None) -> float:
    return math.nan if difference is None else difference.sigmas


def _seen(scene: Scene, rehearsal: Rehearsal, futures: Population, variants: FloatArray) -> Seen:
    """Follow every future and return what its sensor shows."""
    rows = np.full((futures.count, 2 * IMPACTS), np.nan)
    noise = np.full((futures.count, 2 * IMPACTS), np.nan)
    fallen = 0
    sensor, cycle = scene.twin.rotation_noise_rad, 1.0 / scene.twin.cycle_hz
    for k in range(futures.count):
        motion = variants[min(int(futures.shapes[k] * len(variants)), len(variants) - 1)]
        response = simulate(
            futures.block(k, rehearsal.block),
            BaseMotion(scaled(motion, float(futures.factors[k]))),
            restitution=float(futures.bodies[k, 3]),
            initial_rotation=float(futures.rotations[k]),
        )
        if response.outcome not in (Outcome.ROCKED, Outcome.STAYED):
            fallen += 1
            continue
        # The first impacts of a leaning block are those of its settling; what rocks has turned faster.
        speed = np.abs(response.impact_rates)
        strong = np.nonzero(speed > 0.05 * float(speed.max(initial=0.0)))[0]
        if not strong.size:
            continue
        first = int(strong[0])
        times = response.impact_times[first : first + IMPACTS + 1]
        speeds = speed[first : first + IMPACTS + 1]
        count = min(len(times), IMPACTS)
        rows[k, :count] = times[:count]
        noise[k, :count] = np.hypot(sensor / speeds[:count], cycle / math.sqrt(12.0))
        gaps = len(times) - 1
        if gaps > 0:
            inside = times[:-1, None] + np.diff(times)[:, None] * (np.arange(1, INSIDE + 1) / (INSIDE + 1.0))
            peaks = np.abs(np.asarray(response.rotation(inside))).max(axis=1)
            rows[k, IMPACTS : IMPACTS + gaps] = peaks[:IMPACTS]
            noise[k, IMPACTS : IMPACTS + gaps] = sensor
    return Seen(rows, noise, fallen)


def _difference(seen: list[Seen], etas: tuple[float, float]) -> Difference | None:
    """Return the observable that tells the two apart best, or the outcome where the block falls; None for nothing."""
    one, other = seen
    count = len(one.values)
    if one.fallen + other.fallen > 0:
        return _by_outcome(one.fallen / count, other.fallen / count, count, etas)
    best: Difference | None = None
    for column in range(2 * IMPACTS):
        a, b = one.values[:, column], other.values[:, column]
        there = np.isfinite(a), np.isfinite(b)
        if min(there[0].mean(), there[1].mean()) < SHOWN or count < 3:
            continue
        a, b = a[there[0]], b[there[1]]
        sensor = _mean_square(one.noise[there[0], column]) + _mean_square(other.noise[there[1], column])
        deviation = math.sqrt(0.5 * (float(np.var(a, ddof=1)) + float(np.var(b, ddof=1)) + sensor))
        sigmas = abs(float(np.mean(a) - np.mean(b))) / deviation
        if best is None or sigmas > best.sigmas:
            best = Difference(sigmas, _words(column, float(np.mean(a)), float(np.mean(b)), etas))
    return best


def _mean_square(values: FloatArray) -> float:
    return float(np.dot(values, values)) / len(values)


def _words(column: int, a: float, b: float, etas: tuple[float, float]) -> str:
    which = column % IMPACTS + 1
    if column < IMPACTS:
        return (
            f"impact {which} comes {a:.3f} s after the pulse begins with {etas[0]:.4g} and {b:.3f} s with {etas[1]:.4g}"
        )
    return f"the peak after impact {which} is {a:.4f} rad with {etas[0]:.4g} and {b:.4f} rad with {etas[1]:.4g}"


def _by_outcome(one: float, other: float, count: int, etas: tuple[float, float]) -> Difference:
    """Return how far apart two shares of falls are: as two normal distributions confused as often."""
    wrong = max(0.5 * (1.0 - abs(one - other)), 0.5 / count)
    sigmas = -2.0 * float(ndtri(wrong)) if wrong < 0.5 else 0.0
    return Difference(
        sigmas, f"the block overturns in {one:.0%} of futures with {etas[0]:.4g} and in {other:.0%} with {etas[1]:.4g}"
    )
