"""The emulated ROORI1 on a CAN bus: release device, base, and sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.released_emulation import ReleasedEmulation
from devices.roori1.capacity import CAPACITY
from devices.roori1.plant import Roori1Plant
from devices.roori1.settings import Roori1Machine, Roori1Settings
from excitation import DoublePulse

if TYPE_CHECKING:
    from devices.released_emulation import PlantParts
    from excitation.released import ReleasedMachine, Settings


class EmulatedRoori1(ReleasedEmulation):
    """ROORI1 that is not there.

    Imitated: the release device with its error values and its watch over the host; the blow, sliding with friction, the
    stopper with its rebound; the launcher's delay; encoder steps; the accelerometer's noise, bias and range; the
    specimen's motion under the base's true acceleration, and its rotation.

    Not imitated: the projectile itself, scatter of the launch, the block's reaction on the base and on the speed it
    gets, vibration after the blows.

    How it is made: `devices.released_emulation.ReleasedEmulation`.
    """

    usual_capacity = CAPACITY
    usual_pulse = DoublePulse(0.2, 0.02)

    def make_plant(
        self,
        machine: ReleasedMachine,
        settings: Settings,
        payload: float,  # noqa: ARG002 - the launcher is set for it
        parts: PlantParts,
    ) -> Roori1Plant:
        """Return the mechanics; `TypeError` where `machine` or `settings` are another machine's."""
        if not (isinstance(machine, Roori1Machine) and isinstance(settings, Roori1Settings)):
            raise TypeError(f"{type(machine).__name__} with {type(settings).__name__} describes no ROORI1")
        return Roori1Plant(machine, settings, *parts)
