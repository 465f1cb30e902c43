"""What emulated released machines share: the nodes of a release device and its sensors, around a plant."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING, ClassVar

from devices.cia401.release import PATIENCE, ReleaseDevice
from devices.emulation import Emulation
from devices.released_driver import (
    ACCELERATION_NODE,
    INCLINOMETER_NODE,
    POSITION_NODE,
    RELEASE_NODE,
    ROTATION_NODE,
)
from devices.released_parameters import MeasuringParameters
from devices.sensors.displacements import DisplacementPair, displacement_inputs
from devices.sensors.inclinometer import inclinometer_on
from devices.sensors.measuring import acceleration_input, position_encoder
from devices.sensors.rotation import RotationSensor

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia301.buses import CanBus
    from devices.cia301.node import Device
    from devices.clock import Clock
    from devices.released_plant import ReleasedPlant
    from devices.sample import Specimen
    from excitation import Capacity, Pulse
    from excitation.released import ReleasedMachine, Settings

    PlantParts = tuple[MeasuringParameters, float, np.random.Generator, Specimen | None, float]
    """What every plant is made with: sensors, cycle time, noise, specimen, its rotation."""


class ReleasedEmulation(Emulation):
    """A machine that is released and not there. Its subclass makes the plant, and says what is imitated.

    How it is served, and when the specimen is let go: `devices.emulation.Emulation`. Whenever a host starts its nodes
    while it is disarmed and at rest, the operator has put the base back into its latch.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    rng : numpy.random.Generator
        Of all noise: equal seeds, equal frames.
    settings : Settings, optional
        What the operator has set; as for `usual_pulse` unless told.
    payload : float
        Mass of the block, kg; the machine is set for the base as it is loaded.
    specimen : callable, optional
        What stands on the base; see `devices.sample.Specimen`. Without one there is no rotation sensor on the bus.
    set_up : callable, optional
        Called as the machine is armed: puts the specimen back to `initial_rotation`.
    capacity : excitation.Capacity, optional
        With its `machine`; `usual_capacity` unless told.
    cycle_time : float
        s.
    parameters : MeasuringParameters, optional
    clock : Clock, optional
        Of heartbeats and, in `serve`, of the SYNC watchdog.
    initial_rotation : float
        Of the specimen, rad.
    rotation_step, rotation_noise : float
        Of the rotation encoder, rad.
    beams : tuple of float, optional
        Width and height of the block and heights of two displacement sensors, m, which measure its rotation instead.
    inclinometer : bool
        Whether there is one on the block.
    shared_clock : bool
        Whether the host runs on the same thread, so that both stand still together.

    Attributes
    ----------
    plant : ReleasedPlant
    release_device : ReleaseDevice

    Raises
    ------
    TypeError
        Where `capacity` or `settings` are another machine's.
    """

    usual_capacity: ClassVar[Capacity]
    usual_pulse: ClassVar[Pulse]

    def __init__(
        self,
        bus: CanBus,
        *,
        rng: np.random.Generator,
        settings: Settings | None = None,
        payload: float = 0.0,
        specimen: Specimen | None = None,
        set_up: Callable[[], None] | None = None,
        capacity: Capacity | None = None,
        cycle_time: float = 1e-3,
        parameters: MeasuringParameters | None = None,
        clock: Clock | None = None,
        initial_rotation: float = 0.0,
        rotation_step: float = 1e-4,
        rotation_noise: float = 0.0,
        beams: tuple[float, float, float, float] | None = None,
        inclinometer: bool = False,
        shared_clock: bool = False,
    ) -> None:
        super().__init__(bus, cycle_time=cycle_time, clock=clock, set_up=set_up, initial_rotation=initial_rotation)
        capacity = capacity or self.usual_capacity
        machine = capacity.machine
        if machine is None:
            raise TypeError(f"capacity of {capacity.name} describes no released machine")
        accelerometer_rng, rotation_rng = rng.spawn(2)
        given = settings or machine.settings_for(self.usual_pulse, capacity, payload=payload, coast=0.0)
        sensors = parameters or MeasuringParameters()
        parts = (sensors, cycle_time, accelerometer_rng, specimen, initial_rotation)
        self.plant = plant = self.make_plant(machine, given, payload, parts)
        self.release_device = ReleaseDevice(RELEASE_NODE, self.send, plant, shared_clock=shared_clock)
        devices: list[Device] = [
            self.release_device,
            position_encoder(POSITION_NODE, self.send, plant.measure_position),
            acceleration_input(ACCELERATION_NODE, self.send, plant.measure_acceleration),
        ]
        if specimen is not None and beams is not None:
            width, height, lower, upper = beams
            pair = DisplacementPair(lambda: plant.rotation, width, height, (lower, upper))
            devices.append(displacement_inputs(ROTATION_NODE, self.send, pair))
        elif specimen is not None:
            devices.append(
                RotationSensor(
                    ROTATION_NODE,
                    self.send,
                    lambda: plant.rotation,
                    quantum=rotation_step,
                    noise=rotation_noise,
                    rng=rotation_rng,
                )
            )
        if inclinometer:
            devices.append(
                inclinometer_on(INCLINOMETER_NODE, self.send, lambda: plant.rotation, lambda: plant.acceleration)
            )
        self.attach(plant, devices)

    @abstractmethod
    def make_plant(
        self, machine: ReleasedMachine, settings: Settings, payload: float, parts: PlantParts
    ) -> ReleasedPlant:
        """Return the machine's mechanics; `TypeError` where `machine` or `settings` are another's."""

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
