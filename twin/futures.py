"""What may happen instead: the planned run with restitution, slenderness and initial tilt drawn from their spreads."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.block import Block
from twin.rocking.response import Response
from twin.rocking.run import parameters
from twin.simulation import overturns, simulate

SHOWN = 40
"""Futures followed in full, for the picture."""
LARGEST_TILT = 1.5
"""rad; a spread that reaches beyond is cut here."""


@dataclass(frozen=True, slots=True)
class Futures:
    """What became of `count` runs with restitution, slenderness and initial tilt drawn from their spreads.

    `responses` are the first of them in full; their time 0 is `start` s after the start of the run.
    """

    count: int
    overturned: int
    undecided: int
    responses: tuple[Response, ...]
    start: float


def draw_futures(rehearsal: Rehearsal) -> Futures:
    """Draw the scene's number of futures from normal spreads, with its seed.

    The slenderness changes at the same diagonal. A scene that lets the block go with a tilt spreads that tilt, at the
    start of the run; any other has the block leaning, at rest, by the tilt drawn as the pulse begins (the perturbed
    initial condition of Ceh 2018, section 3.5).
    """
    scene, motion = rehearsal.scene, rehearsal.motion
    twin = scene.twin
    rng = np.random.default_rng(twin.seed)
    tilt = initial_rotation(scene)
    from_rest = tilt == 0.0 and rehearsal.given is not None
    shaken = motion.shaking if from_rest else motion
    fallen = undecided = 0
    responses: list[Response] = []
    for _ in range(twin.futures):
        z = rng.standard_normal(3)
        block = _slenderer(rehearsal.block, 0.01 * twin.slenderness_spread_percent * z[1])
        eta = min(max(rehearsal.restitution + twin.restitution_spread * z[0], 0.0), 1.0)
        start = tilt + math.radians(twin.initial_tilt_spread_deg) * z[2]
        start = min(max(start, -LARGEST_TILT), LARGEST_TILT)
        verdict = overturns(parameters(block, eta), shaken.pieces, rotation=start)
        fallen += verdict is True
        undecided += verdict is None
        if len(responses) < SHOWN:
            responses.append(simulate(block, shaken, restitution=eta, initial_rotation=start))
    return Futures(twin.futures, fallen, undecided, tuple(responses), motion.pulse_start if from_rest else 0.0)


def _slenderer(block: Block, change: float) -> Block:
    """Return the block with its slenderness angle changed by a share of it, at the same diagonal."""
    alpha = min(max(block.slenderness * (1.0 + change), 1e-3), 0.5 * math.pi - 1e-3)
    diagonal = 2.0 * block.half_diagonal
    return Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha), block.mass, block.gravity)
