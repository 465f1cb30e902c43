"""What emulated released machines share: the nodes of a release device and its sensors, around a plant."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia401.release import PATIENCE, ReleaseDevice
from devices.emulation import Emulation
from devices.released_driver import (
    ACCELERATION_NODE,
    INCLINOMETER_NODE,
    POSITION_NODE,
    RELEASE_NODE,
    ROTATION_NODE,
)
from devices.sensors.displacements import DisplacementPair, displacement_inputs
from devices.sensors.inclinometer import inclinometer_on
from devices.sensors.measuring import acceleration_input, position_encoder
from devices.sensors.rotation import RotationSensor

if TYPE_CHECKING:
    import numpy as np

    from devices.cia301.node import Device
    from devices.released_plant import ReleasedPlant


class ReleasedEmulation(Emulation):
    """A machine that is released and not there. Its subclass makes the plant and hands it to `build`.

    Attributes
    ----------
    plant : ReleasedPlant
    release_device : ReleaseDevice
    """

    plant: ReleasedPlant
    release_device: ReleaseDevice

    def build(
        self,
        plant: ReleasedPlant,
        rng: np.random.Generator,
        *,
        specimen: bool,
        rotation_step: float,
        rotation_noise: float,
        beams: tuple[float, float, float, float] | None,
        inclinometer: bool,
        shared_clock: bool,
    ) -> None:
        """Put the plant's nodes on the bus: release device, position, acceleration and, with a specimen, its rotation.

        The rotation comes from an encoder, or from two displacement sensors where `beams` are given: width and height
        of the block, heights of the sensors, m.
        """
        self.plant = plant
        self.release_device = ReleaseDevice(RELEASE_NODE, self.send, plant, shared_clock=shared_clock)
        devices: list[Device] = [
            self.release_device,
            position_encoder(POSITION_NODE, self.send, plant.measure_position),
            acceleration_input(ACCELERATION_NODE, self.send, plant.measure_acceleration),
        ]
        if specimen and beams is not None:
            width, height, lower, upper = beams
            pair = DisplacementPair(lambda: plant.rotation, width, height, (lower, upper))
            devices.append(displacement_inputs(ROTATION_NODE, self.send, pair))
        elif specimen:
            devices.append(
                RotationSensor(
                    ROTATION_NODE,
                    self.send,
                    lambda: plant.rotation,
                    quantum=rotation_step,
                    noise=rotation_noise,
                    rng=rng,
                )
            )
        if inclinometer:
            devices.append(
                inclinometer_on(INCLINOMETER_NODE, self.send, lambda: plant.rotation, lambda: plant.acceleration)
            )
        self.attach(plant, devices)

    @property
    def powered(self) -> bool:
        """Whether the machine is armed, or moving after its release."""
        return self.release_device.armed or not self.plant.at_rest

    @property
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""
        return self.release_device.at_ease

    def patience(self, idle_cycles: int) -> int:
        """Return few cycles once it was released; a host that has only armed it is waited for."""
        return idle_cycles if self.plant.held else PATIENCE

    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC."""
        self.release_device.elapse(cycles)
