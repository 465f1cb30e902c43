"""The emulated ROORI1's mechanics: a blow, a slide over the stop gap, a stopper.

    struck:       a shaped change of speed from 0 to v (`excitation.shaper.PulseShaper`)
    then:         x'' = -f sign(x')
    at the stop:  a shaped change of speed from v1 to -e v1

f is the deceleration by friction. Shapes, times, f and e are not published: they are parameters of `Roori1Machine`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.released_plant import HELD, ReleasedPlant
from excitation.pieces import Span, steady
from excitation.shaper import slide

if TYPE_CHECKING:
    import numpy as np

    from devices.released_parameters import MeasuringParameters
    from devices.roori1.settings import Roori1Machine, Roori1Settings
    from devices.sample import Specimen

PULSE, SLIDE, STOPPER, SLIDE_BACK = "pulse", "slide", "stopper", "slide back"
_ROUNDING = 1e-12


class Roori1Plant(ReleasedPlant):
    """The struck base. The projectile leaves it in the instant in which the shaper has done its work.

    Parameters
    ----------
    machine : Roori1Machine
    settings : Roori1Settings
        Velocity and gap as the operator has set them.
    parameters, cycle_time, rng, specimen, rotation
        As of `ReleasedPlant`.
    """

    def __init__(
        self,
        machine: Roori1Machine,
        settings: Roori1Settings,
        parameters: MeasuringParameters,
        cycle_time: float,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        rotation: float = 0.0,
    ) -> None:
        self.machine = machine
        self.settings = settings
        super().__init__(parameters, cycle_time, rng, specimen, rotation)

    def _after(self, leg: str) -> tuple[str, list[Span]] | None:
        v, f = self.velocity, self.machine.friction
        if leg == HELD:
            return PULSE, self.machine.striker.change(self.settings.velocity)
        if abs(v) <= _ROUNDING or leg == SLIDE_BACK:
            return None
        if leg == PULSE:
            return SLIDE, [steady(slide(v, f, max(self.settings.gap - self.position, 0.0))[0], -f)]
        if leg == SLIDE:
            return STOPPER, self.machine.end_stop.stop(v)
        return SLIDE_BACK, [steady(-v / f, f)]
