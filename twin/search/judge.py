"""Who judges a run that may be proposed: the table, its drive, and thousands of futures of exactly that run."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from excitation import Pulse
from excitation.demand import ends_moving
from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.batch.codes import OVERTURNED
from twin.rocking.compiled import FloatArray
from twin.rocking.run import parameters
from twin.search.cells import count
from twin.search.family import Family
from twin.search.proposal import Proposal, admitted
from twin.search.survey import Survey, column
from twin.uncertainty.population import Population, probability_of
from twin.uncertainty.probability import Probability, percent
from twin.uncertainty.shaking import shaking_of
from twin.uncertainty.table import AS_ASKED, TableResponse

SCOUTS = 48
"""Futures in which every cell of the field is tried."""
FEWEST = 400
"""Futures of every size of a ladder, at least."""

ResponseOf = Callable[[Rehearsal], TableResponse]
"""How the table answers, of a rehearsed run."""


def as_asked(rehearsal: Rehearsal) -> TableResponse:  # noqa: ARG001 - the same for every run
    """Return the response of a table that makes what it is asked for."""
    return AS_ASKED


@dataclass(frozen=True, slots=True)
class Verdict:
    """What was found of one run that the table makes exactly as asked."""

    size: float
    shape: float
    rehearsal: Rehearsal
    overturning: Probability
    without_impact: Probability


class Judge:
    """Judges runs of a family.

    Parameters
    ----------
    field : Survey
    futures, ladder : int
        How many futures of each run, and of each of the many sizes of a ladder.
    seed : int
        The futures of the search and of the judgement are different ones.
    response : callable
        How the table answers.
    """

    def __init__(self, field: Survey, futures: int, ladder: int, seed: int, response: ResponseOf = as_asked) -> None:
        rehearsal = field.rehearsal
        self.family: Family = field.family
        self.rehearsal = rehearsal
        self.scouts = Population.of(rehearsal, SCOUTS, seed)
        self.ladder = Population.of(rehearsal, ladder, seed + 2)
        self.jury = Population.of(rehearsal, futures, seed + 1)
        self.body = parameters(rehearsal.block, rehearsal.restitution)
        self.rotation = initial_rotation(rehearsal.scene)
        self._response = response

    def verdict(self, size: float, shape: float) -> Verdict | None:
        """Return what is found of a run; None where the table does not make it exactly as asked."""
        rehearsal = admitted(self.family, size, shape)
        if rehearsal is None:
            return None
        variants = self.variants(rehearsal)
        found = self.jury.outcomes(variants)
        fallen = found.codes == OVERTURNED
        without = fallen & (found.impacts == 0)
        if self.rotation == 0.0:
            # See `twin.search.cells.count`: an impact of a leaning block that settles is none.
            from_rest = replace(self.jury, rotations=np.zeros(self.jury.count)).outcomes(variants)
            direct = (from_rest.codes == OVERTURNED) & (from_rest.impacts == 0)
            without = fallen & direct & (found.directions == from_rest.directions)
        overturning = probability_of(found)
        direct_share = Probability(overturning.count, int(np.sum(without)), overturning.undecided)
        return Verdict(size, shape, rehearsal, overturning, direct_share)

    def variants(self, rehearsal: Rehearsal) -> FloatArray:
        """Return the base motions of a run's futures, as the table makes them."""
        return shaking_of(rehearsal, self._response(rehearsal)).variants

    def climbed(self, shape: float, sizes: FloatArray, futures: Population) -> list[Probability]:
        """Return the probability of overturning at each size of a shape.

        What a table makes of a pulse that ends at rest is as much stronger as the pulse; a brake is always the same,
        and such a pulse is taken as asked.
        """
        top: Pulse | None = self.family.pulse(float(sizes[-1]), shape)
        rehearsal = admitted(self.family, float(sizes[-1]), shape)
        if top is None or rehearsal is None or self.family.capacity.machine is not None or ends_moving(top):
            pieces, possible = column(self.family, self.rehearsal, shape, sizes)
            found = count(futures, pieces)
            fallen, unknown = found.overturned.tolist(), found.undecided.tolist()
            return [
                Probability(found.count, fallen[k], unknown[k]) if possible[k] else Probability(found.count, 0)
                for k in range(len(sizes))
            ]
        variants = self.variants(rehearsal)
        return [futures.scaled(size / float(sizes[-1])).probability(variants) for size in sizes.tolist()]

    def proposal(self, verdict: Verdict, why: str, score: float, **numbers: float | str | None) -> Proposal:
        """Return the run as a proposal."""
        return Proposal(
            verdict.size,
            verdict.shape,
            verdict.rehearsal,
            self.family.words(verdict.size, verdict.shape),
            why,
            score,
            verdict.overturning,
            numbers,
        )


def interval(probability: Probability) -> str:
    """Return a confidence interval in words: "99.2-99.9 %"."""
    return f"{percent(probability.low)}-{percent(probability.high)} %"
