"""The emulated ST-III on a CAN bus: servo drive, table, and the rotation sensor of the specimen standing on it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from devices.cia402.drive import Drive, DriveOptions
from devices.cia402.frames import SYNC
from devices.cia402.states import State
from devices.clock import WallClock
from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.driver import DRIVE_NODE, SENSOR_NODE
from devices.quanser_st3.plant import St3Parameters, St3Plant
from devices.sensors.rotation import RotationSensor

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia402.buses import CanBus
    from devices.clock import Clock
    from devices.table import Specimen
    from excitation import Capacity

_FRAMES_AT_ONCE = 1000
_OFF = (State.NOT_READY, State.SWITCH_ON_DISABLED, State.READY_TO_SWITCH_ON, State.FAULT)


class StopSignal(Protocol):
    """A `threading.Event` or `multiprocessing.Event`."""

    def is_set(self) -> bool: ...


class EmulatedSt3:
    """A Quanser ST-III that is not there.

    Imitated: the CiA 402 drive with its state machine, refusal of set-points beyond the capacity, stopping by itself;
    the closed loop's second-order lag; encoder steps; the accelerometer's noise, bias and range; the specimen's motion
    under the table's true acceleration, and its rotation sensor.

    Not imitated: transport delay, current and velocity saturation, limit switches, the payload's effect on the loop,
    the second axis. Without power the table holds its place, as a ball screw does. Set-points never
    leave the stroke, but the loop overshoots them: by 26 um where it brakes with 9.81 m/s2 to the very end.

    The specimen is held as it is until the drive is first enabled, so that one released from a tilt does not fall while
    the host walks the drive through its states; the first `exchange` finds it two cycles old. Each time the power comes
    on again it is set up anew, as an operator would between two runs; the table stays where it stopped.

    In one process with the host give `service` to the host as its `idle`: the bus clock is then the SYNC counter, and
    nothing happens between SYNCs (`DriveOptions.shared_clock` says so to the drive). In a process of its own call
    `serve`: a drive that hears no SYNC then stops by its own clock. Frames and code are the same.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open.
    rng : numpy.random.Generator
        Of all noise: equal seeds, equal frames.
    specimen : callable, optional
        What stands on the table; see `devices.table.Specimen`. Without one there is no rotation sensor on the bus.
    set_up : callable, optional
        Called as the power comes on: puts the specimen back to `initial_rotation`. Without it the specimen stays as the
        last run left it.
    capacity : excitation.Capacity
    cycle_time : float
        s.
    parameters : St3Parameters, optional
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
    >>> from devices.cia402.buses import open_bus
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
        options: DriveOptions | None = None,
        clock: Clock | None = None,
        initial_position: float = 0.0,
        initial_rotation: float = 0.0,
        rotation_step: float = 1e-4,
        rotation_noise: float = 0.0,
        drive_node: int = DRIVE_NODE,
        sensor_node: int = SENSOR_NODE,
    ) -> None:
        accelerometer_rng, rotation_rng = rng.spawn(2)
        self.plant = St3Plant(
            parameters or St3Parameters(), cycle_time, accelerometer_rng, specimen, initial_position, initial_rotation
        )
        self.drive = Drive(
            drive_node, bus.send, self.plant, capacity, cycle_time, position=initial_position, options=options
        )
        self.sensor: RotationSensor | None = None
        if specimen is not None:
            self.sensor = RotationSensor(
                sensor_node,
                bus.send,
                lambda: self.plant.rotation,
                quantum=rotation_step,
                noise=rotation_noise,
                rng=rotation_rng,
            )
        self.plant.released = False
        self._set_up = set_up
        self._initial_rotation = initial_rotation
        self._powered = False
        self._bus = bus
        self._cycle_time = cycle_time
        self._clock = clock or WallClock()
        self._booted = False

    def boot(self) -> None:
        """Power on; done by the first `service` or `serve` where it was not done before."""
        if not self._booted:
            self._booted = True
            self.drive.boot()
            if self.sensor is not None:
                self.sensor.boot()

    def service(self) -> None:
        """Answer every frame that waits, and return; never blocks."""
        self.boot()
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self._bus.receive()) is None:
                break
            self._take(*frame)
        self._beat()

    def serve(self, stop: StopSignal, *, idle_limit: float = 5.0) -> None:
        """Answer frames until `stop` is set; then bring the table to rest and return.

        Without SYNC the drive waits `options.patience` cycles of this process's clock once it was sent anywhere, and
        `idle_limit`, s, while it only holds the place where it was enabled; then it stops by itself.
        """
        self.boot()
        h, clock = self._cycle_time, self._clock
        synced = clock.now()
        lived = 0
        while not stop.is_set():
            frame = self._bus.receive(h)
            if frame is not None and self._take(*frame):
                synced, lived = clock.now(), 0
            self._beat()
            silent = int((clock.now() - synced) / h)
            patience = self.drive.options.patience if self.drive.moved else int(idle_limit / h)
            if silent > patience and not self.drive.at_ease:
                self.drive.elapse(silent - lived)
                lived = silent
        for _ in range(int(idle_limit / h)):
            if self.drive.at_ease:
                break
            self.drive.elapse(1)

    def _take(self, identifier: int, data: bytes) -> bool:
        """Hand a frame to the nodes; return whether it was a SYNC."""
        self.drive.receive(identifier, data)
        state = self.drive.state
        if state is State.OPERATION_ENABLED and not self._powered:
            self._powered = True
            self.plant.released = True
            if self._set_up is not None:
                self._set_up()
                self.plant.rotation = self._initial_rotation
        elif state in _OFF:
            self._powered = False
        if self.sensor is not None:
            self.sensor.receive(identifier, data)
        return identifier == SYNC

    def _beat(self) -> None:
        now = self._clock.now()
        self.drive.node.beat(now)
        if self.sensor is not None:
            self.sensor.node.beat(now)
