"""The emulated air track's mechanics: a falling mass, a coast, a bumper.

    while the mass falls:  (M + mh) x'' = mh g - M f
    then:                  x'' = -f sign(x')
    in the bumper:         a shaped change of speed from v to -e v (`excitation.shaper.EndStop`)

M is the cart with the block, f the deceleration by friction: on air, or with the air supply off.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.released_plant import HELD, ReleasedPlant
from excitation.pieces import Span, steady
from excitation.shaper import slide

if TYPE_CHECKING:
    import numpy as np

    from devices.air_track.settings import AirTrackMachine, AirTrackSettings
    from devices.released_parameters import MeasuringParameters
    from devices.sample import Specimen

PULSE, COAST, BUMPER, COAST_BACK = "pulse", "coast", "bumper", "coast back"
_NEXT = {PULSE: COAST, COAST: BUMPER, BUMPER: COAST_BACK}
# Velocity that a leg which ends at rest may leave, m/s.
_ROUNDING = 1e-12


class AirTrackPlant(ReleasedPlant):
    """The cart on its track. Friction is the same at every speed; string and pulley have no mass.

    Parameters
    ----------
    machine : AirTrackMachine
    settings : AirTrackSettings
        Mass, drop and start point as the operator has set them.
    payload : float
        Mass of the block on the cart, kg.
    parameters, cycle_time, rng, specimen, rotation
        As of `ReleasedPlant`.
    """

    def __init__(
        self,
        machine: AirTrackMachine,
        settings: AirTrackSettings,
        payload: float,
        parameters: MeasuringParameters,
        cycle_time: float,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        rotation: float = 0.0,
    ) -> None:
        self.machine = machine
        self.settings = settings
        self._cart = machine.cart + payload
        super().__init__(parameters, cycle_time, rng, specimen, rotation)

    def set_up(self) -> None:
        """Put the cart back into its latch, with the air supply on."""
        self._friction = self.machine.friction
        super().set_up()

    @property
    def air(self) -> bool:
        """Whether the air supply is on; switched, the cart goes on from where it is with the other friction."""
        return self._friction == self.machine.friction

    @air.setter
    def air(self, on: bool) -> None:
        if on is self.air:
            return
        self._friction = self.machine.friction if on else self.machine.braking_friction
        if self.leg in (PULSE, COAST, COAST_BACK):
            self._enter(self.leg, self._leg(self.leg))

    def _after(self, leg: str) -> tuple[str, list[Span]] | None:
        if leg == HELD:
            following = PULSE
        elif abs(self.velocity) <= _ROUNDING or leg == COAST_BACK:
            return None
        else:
            following = _NEXT[leg]
        return following, self._leg(following)

    def _leg(self, leg: str) -> list[Span]:
        """Return a leg from here."""
        x, v, f = self.position, self.velocity, self._friction
        if leg == PULSE:
            mass, fall = self.settings.mass, max(self.settings.drop - x, 0.0)
            a = (mass * self.machine.gravity - self._cart * f) / (self._cart + mass)
            if a > 0.0:
                return [steady(2.0 * fall / (v + math.sqrt(v * v + 2.0 * a * fall)), a)]
            # Friction holds the mass up: it brakes the cart, and keeps it where it stops.
            return [steady(slide(v, -a, fall)[0], a)] if v > 0.0 else []
        if leg == COAST:
            return [steady(slide(v, f, max(self.settings.start - x, 0.0))[0], -f)]
        if leg == BUMPER:
            return self.machine.end_stop.stop(v)
        return [steady(-v / f, f)]
