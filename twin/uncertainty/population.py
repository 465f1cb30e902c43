"""The futures of a scene before any pulse: blocks, tilts and amplitudes drawn from what is not known exactly."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtr  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.batch.codes import OVERTURNED, UNDECIDED
from twin.rocking.batch.many import Outcomes, outcomes_of
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.run import local_tolerance
from twin.rocking.state import ALPHA, GRAVITY, RESTITUTION, THRESHOLD, P
from twin.uncertainty.probability import Probability

if TYPE_CHECKING:
    from twin.scene_uncertainty import KnownUncertainty, SpreadPart

LARGEST_TILT = 1.5
"""rad; a spread that reaches beyond is cut here."""
TOLERANCE = 1e-10
SMALLEST_ANGLE = 1e-3
RESTITUTION_, SLENDERNESS, SIZE, TILT, GAIN = CAUSES = ("restitution", "slenderness", "size", "tilt", "table gain")


@dataclass(frozen=True, slots=True)
class Population:
    """Futures of one scene; which base motion shakes them is asked later.

    Attributes
    ----------
    bodies : ndarray, shape (n, 7)
        See `twin.rocking.run.parameters`.
    rotations : ndarray, shape (n,)
        Where each block is let go, rad, signed.
    factors : ndarray, shape (n,)
        Of the base motion: the error of the table's amplitude.
    shapes : ndarray, shape (n,)
        From 0 to 1: which of several base motions each future has.
    blocks : ndarray, shape (n, 2)
        Slenderness, rad, and diagonal, m.
    values : ndarray, shape (n, 5)
        What was drawn for each of `CAUSES`, in standard deviations.
    """

    bodies: FloatArray
    rotations: FloatArray
    factors: FloatArray
    shapes: FloatArray
    blocks: FloatArray
    values: FloatArray

    @classmethod
    def of(
        cls,
        rehearsal: Rehearsal,
        count: int | None = None,
        seed: int | None = None,
        *,
        restitution: float | None = None,
        without: str | None = None,
    ) -> Population:
        """Draw the futures of a rehearsed scene.

        The first futures are the same for every `count`. A scene that lets the block go with a tilt spreads that tilt,
        at the start of the run; any other has the block leaning, at rest, by the tilt drawn as the pulse begins (the
        perturbed initial condition of Ceh 2018, section 3.5).

        Parameters
        ----------
        rehearsal : Rehearsal
        count, seed : int, optional
            The scene's unless given.
        restitution : float, optional
            Of all futures, instead of the drawn one; everything else is drawn as without it.
        without : str, optional
            One of `CAUSES` that stays at its mean; everything else is drawn as without it.
        """
        spreads = rehearsal.scene.spreads
        count = spreads.futures if count is None else count
        rng = np.random.default_rng(spreads.seed if seed is None else seed)
        # Row by row, so that fewer futures are the first of more.
        drawn = rng.standard_normal((count, len(CAUSES) + 1))
        values = drawn[:, :-1]
        if without is not None:
            values = values.copy()
            values[:, CAUSES.index(without)] = 0.0
        return _placed(rehearsal, spreads, values, np.asarray(ndtr(drawn[:, -1])), restitution)

    @property
    def count(self) -> int:
        """Number of futures."""
        return len(self.bodies)

    def first(self, count: int) -> Population:
        """Return the first `count` of the futures."""
        columns = (self.bodies, self.rotations, self.factors, self.shapes, self.blocks, self.values)
        return Population(*(column[:count] for column in columns))

    def scaled(self, factor: float) -> Population:
        """Return the same futures under `factor` times the base motion."""
        return replace(self, factors=factor * self.factors)

    def outcomes(self, pieces: FloatArray) -> Outcomes:
        """Return what becomes of each future: codes, impacts before it falls, sides.

        Parameters
        ----------
        pieces : ndarray, shape (k, 7) or (m, k, 7)
            The base motion, or several of which each future has one.
        """
        several = pieces if pieces.ndim == 3 else pieces[None]
        motions = np.minimum((self.shapes * len(several)).astype(np.int64), len(several) - 1)
        bodies = self.bodies.copy()
        # What multiplies the base motion divides the gravity that it is compared with; p stays.
        bodies[:, GRAVITY] /= self.factors
        bodies[:, THRESHOLD] /= self.factors
        return outcomes_of(bodies, several, motions, self.rotations)

    def probability(self, pieces: FloatArray) -> Probability:
        """Return how likely the block falls; `pieces` as for `outcomes`."""
        return probability_of(self.outcomes(pieces))

    def block(self, index: int, like: Block) -> Block:
        """Return a future's block."""
        alpha, diagonal = self.blocks[index].tolist()
        return Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha), like.mass, like.gravity)


def probability_of(outcomes: Outcomes) -> Probability:
    """Return how many of the futures fall, and of how many nobody knows."""
    codes = outcomes.codes
    return Probability(len(codes), int(np.sum(codes == OVERTURNED)), int(np.sum(codes == UNDECIDED)))


def _placed(
    rehearsal: Rehearsal, spreads: KnownUncertainty, values: FloatArray, shapes: FloatArray, restitution: float | None
) -> Population:
    block, nominal = rehearsal.block, rehearsal.restitution
    tilt = initial_rotation(rehearsal.scene)
    of = dict(zip(CAUSES, values.T, strict=True))
    eta = np.clip(_drawn(spreads.restitution, nominal, of[RESTITUTION_]), 0.0, 1.0)
    alpha = block.slenderness * (1.0 + 0.01 * _drawn(spreads.slenderness_percent, 0.0, of[SLENDERNESS]))
    alpha = np.clip(alpha, SMALLEST_ANGLE, 0.5 * math.pi - SMALLEST_ANGLE)
    size = np.maximum(1.0 + 0.01 * _drawn(spreads.size_percent, 0.0, of[SIZE]), 0.01)
    diagonal = 2.0 * block.half_diagonal * size
    lean = np.radians(_drawn(spreads.initial_tilt_deg, math.degrees(tilt), of[TILT]))
    factors = np.maximum(1.0 + 0.01 * _drawn(spreads.table.gain_percent, 0.0, of[GAIN]), 0.01)
    bodies = np.empty((len(values), 7))
    bodies[:, ALPHA] = alpha
    bodies[:, P] = np.sqrt(1.5 * block.gravity / diagonal)
    bodies[:, GRAVITY] = block.gravity
    bodies[:, RESTITUTION] = eta if restitution is None else restitution
    bodies[:, THRESHOLD] = block.gravity * np.tan(alpha)
    bodies[:, 5], bodies[:, 6] = local_tolerance(TOLERANCE), 1.0
    rotations = np.clip(lean, -LARGEST_TILT, LARGEST_TILT)
    return Population(bodies, rotations, factors, shapes, np.column_stack([alpha, diagonal]), values)


def _drawn(spread: SpreadPart, own: float, values: FloatArray) -> FloatArray:
    """Return draws of a distribution from standard normal ones; `own` is the mean of one that does not say its own."""
    if spread.low is not None and spread.high is not None:
        return spread.low + (spread.high - spread.low) * np.asarray(ndtr(values))
    return spread.centre(own) + spread.deviation * values
