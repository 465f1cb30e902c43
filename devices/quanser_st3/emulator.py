"""The emulated ST-III on a CAN bus: servo drive, table, and the rotation sensor of the specimen standing on it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia402.drive import Drive, DriveOptions
from devices.cia402.states import State
from devices.emulation import Emulation
from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.driver import DRIVE_NODE, SENSOR_NODE
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant
from devices.sensors.rotation import RotationSensor

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.sample import Specimen
    from excitation import Capacity

_OFF = (State.NOT_READY, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.FAULT)


class EmulatedSt3(Emulation):
    """A Quanser ST-III that is not there.

    Imitated: the CiA 402 drive with its state machine, refusal of set-points beyond the capacity, stopping by itself;
    the closed loop's second-order lag and its transport delay, slower with a payload; what current and speed do not
    allow; limit switches and bumpers; encoder steps; the accelerometer's noise, bias and range; the specimen's motion
    under the table's true acceleration, and its rotation sensor. All of it in numbers: `St3Parameters`.

    Not imitated: the force of a rocking specimen on the table, flexible parts and the motor's electrical lag, a
    current that is limited in the mean, the second axis. Set-points never leave the stroke, but the loop overshoots
    them: by 26 um where the empty table brakes with 9.81 m/s2 to the very end.

    How it is served, and when the specimen is let go: `devices.emulation.Emulation`; the first `exchange` after
    `enable` finds the specimen two cycles old, and the table stays where it stopped. `DriveOptions.shared_clock` says
    to the drive that the host is on its thread.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    rng : numpy.random.Generator
        Of all noise: equal seeds, equal frames.
    specimen : callable, optional
        What stands on the table; see `devices.sample.Specimen`. Without one there is no rotation sensor on the bus.
    set_up : callable, optional
        Called as the power comes on: puts the specimen back to `initial_rotation`. Without it the specimen stays as the
        last run left it.
    capacity : excitation.Capacity
    cycle_time : float
        s.
    parameters : St3Parameters, optional
    payload : float
        Mass of what stands on the table, kg.
    options : DriveOptions, optional
    clock : Clock, optional
        Of heartbeats and, in `serve`, of the SYNC watchdog.
    initial_position, initial_rotation : float
        Of table, m, and specimen, rad.
    rotation_step, rotation_noise : float
        Of the rotation sensor, rad.
    drive_node, sensor_node : int
        CANopen node numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from devices.cia301.buses import open_bus
    >>> from devices.quanser_st3.driver import open_table
    >>> with open_bus("virtual", "example") as host, open_bus("virtual", "example") as node:
    ...     emulator = EmulatedSt3(node, rng=np.random.default_rng(1), specimen=lambda duration, start, end: 0.02)
    ...     with open_table(host, idle=emulator.service) as table:
    ...         table.enable(0.0)
    ...         samples = [table.exchange(cycle, 1e-6 * cycle) for cycle in range(3)]
    >>> samples[-1].cycle, samples[-1].rotation
    (2, 0.02)
    """

    def __init__(
        self,
        bus: CanBus,
        *,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        set_up: Callable[[], None] | None = None,
        capacity: Capacity = CAPACITY,
        cycle_time: float = 1e-3,
        parameters: St3Parameters | None = None,
        payload: float = 0.0,
        options: DriveOptions | None = None,
        clock: Clock | None = None,
        initial_position: float = 0.0,
        initial_rotation: float = 0.0,
        rotation_step: float = 1e-4,
        rotation_noise: float = 0.0,
        drive_node: int = DRIVE_NODE,
        sensor_node: int = SENSOR_NODE,
    ) -> None:
        super().__init__(bus, cycle_time=cycle_time, clock=clock, set_up=set_up, initial_rotation=initial_rotation)
        accelerometer_rng, rotation_rng = rng.spawn(2)
        self.plant = St3Plant(
            parameters or St3Parameters(),
            cycle_time,
            accelerometer_rng,
            specimen,
            initial_position,
            initial_rotation,
            payload=payload,
            half_stroke=0.5 * capacity.stroke,
        )
        self.drive = Drive(
            drive_node, self.send, self.plant, capacity, cycle_time, position=initial_position, options=options
        )
        self.sensor: RotationSensor | None = None
        if specimen is not None:
            self.sensor = RotationSensor(
                sensor_node,
                self.send,
                lambda: self.plant.rotation,
                quantum=rotation_step,
                noise=rotation_noise,
                rng=rotation_rng,
            )
        self.attach(self.plant, [self.drive] if self.sensor is None else [self.drive, self.sensor])

    @property
    def cycle_time(self) -> float:
        """Time between two SYNCs, s, as the host has set it."""
        return self.drive.axis.cycle_time

    @property
    def powered(self) -> bool:
        """Whether the drive has power, or keeps it for a ramp."""
        state = self.drive.state
        return state is State.OPERATION_ENABLED or (self._on and state not in _OFF)

    @property
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""
        return self.drive.at_ease

    def patience(self, idle_cycles: int) -> int:
        """Return the drive's own patience once it was sent anywhere; a host that only holds is waited for."""
        return idle_cycles if self.drive.waiting else self.drive.parameters.patience

    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC."""
        self.drive.elapse(cycles)
