"""Sampling the blocks that a table of outcomes allows: a search, then ensembles that know nothing of each other.

The likelihood is rugged (overturning is fractal near its boundaries) and may have several tops, so that neither a
gradient nor a single chain will do. A Sobol sequence covers the box; ensembles of walkers climb from its best points;
the best distinct points of all they met are where two ensembles start anew, each on a thread of its own, to be sampled.
They agree if each has found all there is (Gelman and Rubin 1992).

Moves: differential evolution (ter Braak 2006; Nelson, Ford and Payne 2014), snooker (ter Braak and Vrugt 2008) and
stretch (Goodman and Weare 2010), by the library emcee (Foreman-Mackey and others 2013).
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from importlib import import_module
from typing import Any

import numpy as np
from scipy.stats import qmc

from twin.calibration.outcomes.likelihood import PARAMETERS, Likelihood
from twin.rocking.compiled import FloatArray

ENSEMBLES = 2
DIMENSIONS = len(PARAMETERS)
SAME_HEIGHT = 1e-6
ROUNDS = 3
"""Times the search begins anew from the best points it met."""
FAR_BELOW = 15.0
"""ln L below the highest at which a point is no place to sample from."""


@dataclass(frozen=True, slots=True)
class Effort:
    """How long is searched and sampled; the defaults are those the coverage was measured with.

    Attributes
    ----------
    starts : int
        Points of the Sobol sequence, a power of 2.
    walkers : int
        Of each of the two ensembles, even, at least 10.
    search, burnt, kept : int
        Steps of every walker: climbing (in `ROUNDS`), before the sampling counts, and counting.
    """

    starts: int = 1024
    walkers: int = 24
    search: int = 45
    burnt: int = 100
    kept: int = 300


FULL = Effort()


@dataclass(frozen=True, slots=True)
class Chains:
    """What the ensembles left.

    Attributes
    ----------
    points : ndarray, shape (2, kept, walkers, 4)
    best : ndarray, shape (4,)
        The likeliest point met, search included; of equally likely ones the one nearest to their middle.
    best_log_likelihood : float
    evaluations : int
        Blocks that were tried.
    """

    points: FloatArray
    best: FloatArray
    best_log_likelihood: float
    evaluations: int


def sample(likelihood: Likelihood, start_box: tuple[FloatArray, FloatArray], seed: int, effort: Effort) -> Chains:
    """Return the sampled blocks; the same for the same seed, whatever the threads do.

    Parameters
    ----------
    likelihood : Likelihood
        Flat in its box before any trial.
    start_box : pair of ndarray, shape (4,)
        Where the search begins.
    seed : int
    effort : Effort
    """
    seeds = np.random.SeedSequence(seed).spawn(1 + (ROUNDS + 1) * ENSEMBLES)
    rng = np.random.default_rng(seeds[0])
    starts = qmc.scale(qmc.Sobol(DIMENSIONS, rng=rng).random(effort.starts), *start_box)
    with ThreadPoolExecutor(ENSEMBLES, thread_name_prefix="outcomes") as pool:
        met, heights = starts, likelihood.shared(starts, pool, 4 * ENSEMBLES)

        def walk(begin: FloatArray, steps: int, first_seed: int) -> list[tuple[FloatArray, FloatArray]]:
            """Let the ensembles walk, each from its share of the points."""
            ensembles = [
                pool.submit(_walk, likelihood, begin[k::ENSEMBLES], steps, seeds[first_seed + k])
                for k in range(ENSEMBLES)
            ]
            return [ensemble.result() for ensemble in ensembles]

        for lap in range(ROUNDS):
            best, _ = _best_distinct(met, heights, ENSEMBLES * effort.walkers)
            climbs = walk(best, -(-effort.search // ROUNDS), 1 + lap * ENSEMBLES)
            met = np.concatenate([met, *(points.reshape(-1, DIMENSIONS) for points, _ in climbs)])
            heights = np.concatenate([heights, *(found.reshape(-1) for _, found in climbs)])
        begin = _without_laggards(*_best_distinct(met, heights, ENSEMBLES * effort.walkers), rng)
        steps = effort.burnt + effort.kept
        runs = walk(begin, steps, 1 + ROUNDS * ENSEMBLES)
    points = np.stack([points for points, _ in runs])
    found = np.stack([found for _, found in runs])
    met = np.concatenate([met, points.reshape(-1, DIMENSIONS)])
    heights = np.concatenate([heights, found.reshape(-1)])
    return Chains(points[:, effort.burnt :], _middle_of_top(met, heights), float(np.max(heights)), len(heights))


def _walk(
    likelihood: Callable[[FloatArray], FloatArray], begin: FloatArray, steps: int, seed: np.random.SeedSequence
) -> tuple[FloatArray, FloatArray]:
    """Let one ensemble walk; return its points, shape (steps, walkers, 4), and their heights."""
    emcee: Any = import_module("emcee")
    moves = [(emcee.moves.DEMove(), 0.7), (emcee.moves.DESnookerMove(), 0.1), (emcee.moves.StretchMove(), 0.2)]
    walkers = emcee.EnsembleSampler(len(begin), DIMENSIONS, likelihood, moves=moves, vectorize=True)
    # emcee keeps its own generator, of the older kind.
    random = np.random.RandomState(np.random.MT19937(seed))
    walkers.run_mcmc(
        emcee.State(begin, random_state=random.get_state(legacy=True)), steps, skip_initial_state_check=True
    )
    return walkers.get_chain(), walkers.get_log_prob()


def _best_distinct(points: FloatArray, heights: FloatArray, count: int) -> tuple[FloatArray, FloatArray]:
    """Return the `count` highest points, no two the same, the highest first, and their heights."""
    _, first = np.unique(points, axis=0, return_index=True)
    order = first[np.argsort(-heights[first], kind="stable")][:count]
    return points[order], heights[order]


def _without_laggards(points: FloatArray, heights: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Put points far below the highest between two that are not: a walker may never find its way up from there."""
    near = np.nonzero(heights >= heights[0] - FAR_BELOW)[0]
    chosen = points.copy()
    for place in range(len(points)):
        if place not in near:
            one, other = points[rng.choice(near, 2)]
            chosen[place] = one + rng.uniform(0.0, 1.0, DIMENSIONS) * (other - one)
            chosen[place] += 1e-3 * rng.standard_normal(DIMENSIONS) * np.abs(chosen[place])
    return chosen


def _middle_of_top(points: FloatArray, heights: FloatArray) -> FloatArray:
    """Return the highest point. Outcomes are yes or no, so that the top is flat: then the one nearest to its middle."""
    top = np.unique(points[heights >= np.max(heights) - SAME_HEIGHT], axis=0)
    scale = np.std(top, axis=0)
    away = (top - np.mean(top, axis=0)) / np.where(scale > 0.0, scale, 1.0)
    return top[int(np.argmin(np.sum(away**2, axis=1)))]
