"""The motion a table makes of a planned run: samples at the ends of cycles, as the emulator makes them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from excitation import Record, TableRun
from excitation.pieces import Array
from excitation.pulse import Pulse
from twin.rocking.compiled import FloatArray
from twin.whole_run.following import ACCELERATION, POSITION, VELOCITY, follow
from twin.whole_run.mechanics import TableMechanics


@dataclass(frozen=True)
class Performed(Pulse):
    """The whole run as the table makes it: acceleration linear between the ends of the cycles.

    Parameters
    ----------
    planned : TableRun
    acceleration : ndarray, shape (n,)
        At the ends of cycles, m/s2, the first at time 0.
    cycle : float
        s.
    """

    planned: TableRun
    samples: FloatArray
    cycle: float

    @property
    def family(self) -> str:
        """That of the planned run."""
        return self.planned.family

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return f"performed {self.planned.kind}"

    def scaled(self, factor: float) -> Performed:
        """Return the same with its accelerations times `factor`."""
        return Performed(self.planned, self.samples * factor, self.cycle)

    def _rows(self) -> Array:
        return Record(self.samples, self.cycle, "performed")._rows()  # pyright: ignore[reportPrivateUsage]


@dataclass(frozen=True)
class Followed:
    """What the table is told and what it makes of it, at the ends of cycles.

    Attributes
    ----------
    motion : TableRun
        The plan.
    mechanics : TableMechanics
    cycle : float
        s.
    after : float
        Time the table is held at the end, s.
    """

    motion: TableRun
    mechanics: TableMechanics
    cycle: float
    after: float

    @cached_property
    def times(self) -> FloatArray:
        """Ends of the cycles, s, from 0 to where everything has settled."""
        last = math.ceil((self.motion.duration + self.after + self.mechanics.settling) / self.cycle)
        return np.arange(last + 1, dtype=np.float64) * self.cycle

    @cached_property
    def points(self) -> FloatArray:
        """Set-points, m."""
        return self.motion.displacement(self.times)

    @cached_property
    def made(self) -> FloatArray:
        """Position, velocity and acceleration of the table, shape (3, n); of the plan where it follows exactly."""
        made = np.zeros((3, self.times.size))
        if self.mechanics.follows_exactly:
            made[POSITION], made[VELOCITY] = self.points, self.motion.velocity(self.times)
            made[ACCELERATION] = self.motion.acceleration(self.times)
            return made
        made[POSITION, 0] = self.points[0]
        follow(self.mechanics.numbers, self.points, 0, self.cycle, self.mechanics.delay, made)
        return made

    @cached_property
    def base(self) -> Pulse:
        """What the block feels; the plan itself where it is followed exactly."""
        if self.mechanics.follows_exactly:
            return self.motion
        return Performed(self.motion, self.made[ACCELERATION], self.cycle)
