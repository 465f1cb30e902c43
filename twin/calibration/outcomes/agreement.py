"""Whether the blocks that were found would have done what was seen: outcomes drawn again from them (Gelman 1996)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.calibration.outcomes.likelihood import FELL, STOOD, Likelihood
from twin.rocking.compiled import FloatArray

DRAWS = 100
LEAST_SHARE = 0.01
"""Share of drawn tables at least as unlikely as the seen one, below which the model is said not to explain it."""
STRANGE = 0.05
"""An outcome of less probability is named."""


@dataclass(frozen=True, slots=True)
class Agreement:
    """The seen outcomes against those the sampled blocks would have had.

    Attributes
    ----------
    rows : ndarray, shape (n, 6)
        The trials, equal ones in one row: see `likelihood.table_of`.
    probabilities : ndarray, shape (n,)
        Probability that each falls, over all sampled blocks.
    share : float
        Share of the tables drawn from the sampled blocks that are at least as unlikely as the seen one.
    falls_low, falls_high : int
        Between which 95 % of the drawn tables have their number of falls.
    """

    rows: FloatArray
    probabilities: FloatArray
    share: float
    falls_low: int
    falls_high: int

    @property
    def falls(self) -> int:
        """How many fell."""
        return int(np.sum(self.rows[:, FELL]))

    @property
    def brier(self) -> float:
        """Mean square of the difference between probability and outcome, 0 best; always saying 1/2 has 0.25."""
        fell, stood = self.rows[:, FELL], self.rows[:, STOOD]
        squares = fell * (1.0 - self.probabilities) ** 2 + stood * self.probabilities**2
        return float(np.sum(squares) / np.sum(fell + stood))

    @property
    def strange(self) -> list[tuple[int, bool, float]]:
        """Rows with an outcome that was improbable: row, whether it fell, and how probable that was."""
        seen = [
            (row, fell, probability if fell else 1.0 - probability)
            for row, probability in enumerate(map(float, self.probabilities))
            for fell in (True, False)
            if self.rows[row, FELL if fell else STOOD] > 0
        ]
        return sorted((one for one in seen if one[2] < STRANGE), key=lambda one: one[2])

    @property
    def fault(self) -> str | None:
        """What is wrong, in words; None where nothing is."""
        if self.share >= LEAST_SHARE:
            return None
        return (
            f"a rocking block does not explain them: {self.share:.1%} of the tables drawn from the blocks found are as "
            "unlikely as this one"
        )


def agreement_of(likelihood: Likelihood, points: FloatArray, rng: np.random.Generator) -> Agreement:
    """Return how well sampled blocks, shape (n, 4), explain what was seen."""
    rows = likelihood.table
    trials = rows[:, FELL] + rows[:, STOOD]
    chosen = points[np.linspace(0, len(points) - 1, min(DRAWS, len(points))).astype(np.int64)]
    probabilities = np.array([likelihood.probabilities(point) for point in chosen])
    drawn = rng.binomial(trials.astype(np.int64), probabilities)

    def heights(fell: FloatArray) -> FloatArray:
        return np.sum(fell * np.log(probabilities) + (trials - fell) * np.log(1.0 - probabilities), axis=1)

    share = float(np.mean(heights(drawn.astype(np.float64)) <= heights(rows[:, FELL]) + 1e-9))
    low, high = np.quantile(np.sum(drawn, axis=1), (0.025, 0.975))
    return Agreement(rows, np.mean(probabilities, axis=0), share, int(np.floor(low)), int(np.ceil(high)))
