"""Homing (mode 6) of an emulated drive: the set-points that look for a limit switch, and where it was found.

Methods of CiA 402: 17 and 18 go to the negative or positive limit switch and come back to the edge where it lets go;
35 and 37 take the place where the table stands. Where that edge lies outside the software limits the drive goes on into
them, so that the next operation can begin; the standard leaves open where homing ends.
"""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia402.machine import Switches

DIRECTIONS = {17: -1.0, 18: 1.0}
"""Methods that look for a switch, and where it is."""
METHODS = (*DIRECTIONS, 35, 37)
"""Methods known here."""


class Phase(Enum):
    """What homing is doing."""

    SEARCH = "to the switch"
    RETURN = "back to its edge"
    INSIDE = "into the software limits"
    STOP = "coming to rest"
    ATTAINED = "done"
    FAILED = "failed"


class HomingSettings(NamedTuple):
    """How homing is to be done: method (6098), speeds m/s (6099), acceleration m/s2 (609A), cycle s."""

    method: int
    fast: float
    slow: float
    acceleration: float
    cycle_time: float


class Homing:
    """One homing, from rest at `position`, m; positions are the machine's own.

    Parameters
    ----------
    settings : HomingSettings
    position : float
        m.
    lower, upper : float
        Positions, m, beyond which no switch is expected: reaching one is a failure.
    inside : callable, optional
        Returns how far away from the edge found, both m, homing has to go on before it may end.

    Attributes
    ----------
    edge : float or None
        Measured position at which the switch let go, m.
    """

    def __init__(
        self,
        settings: HomingSettings,
        position: float,
        lower: float,
        upper: float,
        inside: Callable[[float], float] = lambda _: 0.0,
    ) -> None:
        self.position = position
        self.velocity = 0.0
        self.edge: float | None = None
        self.phase = Phase.SEARCH
        self._settings = settings
        self._bounds = lower, upper
        self._inside = inside
        self._direction = DIRECTIONS.get(settings.method, 0.0)
        self._failed = False
        if self._direction == 0.0:
            self.edge, self.phase = position, Phase.ATTAINED

    @property
    def acceleration(self) -> float:
        """m/s2, speeding up and slowing down."""
        return self._settings.acceleration

    @property
    def over(self) -> bool:
        """Whether it has ended, well or not; the set-point then stands still."""
        return self.phase in (Phase.ATTAINED, Phase.FAILED)

    def fail(self) -> None:
        """Give up: come to rest and say so."""
        if not self.over:
            self._failed, self.phase = True, Phase.STOP

    def step(self, switches: Switches, measured: float) -> float:
        """Return where the set-point is at the end of this cycle, m, from what is measured at its beginning."""
        s, away = self._settings, -self._direction
        active = switches.positive if self._direction > 0.0 else switches.negative
        if self.phase is Phase.SEARCH and active:
            self.phase = Phase.RETURN
        elif self.phase is Phase.RETURN and self.velocity * away > 0.0 and not active:
            self.edge = measured
            self.phase = Phase.INSIDE
        inside = self.edge is not None and away * (measured - self.edge) >= self._inside(self.edge)
        if self.phase is Phase.INSIDE and inside:
            self.phase = Phase.STOP
        wanted = {
            Phase.SEARCH: self._direction * s.fast,
            Phase.RETURN: away * s.slow,
            Phase.INSIDE: away * s.slow,
        }.get(self.phase, 0.0)
        change = wanted - self.velocity
        self.velocity += math.copysign(min(abs(change), s.acceleration * s.cycle_time), change)
        if self.phase is Phase.STOP and self.velocity == 0.0:
            self.phase = Phase.FAILED if self._failed else Phase.ATTAINED
        self.position += self.velocity * s.cycle_time
        lower, upper = self._bounds
        if (self.position > upper and self.velocity > 0.0) or (self.position < lower and self.velocity < 0.0):
            self.fail()
        return self.position
