"""The emulated air track on a CAN bus: release device, cart, and sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.air_track.capacity import CAPACITY
from devices.air_track.plant import AirTrackPlant
from devices.air_track.settings import AirTrackMachine, AirTrackSettings
from devices.released_emulation import ReleasedEmulation
from devices.released_parameters import MeasuringParameters
from excitation import ConstantPulse

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.sample import Specimen
    from excitation import Capacity

_UNSET = ConstantPulse(2.0, 0.1)
"""What the operator has set the machine for, unless told."""


class EmulatedAirTrack(ReleasedEmulation):
    """An air track that is not there.

    Imitated: the release device with its error values and its watch over the host; the falling mass, coasting with
    friction, the bumper, the air supply; the latch's delay; encoder steps; the accelerometer's noise, bias and range;
    the specimen's motion under the cart's true acceleration, and its rotation.

    Not imitated: the block's reaction on the cart (a heavy cart hardly feels it), the masses of string and pulley,
    friction that grows with speed, a cart that tilts. The bumper is a shaped pulse of fixed length, not a spring.

    How it is served, and when the specimen is let go: `devices.emulation.Emulation`. Whenever a host starts its nodes
    while it is disarmed and at rest, the operator has put the cart back into its latch.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    rng : numpy.random.Generator
        Of all noise: equal seeds, equal frames.
    settings : AirTrackSettings, optional
        Mass, drop and start point; as for 2 m/s2 for 0.1 s unless told.
    payload : float
        Mass of the block, kg.
    specimen : callable, optional
        What stands on the cart; see `devices.sample.Specimen`. Without one there is no rotation sensor on the bus.
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
        settings: AirTrackSettings | None = None,
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
        if not isinstance(machine, AirTrackMachine):
            raise TypeError(f"capacity of {capacity.name} describes no air track")
        accelerometer_rng, rotation_rng = rng.spawn(2)
        plant = AirTrackPlant(
            machine,
            settings or machine.settings_for(_UNSET, capacity, payload=payload, coast=0.0),
            payload,
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
