"""Whether chains have mixed: what two ensembles, and the halves of each, say of the same parameter."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.calibration.outcomes.likelihood import PARAMETERS
from twin.rocking.compiled import FloatArray

LARGEST_RATIO = 1.1
"""Gelman and Rubin's ratio above which the chains count as not mixed."""
WINDOW = 5.0
FEWEST_DRAWS = 100.0
"""Independent draws below which the ends of a 95 % interval are guesses."""


@dataclass(frozen=True, slots=True)
class Mixing:
    """What is known of the chains.

    Attributes
    ----------
    ratios : tuple of float
        Of each parameter: sqrt(total variance / variance within), over the four halves of the two ensembles; 1 is
        mixed.
    times : tuple of float
        Of each parameter: the steps after which a walker has forgotten where it was (integrated autocorrelation).
    draws : float
        Independent draws that the chains are worth, of the worst parameter.
    """

    ratios: tuple[float, ...]
    times: tuple[float, ...]
    draws: float

    @property
    def fault(self) -> str | None:
        """What is wrong, in words; None where nothing is."""
        worst = int(np.argmax(self.ratios))
        if not self.ratios[worst] <= LARGEST_RATIO:
            return (
                f"the two ensembles disagree about {PARAMETERS[worst]} (Gelman-Rubin {self.ratios[worst]:.2f}; "
                f"{LARGEST_RATIO:g} is allowed)"
            )
        if not self.draws >= FEWEST_DRAWS:
            return f"they are worth {self.draws:.0f} independent draws; {FEWEST_DRAWS:g} are needed"
        return None


def mixing_of(points: FloatArray) -> Mixing:
    """Return how well chains have mixed.

    Parameters
    ----------
    points : ndarray, shape (ensembles, steps, walkers, parameters)
    """
    _, steps, walkers, count = points.shape
    halves = np.concatenate([points[:, : steps // 2], points[:, steps - steps // 2 :]])
    groups = halves.reshape(len(halves), -1, count)
    within = np.mean(np.var(groups, axis=1), axis=0)
    between = np.var(np.mean(groups, axis=1), axis=0, ddof=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.where(within > 0.0, np.sqrt(1.0 + between / within), np.where(between > 0.0, math.inf, 1.0))
    times = np.array([[_forgetting(chain[..., k]) for k in range(count)] for chain in points])
    draws = float(np.min(np.sum(steps * walkers / times, axis=0)))
    return Mixing(tuple(map(float, ratios)), tuple(map(float, np.mean(times, axis=0))), draws)


def _forgetting(chain: FloatArray) -> float:
    """Return the integrated autocorrelation time of one parameter of an ensemble, shape (steps, walkers), in steps.

    Deviations are from the mean of the whole ensemble, so that a walker which stays away, or still, counts against it.
    The sum ends at the first lag above `WINDOW` times itself (Sokal 1996).
    """
    steps = len(chain)
    deviations = chain - np.mean(chain)
    if not np.any(deviations):
        return float(steps)
    spectrum = np.fft.rfft(deviations, 2 * steps, axis=0)
    covariance = np.mean(np.fft.irfft(np.abs(spectrum) ** 2, axis=0)[:steps], axis=1)
    sums = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
    ends = np.nonzero(np.arange(steps) >= WINDOW * sums)[0]
    return max(1.0, float(sums[ends[0]] if ends.size else sums[-1]))
