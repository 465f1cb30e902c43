"""How probable a table of outcomes is for a block: every trial followed by the batch engine, at a spread of amplitudes.

What a table makes of an amplitude scatters, and near the boundaries of overturning a little of it turns the outcome
over: a block is not refuted by one trial at a boundary. The amplitude a of a trial is taken as a exp(s z), z normal,
in the form of its `LEVELS` quantiles of equal probability; f is the share of them at which the block overturns. One
outcome in 200 is taken as wrong whatever the block (read wrong, a knock, a draught), so that none has probability 0:

    P(fell) = w + (1 - 2 w) f,   w = 1 / 200.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np
from scipy.special import ndtri

from twin.calibration.outcomes.trials import COSINE, Trial
from twin.rocking.batch.codes import DOUBTFUL, OVERTURNED, UNSETTLED, Numbers
from twin.rocking.batch.engine import COARSE, FINE, quick_look
from twin.rocking.batch.exact import accurate_look
from twin.rocking.compiled import FloatArray

LEVELS = 8
"""Quantiles of a trial's amplitude."""
WRONG = 1.0 / 200.0
"""Share of the outcomes that are taken as wrong."""
PARAMETERS = ("alpha", "ln p", "eta", "ln spread")
"""What is sought: slenderness angle, rad; frequency parameter, rad/s; ratio of rates over an impact; s."""
ALPHA, LN_P, ETA, LN_SPREAD = range(4)
# Columns of the table of trials.
SIZE, FREQUENCY, CYCLES, PHASE, FELL, STOOD = range(6)
NONE = np.zeros(0)


def table_of(trials: Sequence[Trial]) -> FloatArray:
    """Return trials as rows for the compiled code: |a| m/s2, Hz, cycles, phase, how often it fell and stood.

    Equal trials become one row. The sign of an amplitude mirrors the motion and leaves the outcome.
    """
    rows: dict[tuple[float, float, float, str], list[int]] = {}
    for trial in trials:
        shape = (abs(trial.amplitude), trial.frequency, trial.cycles, trial.kind)
        rows.setdefault(shape, [0, 0])[0 if trial.overturned else 1] += 1
    return np.array(
        [
            (size, frequency, cycles, 0.5 * math.pi if kind == COSINE else 0.0, *count)
            for (size, frequency, cycles, kind), count in sorted(rows.items())
        ]
    )


def levels() -> FloatArray:
    """Return the middles of `LEVELS` equally probable parts of a normal distribution: a first half that spans them all.

    Where the first half agree, the others are not asked.
    """
    return ndtri((np.array([0, 2, 5, 7, 1, 3, 4, 6]) + 0.5) / LEVELS)


class Likelihood:
    """The logarithm of the likelihood over a box of blocks, -inf outside it.

    Parameters
    ----------
    trials : sequence of Trial
    gravity : float
        m/s2.
    lowest, highest : ndarray, shape (4,)
        The box.
    """

    def __init__(self, trials: Sequence[Trial], gravity: float, lowest: FloatArray, highest: FloatArray) -> None:
        self.table = table_of(trials)
        self.gravity = gravity
        self.lowest, self.highest = lowest, highest
        self._z = levels()
        # Pieces of base motion of one quantile of every trial; the amplitude is a point's.
        self._pieces = np.zeros((len(self.table), 7))
        self._pieces[:, 1] = self.table[:, CYCLES] / self.table[:, FREQUENCY]
        self._pieces[:, 5] = 2.0 * math.pi * self.table[:, FREQUENCY]
        self._pieces[:, 6] = self.table[:, PHASE]

    def __call__(self, points: FloatArray) -> FloatArray:
        """Return the answer for points, shape (m, 4)."""
        inside = np.all((points >= self.lowest) & (points <= self.highest), axis=1)
        answers = np.full(len(points), -math.inf)
        for row in np.nonzero(inside)[0]:
            falls = self.probabilities(points[row])
            seen = self.table[:, FELL] * np.log(falls) + self.table[:, STOOD] * np.log(1.0 - falls)
            answers[row] = float(np.sum(seen))
        return answers

    def shared(self, points: FloatArray, pool: ThreadPoolExecutor, parts: int) -> FloatArray:
        """Return the same, the points shared among threads."""
        return np.concatenate(list(pool.map(self, np.array_split(points, parts))))

    def probabilities(self, point: FloatArray) -> FloatArray:
        """Return, for each row of the table, the probability that the block of a point, shape (4,), falls."""
        return WRONG + (1.0 - 2.0 * WRONG) * self.shares(point)

    def shares(self, point: FloatArray) -> FloatArray:
        """Return, for each row of the table, the share of its amplitudes at which the block overturns.

        Half of the quantiles are asked first, and the rest only where those do not agree.
        """
        alpha, p, spread = float(point[ALPHA]), math.exp(point[LN_P]), math.exp(point[LN_SPREAD])
        body = np.array([alpha, p, self.gravity, point[ETA], self.gravity * math.tan(alpha), 1e-15, 1.0])
        factors = np.exp(spread * self._z)
        half = LEVELS // 2
        fell = self._falls(body, np.arange(len(self.table)), factors[:half])
        shares = fell / half
        split = np.nonzero((fell > 0.0) & (fell < half))[0]
        if split.size:
            shares[split] = (fell[split] + self._falls(body, split, factors[half:])) / LEVELS
        return shares

    def _falls(self, body: FloatArray, rows: Numbers, factors: FloatArray) -> FloatArray:
        """Return at how many `factors` of its amplitude each of the `rows` overturns the block; a doubtful one is half.

        The engine as `twin.map` asks it, without its last question: whether a rounding would change the outcome.
        """
        pieces = np.repeat(self._pieces[rows], len(factors), axis=0)[:, None, :]
        pieces[:, 0, 4] = np.outer(self.table[rows, SIZE], factors).reshape(-1)
        cells = len(pieces)
        codes = np.zeros(cells, dtype=np.uint8)
        impacts, directions = np.zeros(cells, dtype=np.int32), np.zeros(cells, dtype=np.int8)
        quick_look(body, pieces, 0.0, COARSE, codes, impacts, directions, NONE)
        again = np.nonzero(codes == UNSETTLED)[0]
        if again.size:
            finer = np.zeros(again.size, dtype=np.uint8)
            quick_look(body, pieces[again], 0.0, FINE, finer, impacts[: again.size], directions[: again.size], NONE)
            codes[again] = finer
            last = again[finer == UNSETTLED]
            if last.size:
                accurate_look(body, pieces, 0.0, last, codes, impacts, directions, NONE, NONE)
        fell = np.where(codes >= DOUBTFUL, 0.5, codes == OVERTURNED)
        return np.sum(fell.reshape(-1, len(factors)), axis=1)
