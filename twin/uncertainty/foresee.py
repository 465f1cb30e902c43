"""What may happen instead of the predicted run: futures drawn from what is not known exactly, and what they come to."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from excitation import Pulse
from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.batch.codes import OVERTURNED
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Response
from twin.rocking.run import parameters
from twin.rocking.state import RESTITUTION
from twin.simulation import simulate
from twin.uncertainty.boundary import FINE_FUTURES, Boundary, amplitude_boundary, frequency_boundary, level
from twin.uncertainty.causes import Cause, causes_of
from twin.uncertainty.motion import BaseMotion, scaled
from twin.uncertainty.population import Population, probability_of
from twin.uncertainty.probability import Probability
from twin.uncertainty.shaking import shaking_of
from twin.uncertainty.table import AS_ASKED, TableResponse

SHOWN = 40
"""Futures followed in full, for the picture."""
LEVELS = (0.01, 0.5)
AFFORDED, FEWEST = 2_000_000, 200
"""Pieces of base motion times futures, and the fewest futures, where the scene does not say how many: an earthquake
record of 4000 pieces gets 500."""


@dataclass(frozen=True, slots=True)
class Uncertain:
    """What became of the futures of a run.

    Attributes
    ----------
    wanted : int
        Futures the scene has: more than were drawn where the base motion is long.
    probability : Probability
        Of overturning.
    directions : tuple of int
        Futures that fall to -x and to +x.
    impacts : dict
        Impacts before it falls -> futures.
    causes : tuple of Cause
        The greatest effect first.
    amplitude, frequency : Boundary or None
        How far the nominal block's outcome is from another one; None where nothing shakes.
    levels : dict
        Probability -> factor of amplitude at which it is first reached, None where it is not within 50 %.
    table : str
        How the table's own motion is known.
    made : Pulse
        The base motion without its spread, from `start` on.
    nominal : Response
        The scene's own block under `made`.
    responses : tuple of Response
        The first futures in full; their time 0 is `start` s after the start of the run.
    start : float
        s.
    """

    wanted: int
    probability: Probability
    directions: tuple[int, int]
    impacts: dict[int, int]
    causes: tuple[Cause, ...]
    amplitude: Boundary | None
    frequency: Boundary | None
    levels: dict[float, float | None]
    table: str
    made: Pulse
    nominal: Response
    responses: tuple[Response, ...]
    start: float


def foresee(rehearsal: Rehearsal, response: TableResponse = AS_ASKED) -> Uncertain:
    """Draw the scene's futures, on a table that answers with `response`, and ask what decides between them."""
    shaking = shaking_of(rehearsal, response)
    population = Population.of(rehearsal, _count(rehearsal, len(shaking.made)))
    found = population.outcomes(shaking.variants)
    fell = found.codes == OVERTURNED
    impacts: list[int] = found.impacts[fell].tolist()
    shaken = rehearsal.given is not None
    gain = 1.0 + 0.01 * rehearsal.scene.spreads.table.gain_percent.centre(0.0)
    made = scaled(shaking.made, gain)
    fine = shaking.affordable(FINE_FUTURES)
    tilt = initial_rotation(rehearsal.scene)
    body = parameters(rehearsal.block, rehearsal.restitution)
    return Uncertain(
        rehearsal.scene.spreads.futures,
        probability_of(found),
        (int(np.sum(found.directions[fell] < 0)), int(np.sum(found.directions[fell] > 0))),
        dict(sorted(Counter(impacts).items())),
        causes_of(rehearsal, response, population, shaking, found),
        amplitude_boundary(body, made, tilt) if shaken else None,
        frequency_boundary(body, made, tilt) if shaken else None,
        {p: level(population, shaking.variants, p, fine) if shaken else None for p in LEVELS},
        response.source,
        BaseMotion(made),
        simulate(rehearsal.block, BaseMotion(made), restitution=rehearsal.restitution, initial_rotation=tilt),
        tuple(_followed(rehearsal, population, shaking.variants, k) for k in range(min(SHOWN, population.count))),
        shaking.start,
    )


def _count(rehearsal: Rehearsal, pieces: int) -> int:
    """Return how many futures are drawn on a base motion of so many pieces."""
    spreads = rehearsal.scene.spreads
    return spreads.futures if spreads.asked else min(spreads.futures, max(AFFORDED // pieces, FEWEST))


def _followed(rehearsal: Rehearsal, population: Population, variants: FloatArray, index: int) -> Response:
    """Return one future in full."""
    motion = min(int(population.shapes[index] * len(variants)), len(variants) - 1)
    rows = scaled(variants[motion], float(population.factors[index]))
    return simulate(
        population.block(index, rehearsal.block),
        BaseMotion(rows),
        restitution=float(population.bodies[index, RESTITUTION]),
        initial_rotation=float(population.rotations[index]),
    )
