"""The emulated ROORI1 on a CAN bus: release device, base, and sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.released_emulation import ReleasedEmulation
from devices.released_parameters import MeasuringParameters
from devices.roori1.capacity import CAPACITY
from devices.roori1.plant import Roori1Plant
from devices.roori1.settings import Roori1Machine, Roori1Settings
from excitation import DoublePulse

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.sample import Specimen
    from excitation import Capacity

_UNSET = DoublePulse(0.2, 0.02)
"""What the operator has set the machine for, unless told."""


class EmulatedRoori1(ReleasedEmulation):
    """ROORI1 that is not there.

    Imitated: the release device with its error values and its watch over the host; the blow, sliding with friction, the
    stopper with its rebound; the launcher's delay; encoder steps; the accelerometer's noise, bias and range; the
    specimen's motion under the base's true acceleration, and its rotation.

    Not imitated: the projectile itself, scatter of the launch, the block's reaction on the base and on the speed it
    gets, vibration after the blows.

    How it is served, and when the specimen is let go: `devices.emulation.Emulation`. Whenever a host starts its nodes
    while it is disarmed and at rest, the operator has put the base back into its latch.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    rng : numpy.random.Generator
        Of all noise: equal seeds, equal frames.
    settings : Roori1Settings, optional
        Velocity and gap; as for 0.2 m/s and 20 mm unless told.
    payload : float
        Mass of the block, kg; the launcher is set for the base as it is loaded.
    specimen : callable, optional
        What stands on the base; see `devices.sample.Specimen`. Without one there is no rotation sensor on the bus.
    set_up : callable, optional
        Called as the machine is armed: puts the specimen back to `initial_rotation`.
    capacity : excitation.Capacity
        With its `machine`.
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
    """

    def __init__(
        self,
        bus: CanBus,
        *,
        rng: np.random.Generator,
        settings: Roori1Settings | None = None,
        payload: float = 0.0,
        specimen: Specimen | None = None,
        set_up: Callable[[], None] | None = None,
        capacity: Capacity = CAPACITY,
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
        machine = capacity.machine
        if not isinstance(machine, Roori1Machine):
            raise TypeError(f"capacity of {capacity.name} describes no ROORI1")
        accelerometer_rng, rotation_rng = rng.spawn(2)
        plant = Roori1Plant(
            machine,
            settings or machine.settings_for(_UNSET, capacity, payload=payload, coast=0.0),
            parameters or MeasuringParameters(),
            cycle_time,
            accelerometer_rng,
            specimen,
            initial_rotation,
        )
        self.build(
            plant,
            rotation_rng,
            specimen=specimen is not None,
            rotation_step=rotation_step,
            rotation_noise=rotation_noise,
            beams=beams,
            inclinometer=inclinometer,
            shared_clock=shared_clock,
        )
