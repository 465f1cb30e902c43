"""The twin of a run: the free prediction from measured base acceleration, and a foresight beside it."""

from __future__ import annotations

import math

from twin.foresight import Foresight
from twin.rocking.block import Block
from twin.rocking.track import TrackedBlock


class LiveTwin:
    """The twin's state, driven by measured base acceleration alone; a run, a rehearsal and a replay all use it.

    The acceleration is taken as linear between samples; where cycles were missed, across the gap. Beside this free
    prediction a `Foresight`, where there is one, follows the measured rotation and looks ahead.
    """

    def __init__(
        self,
        block: Block,
        restitution: float | None = None,
        initial_rotation: float = 0.0,
        foresight: Foresight | None = None,
    ) -> None:
        self.slenderness = block.slenderness
        self.foresight = foresight
        self._block = TrackedBlock(block, restitution, initial_rotation)
        self._time = math.nan
        self._acceleration = 0.0

    @property
    def block(self) -> TrackedBlock:
        """The predicted block."""
        return self._block

    def measure(self, time: float, acceleration: float, rotation: float = math.nan) -> float:
        """Take the acceleration (m/s2) measured at `time` (s, table's clock); return the rotation predicted there, rad.

        The first sample sets the clock: the block is let go at that instant. `rotation`, rad, is the measured one, for
        the foresight alone.
        """
        if time > self._time:
            self._block.advance(time - self._time, self._acceleration, acceleration)
        self._time = time
        self._acceleration = acceleration
        if self.foresight is not None:
            self.foresight.measure(time, acceleration, rotation)
        return self._block.rotation
