"""A block followed sample by sample: base acceleration in, state out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.rocking.block import Block
from twin.rocking.march import FELL, FULL, march
from twin.rocking.run import NOTHING_STEPS, initial_state, local_tolerance, parameters, signed
from twin.rocking.series import scratch
from twin.rocking.state import EVENT_COLUMNS, IMPACT, OVERTURNED, REST, SIDE, TIME, UPLIFT

EVENT_NAMES = {IMPACT: "impact", UPLIFT: "uplift", REST: "rest", OVERTURNED: "overturned"}
EVENTS_AT_ONCE = 32
LYING = 0.5 * np.pi


class BlockEvent(NamedTuple):
    """What happened to the block: time on its own clock s, name, rate rad/s (just before an impact, signed)."""

    time: float
    name: str
    rate: float


class TrackedBlock:
    """The state of a block on a base whose acceleration becomes known sample by sample, linear in between.

    Contract: `advance` is the only way on; equal calls give equal bits; impacts lie at their exact times inside the
    sample; once overturned the block lies at +-pi/2. The live twin and the emulated specimen are both of this kind.

    Parameters
    ----------
    block : Block
    restitution : float, optional
        None: Housner's.
    initial_rotation : float
        rad, signed; the block is let go at time 0.
    tolerance : float
        As in `simulate`.
    """

    def __init__(
        self,
        block: Block,
        restitution: float | None = None,
        initial_rotation: float = 0.0,
        tolerance: float = 1e-10,
    ) -> None:
        eta = block.housner_restitution if restitution is None else restitution
        self._body = parameters(block, eta, local_tolerance(tolerance))
        self._state = initial_state(self._body, initial_rotation)
        self._piece = np.zeros(7)
        self.events: list[BlockEvent] = []
        """What happened in the last sample, in order."""
        self._events = np.zeros((EVENTS_AT_ONCE, EVENT_COLUMNS))
        self._used = np.zeros(3)
        self._scratch = scratch()
        self.rotation, self.angular_velocity = signed(self._body, self._state)

    def advance(self, duration: float, start_acceleration: float, end_acceleration: float) -> float:
        """Go on by `duration` s under an acceleration (m/s2) linear between its ends; return the rotation, rad."""
        state = self._state
        start = state[TIME]
        end = start + duration
        piece = self._piece
        piece[0] = start
        piece[1] = end
        piece[2] = start_acceleration
        piece[3] = (end_acceleration - start_acceleration) / duration
        self.events.clear()
        code = FULL if abs(self.rotation) < LYING else FELL
        while code == FULL:
            self._used[1] = 0.0
            code = march(self._body, state, piece, end, NOTHING_STEPS, self._events, self._used, *self._scratch)
            if self._used[1] > 0.0:
                self._take_events()
        state[TIME] = end
        self.rotation, self.angular_velocity = signed(self._body, state)
        if abs(self.rotation) >= LYING:
            self.angular_velocity = 0.0
        return self.rotation

    @property
    def time(self) -> float:
        """Time reached, s, 0 at the start."""
        return float(self._state[TIME])

    @property
    def resting(self) -> bool:
        """Whether the block stands still, or lies."""
        return bool(self._state[SIDE] == 0.0) or abs(self.rotation) >= LYING

    @property
    def overturned(self) -> bool:
        """Whether the rotation has reached pi/2."""
        return abs(self.rotation) >= LYING

    def _take_events(self) -> None:
        for t, rate, code in self._events[: int(self._used[1])]:
            self.events.append(BlockEvent(float(t), EVENT_NAMES[float(code)], float(rate)))


def warm_up() -> None:
    """Compile, or load, the machine code now rather than in the first cycle."""
    TrackedBlock(Block(0.06, 0.27), initial_rotation=0.01).advance(1e-3, 0.0, 0.1)
