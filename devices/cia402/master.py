"""The host's side of a CiA 402 table: bring it up, one set-point a cycle, stop it, on any python-can bus."""

from __future__ import annotations

import math
from contextlib import suppress
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.sdo_client import ANSWER_LIMIT
from devices.cia402 import complaints, states
from devices.cia402.commissioning import Commissioning, Setup
from devices.cia402.link import Feedback, Link
from devices.cia402.states import State, decode, next_controlword
from devices.cia402.units import SERVO_DRIVE, units_of
from devices.clock import WallClock
from devices.errors import DeviceError, DeviceTimeout, DriveStopped, SetpointRefused
from devices.sample import Description, Sample
from devices.sensors.rotation import ROTATION_SENSOR
from devices.table import ShakeTable

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.cia301.host import FrameCounts
    from devices.cia301.sdo_client import Sdo
    from devices.clock import Clock
    from excitation import Capacity

_FAULTY = (State.FAULT, State.FAULT_REACTION_ACTIVE)
# Where the motor has no power and a stop ends.
_OFF = (State.SWITCH_ON_DISABLED, State.FAULT)


class Cia402Table(ShakeTable):
    """A shake table whose servo drive speaks CiA 402 in cyclic synchronous position mode.

    Parameters
    ----------
    bus : CanBus
        Open bus; it stays open when the table is closed.
    capacity : excitation.Capacity
    drive_node : int
        CANopen node of the drive.
    sensor_node : int, optional
        CANopen node of the specimen's rotation sensor; without it `Sample.rotation` is NaN.
    cycle_time : float
        s.
    clock : Clock, optional
        Paces the cycles of `open`, `enable`, `quick_stop` and `disable`, and bounds every wait. `exchange` is paced by
        its caller; the first one should come at once after `enable`, before the drive misses its host.
    idle : callable, optional
        Called while waiting for answers: services an emulator on this thread, so that no hand-over between threads
        spoils the cycle. With it nothing blocks.
    time_limit : float
        For all answers to one SYNC, s.
    open_limit, state_limit : float
        For the first answer of the nodes, and for a walk through the drive's states or a stop, s. A stop is tried for
        all of it, whatever fails meanwhile; it must be longer than the drive's slowest ramp.
    start_window : float
        Largest distance between the position to be enabled at and the measured one, m.
    stop_deceleration, following_error, patience : float, optional
        Of the drive, its own unless told: deceleration of quick stop and fault reaction, m/s2 (object 6085); following
        error beyond which it stops itself, m (6065); how long it goes on without its host, s (2010; up to 200 cycles).
    eds, sensor_eds : str
        Texts of the electronic data sheets the drive and the sensor came with.
    host_node : int
        CANopen node of the host, whose heartbeat the nodes watch.

    Attributes
    ----------
    units : Units
        Of the drive's objects and process data.
    """

    def __init__(
        self,
        bus: CanBus,
        capacity: Capacity,
        *,
        drive_node: int = 1,
        sensor_node: int | None = None,
        cycle_time: float = 1e-3,
        clock: Clock | None = None,
        idle: Callable[[], None] | None = None,
        time_limit: float = 0.02,
        open_limit: float = 5.0,
        state_limit: float = 3.0,
        start_window: float = 20e-6,
        stop_deceleration: float | None = None,
        following_error: float | None = None,
        patience: float | None = None,
        eds: str = SERVO_DRIVE,
        sensor_eds: str = ROTATION_SENSOR,
        host_node: int = frames.HOST_NODE,
    ) -> None:
        self.units = units_of(eds)
        super().__init__(capacity, cycle_time, self.units.position, start_window)
        self._clock = clock or WallClock()
        self._link = Link(bus, drive_node, sensor_node, self._clock, idle, time_limit, self.units, host_node)
        self._open_tries = max(1, int(open_limit / ANSWER_LIMIT)) if idle is None else 3
        setup = Setup(capacity, cycle_time, stop_deceleration, following_error, patience, eds, sensor_eds)
        self._commissioning = Commissioning(self._link, self.name, setup, self._open_tries)
        self._state_limit = state_limit
        self._state_cycles = max(1, round(state_limit / cycle_time))
        # What else answers a stop is waited for, but not so long that the drive's ramp, paced by SYNC, is slowed down.
        self._spare = min(time_limit, 0.5 * cycle_time)
        self._bus_cycle = 0
        self._next = 0.0
        self._feedback = Feedback(0, 0.0, 0.0, 0.0)

    @property
    def counts(self) -> FrameCounts:
        """Frames that were no answer: foreign, stale and so on."""
        return self._link.counts

    @property
    def objects(self) -> Sdo:
        """The drive's object dictionary; never in the cycle."""
        return self._commissioning.drive

    @property
    def answer_time(self) -> float:
        """From the last SYNC to the last of its answers, s."""
        return self._link.answer_time

    @property
    def position(self) -> float:
        """Last measured position, m: where to `enable`. Known once open."""
        return self._feedback.position

    @property
    def state(self) -> State | None:
        """Drive state by the last statusword; None where that makes no sense."""
        return decode(self._feedback.statusword)

    def reset_fault(self) -> None:
        """Acknowledge a fault of a table at rest; the drive is in SWITCH_ON_DISABLED after it. Never done by itself.

        A drive whose last host died is reset by the next one. Without a fault nothing is sent but a SYNC.

        Raises
        ------
        DeviceNotReady
            Before `open`, or while the table takes set-points: stop it first.
        DriveFault
            Where the fault stays.
        """
        self._require_idle(f"a fault of {self.name} is to be reset")
        self._paced(None, self._spare)
        self._link.emergencies.clear()
        if self.state not in _FAULTY:
            return
        here = self._counts(self.position)
        for controlword in (states.DISABLE_VOLTAGE, states.FAULT_RESET, states.DISABLE_VOLTAGE, states.DISABLE_VOLTAGE):
            self._paced((controlword, here), self._spare)
        if self.state in _FAULTY:
            raise complaints.fault(self._link, self.name, self.state)
        self._link.drain()

    def steer(self, controlword: int) -> int:
        """Do one paced cycle with a controlword, and return the statusword; DeviceNotReady while set-points are taken.

        For what is done before a run, as homing is; the table counts as powered until `quick_stop`.
        """
        self._require_idle(f"{self.name} is to be steered")
        self._powered = True
        return self._paced((controlword, self._counts(self.position)), self._spare).statusword

    def _open(self) -> None:
        try:
            self._commissioning.check()
            self._commissioning.set_up()
            self._look()
        except DeviceTimeout as error:
            raise DeviceTimeout(f"{self.name} does not answer: {error}") from error

    def _look(self) -> None:
        """Send SYNC until it is answered: the first may have the number of the last host's last, and be no new one."""
        for _ in range(self._open_tries - 1):
            with suppress(DeviceTimeout):
                self._paced(None)
                return
        self._paced(None)

    def _describe(self) -> tuple[Description, ...]:
        self._paced(None, self._spare)
        return self._commissioning.describe(self.state)

    def _enable(self, position: float) -> None:
        command = None
        self._link.drain()
        if self._link.restarted is not None:
            # A node that was restarted since has forgotten what it was told.
            self._commissioning.set_up()
        for _ in range(self._state_cycles):
            self._paced(command)
            if self._link.emergency is not None or self.state in _FAULTY:
                remedy = "; once its cause is gone, acknowledge it with reset_fault (twin run --reset)"
                raise complaints.fault(self._link, self.name, self.state, remedy)
            if self.state is State.OPERATION_ENABLED and command is not None:
                self._link.trust()
                return
            if abs(position - self.position) > self.start_window:
                raise SetpointRefused(
                    f"{self.name} is to be enabled at {position:.6f} m; it stands at {self.position:.6f} m", "start"
                )
            command = (next_controlword(self.state), self._counts(position))
        raise DeviceTimeout(f"{self.name} stays in {self.state}; operation enabled was asked for")

    def _exchange(self, cycle: int, steps: int, target_position: float) -> Sample:
        if steps >= frames.SYNC_COUNTS:
            late = f"cycle {cycle} of {self.name} comes {steps} cycles after the last"
            raise DriveStopped(f"{late}; its drive stops itself long before")
        self._link.drain()
        complaints.check(self._link, self.name, self.state)
        self._next = self._clock.now()
        try:
            feedback = self._cycle((states.ENABLE_OPERATION, self._counts(target_position)), steps)
        except DeviceTimeout:
            self._link.drain()  # what was heard instead may say why
            complaints.check(self._link, self.name, self.state)
            raise
        if decode(feedback.statusword) is not State.OPERATION_ENABLED:
            complaints.check(self._link, self.name, self.state)
            if self.state in _FAULTY:
                raise complaints.fault(self._link, self.name, self.state)
            raise DriveStopped(f"{self.name} left operation enabled by itself: {self.state}")
        return self._sample(cycle, feedback)

    def _quick_stop(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        here = self._counts(self.position)
        self._power_off(lambda: (states.QUICK_STOP, here), last_cycle, each)

    def _cut_power(self, last_cycle: int, each: Callable[[Sample], object] | None) -> None:
        here = self._counts(self.position)
        self._power_off(lambda: (states.DISABLE_VOLTAGE, here), last_cycle, each)

    def _disable(self) -> None:
        here = self._counts(self._limits.position)
        self._power_off(
            lambda: (states.SHUTDOWN if self.state is State.OPERATION_ENABLED else states.DISABLE_VOLTAGE, here)
        )

    def _power_off(
        self,
        command: Callable[[], tuple[int, int]],
        last_cycle: int = -1,
        each: Callable[[Sample], object] | None = None,
    ) -> None:
        """Send a command and SYNC each cycle until the drive has no power and the table stands."""
        deadline = self._clock.now() + self._state_limit
        before = math.nan
        trouble: DeviceError | None = None
        for cycle in range(last_cycle + 1, last_cycle + 1 + self._state_cycles):
            if self._clock.now() > deadline:
                break
            try:
                feedback = self._paced(command(), self._spare, again=trouble is not None)
            except DeviceError as error:
                # Lost answers, nonsense or a bus that is gone may be over in the next cycle; giving up never helps.
                trouble = error
                continue
            trouble = None
            if each is not None and math.isfinite(feedback.acceleration):
                each(self._sample(cycle, feedback))
            # Power may be gone while the table still runs down: the position has its say too.
            if self.state in _OFF and abs(feedback.position - before) <= self.start_window:
                return
            before = feedback.position
        told = f"it last was in {self.state}" if trouble is None else str(trouble)
        raise DeviceTimeout(
            f"{self.name} did not confirm a standstill within {self._state_limit:g} s ({told}): "
            "THE TABLE MAY STILL BE MOVING, use its emergency stop"
        ) from trouble

    def _close(self) -> None:
        """Nothing of ours is left open: the bus belongs to who opened it."""

    def _paced(self, command: tuple[int, int] | None, spare: float | None = None, *, again: bool = False) -> Feedback:
        self._next = max(self._next + self.cycle_time, self._clock.now())
        # Before anything that can fail, so that trying again is paced too.
        self._clock.wait_until(self._next)
        self._link.drain()
        if again:
            # A node that restarted meanwhile answers no SYNC before it is told to.
            self._link.start()
        return self._cycle(command, 1, spare)

    def _cycle(self, command: tuple[int, int] | None, steps: int, spare: float | None = None) -> Feedback:
        self._bus_cycle += steps
        self._feedback = self._link.cycle(frames.sync_counter(self._bus_cycle), command, spare)
        return self._feedback

    def _sample(self, cycle: int, feedback: Feedback) -> Sample:
        return Sample(cycle, cycle * self.cycle_time, *feedback[1:], feedback.statusword)

    def _counts(self, position: float) -> int:
        return frames.counts(position, self.units.position, "target position")
