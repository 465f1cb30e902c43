"""What is studied: one block under one pulse, from a tilt at rest."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from excitation import Pulse
from twin.rocking.block import Block
from twin.rocking.response import Response
from twin.rocking.restitution import restitution_ratio
from twin.scene import Scene
from twin.simulation import simulate


@dataclass(frozen=True, slots=True)
class Case:
    """One block and what is done to it.

    Attributes
    ----------
    block : Block
    restitution : float or None
        Ratio of angular velocities over an impact; None: Housner's, of each block that is looked at.
    pulse : Pulse or None
        The base motion, alone: no way to the start, no brake. None: free rocking.
    tilt : float
        Rotation, rad, from which the block is let go as the pulse begins.
    """

    block: Block
    restitution: float | None
    pulse: Pulse | None
    tilt: float = 0.0

    @property
    def eta(self) -> float:
        """Ratio of angular velocities over an impact."""
        return restitution_ratio(self.block, self.restitution)

    @property
    def relative_tilt(self) -> float:
        """The tilt in units of alpha."""
        return self.tilt / self.block.slenderness

    def of_slenderness(self, alpha: float) -> Case:
        """Return the case of a block of the same diagonal, its slenderness angle `alpha` (rad), tilted as far of it."""
        diagonal = 2.0 * self.block.half_diagonal
        block = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha), self.block.mass, self.block.gravity)
        return replace(self, block=block, tilt=self.relative_tilt * alpha)

    def response(self, model: str, tilt: float | None = None, rate: float = 0.0) -> Response:
        """Return the answer of a model, from `tilt` (rad; None: the case's) and `rate` (rad/s)."""
        return simulate(
            self.block,
            self.pulse,
            restitution=self.restitution,
            initial_rotation=self.tilt if tilt is None else tilt,
            initial_angular_velocity=rate,
            model=model,
        )


def case_of(scene: Scene) -> Case:
    """Return what a scene asks of its block, the pulse unclipped; raises `InputError`."""
    block = scene.block
    return Case(block.block(), block.restitution, scene.pulse(), math.radians(block.initial_rotation_deg))
