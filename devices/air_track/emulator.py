"""The emulated air track on a CAN bus: release device, cart, and sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.air_track.capacity import CAPACITY
from devices.air_track.plant import AirTrackPlant
from devices.air_track.settings import AirTrackMachine, AirTrackSettings
from devices.released_emulation import ReleasedEmulation
from excitation import ConstantPulse

if TYPE_CHECKING:
    from devices.released_emulation import PlantParts
    from excitation.released import ReleasedMachine, Settings


class EmulatedAirTrack(ReleasedEmulation):
    """An air track that is not there.

    Imitated: the release device with its error values and its watch over the host; the falling mass, coasting with
    friction, the bumper, the air supply; the latch's delay; encoder steps; the accelerometer's noise, bias and range;
    the specimen's motion under the cart's true acceleration, and its rotation.

    Not imitated: the block's reaction on the cart (a heavy cart hardly feels it), the masses of string and pulley,
    friction that grows with speed, a cart that tilts. The bumper is a shaped pulse of fixed length, not a spring.

    How it is made: `devices.released_emulation.ReleasedEmulation`.
    """

    usual_capacity = CAPACITY
    usual_pulse = ConstantPulse(2.0, 0.1)

    def make_plant(
        self, machine: ReleasedMachine, settings: Settings, payload: float, parts: PlantParts
    ) -> AirTrackPlant:
        """Return the mechanics; `TypeError` where `machine` or `settings` are another machine's."""
        if not (isinstance(machine, AirTrackMachine) and isinstance(settings, AirTrackSettings)):
            raise TypeError(f"{type(machine).__name__} with {type(settings).__name__} describes no air track")
        return AirTrackPlant(machine, settings, payload, *parts)
