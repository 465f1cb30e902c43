"""How a table moves that is told where to be: its closed loop, what motor and switches do not allow, its mass."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from excitation.quantity import VALUE, quantity
from twin.rocking.compiled import FloatArray

LONGEST_STEP = 0.25e-3
"""No step of the table's motion is longer, s, nor longer than this share of its quickest time:"""
SHARE_OF_TIME = 0.1

_Limit = Annotated[float, quantity(above=0.0)]


@dataclass(frozen=True, config=VALUE)
class TableMechanics:
    """A table with what stands on it, as values: nothing here knows a device.

        x'' = w^2 (r - x) - 2 zeta w x'

    with r the set-point, linear between the ends of cycles and `delay` s late, as far as `strongest` allows; nothing
    in a direction in which the table is at its top speed or in which its switch cut the drive. Without a frequency the
    table follows its set-points exactly.

    Parameters
    ----------
    frequency, damping : float
        w / (2 pi), Hz, and zeta, both with the payload.
    delay : float
        From a set-point to the moment the loop takes it, s.
    strongest : float or None
        What the motor makes of the loaded table, m/s2.
    top_speed : float or None
        m/s, above which the drive does not push.
    switch, bumper : float or None
        Limit switch and bumper, m from the centre.
    bumper_stiffness, bumper_damping : float
        N/m, N s/m; a bumper pushes and never pulls.
    friction : float or None
        Without power, N.
    mass : float or None
        Of table and payload, kg; None where it is not known.
    source : str
        Where these numbers come from.

    Examples
    --------
    >>> TableMechanics(frequency=31.9, damping=0.78).follows_exactly
    False
    """

    frequency: Annotated[float, quantity("Hz", above=0.0)] | None = None
    damping: Annotated[float, quantity(above=0.0)] = 1.0
    delay: Annotated[float, quantity("s", at_least=0.0)] = 0.0
    strongest: _Limit | None = None
    top_speed: _Limit | None = None
    switch: _Limit | None = None
    bumper: _Limit | None = None
    bumper_stiffness: Annotated[float, quantity("N/m", at_least=0.0)] = 0.0
    bumper_damping: Annotated[float, quantity("N s/m", at_least=0.0)] = 0.0
    friction: Annotated[float, quantity("N", at_least=0.0)] | None = None
    mass: Annotated[float, quantity("kg", above=0.0)] | None = None
    source: Annotated[str, Field(max_length=500)] = "the table is taken to follow its command exactly"

    @property
    def follows_exactly(self) -> bool:
        """Whether the table is where it is told to be, at once."""
        return self.frequency is None

    @property
    def lag(self) -> float:
        """How far a slow motion comes behind its command, s: 2 zeta / w and the delay."""
        return self.delay + (0.0 if self.frequency is None else 2.0 * self.damping / (math.tau * self.frequency))

    @property
    def settling(self) -> float:
        """Time in which what a jump leaves has died away to 6e-6, s: twelve times that of the slower pole."""
        if self.frequency is None:
            return 0.0
        w, zeta = math.tau * self.frequency, self.damping
        slowest = zeta * w if zeta <= 1.0 else w * (zeta - math.sqrt(zeta * zeta - 1.0))
        return self.delay + 12.0 / slowest

    @property
    def braking(self) -> float:
        """Deceleration by friction alone, without power, m/s2; 0 where nothing is known of it."""
        return self.friction / self.mass if self.friction is not None and self.mass is not None else 0.0

    @property
    def numbers(self) -> FloatArray:
        """For compiled code: w, zeta, strongest, top speed, switch, bumper, its stiffness, damping; step."""
        mass = self.mass or 1.0
        w = 0.0 if self.frequency is None else math.tau * self.frequency
        stiff, soft = self.bumper_stiffness / mass, self.bumper_damping / mass
        fastest = max(math.sqrt(w * w + stiff), 2.0 * self.damping * w + soft)
        return np.array(
            [
                w,
                self.damping,
                math.inf if self.strongest is None else self.strongest,
                math.inf if self.top_speed is None else self.top_speed,
                math.inf if self.switch is None else self.switch,
                math.inf if self.bumper is None else self.bumper,
                stiff,
                soft,
                min(LONGEST_STEP, SHARE_OF_TIME / fastest) if fastest > 0.0 else LONGEST_STEP,
            ]
        )
