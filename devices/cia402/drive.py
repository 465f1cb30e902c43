"""The protocol side of an emulated servo drive: frames in, frames out, a machine to move.

At each SYNC the drive first lets its machine live through the cycles that passed since the last one, told by the SYNC
counter, so that lost SYNCs do not slow its clock; then it latches and sends statusword, position and acceleration; then
it takes controlword and target of the last RPDO. A target is where to be one cycle later.

Objects that bound a motion are taken over when operation is enabled, so that nothing changes under way.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.node import Device
from devices.cia301.sync_count import SyncCount
from devices.cia402 import states
from devices.cia402.axis import Axis
from devices.cia402.frames import pack_actual, unpack_target
from devices.cia402.machine import DriveOptions
from devices.cia402.objects import declare
from devices.cia402.parameters import Parameters
from devices.cia402.states import State, StateMachine
from devices.cia402.supervision import LIMIT_SWITCH, TOO_FAR
from devices.cia402.units import SERVO_DRIVE, units_of

if TYPE_CHECKING:
    from devices.cia301.node import Send
    from devices.cia402.interpolation import Interpolator
    from devices.cia402.machine import Machine
    from excitation import Capacity

COMMUNICATION_ERROR, PROFILE_ERROR = 0x11, 0x21
"""Error registers (object 1001): generic with communication, generic with device profile."""

_NODE_STOPPED, _NO_SETPOINT, _NO_SYNC, _OUTSIDE = 0x8130, 0x8250, 0x8700, 0x8612
_CODE_OF = {"stroke": _OUTSIDE, "braking": _OUTSIDE, "velocity": 0x8400, "acceleration": 0x8500}
_PUSHING = (State.OPERATION_ENABLED, State.QUICK_STOP_ACTIVE)
_STOPPING = (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)


class Drive(Device):
    """One emulated drive.

    Not imitated: that a real drive with an incremental encoder does not know where it is before it is homed; the
    capacity's stroke is kept in the machine's own coordinate, homed or not.

    Parameters
    ----------
    identifier : int
        CANopen node number.
    send : callable
        Takes identifier and bytes of each frame the drive sends.
    machine : Machine
        What it moves; at rest, and at set-point `position`.
    capacity : excitation.Capacity
        Set-points beyond it put the drive into fault.
    cycle_time : float
        s, until object 1006 is written.
    position : float
        Set-point the machine rests at, m.
    options : DriveOptions, optional

    Attributes
    ----------
    axis : Axis
        What moves.
    cycle : int
        Cycles lived through.
    mode : int
        Mode of operation (6061).
    command : (int, int)
        Last controlword and target, counts.
    acceleration : int
        Last acceleration sent, counts.
    error : int
        Last emergency code since the last reset (603F).
    """

    def __init__(
        self,
        identifier: int,
        send: Send,
        machine: Machine,
        capacity: Capacity,
        cycle_time: float,
        *,
        position: float = 0.0,
        options: DriveOptions | None = None,
    ) -> None:
        self.options = options or DriveOptions()
        super().__init__(identifier, send, SERVO_DRIVE, heartbeat_period=self.options.heartbeat_period)
        self.units = units_of(SERVO_DRIVE)
        self.parameters = Parameters(self.node.objects, self.units, capacity, self.options, cycle_time)
        self.axis = Axis(machine, self.parameters, capacity, cycle_time, self.units.position, self.options, position)
        self.cycle = 0
        self.mode = states.CYCLIC_SYNCHRONOUS_POSITION
        self.command = 0, 0
        self.acceleration = 0
        self.error = 0
        self._states = StateMachine()
        self._syncs = SyncCount()
        self._pending = False
        self._fresh = True
        self._moved = False
        self._limit_active = False
        declare(self)

    @property
    def state(self) -> State:
        """State of CiA 402's machine."""
        return self._states.state

    @property
    def interpolator(self) -> Interpolator:
        """The set-point."""
        return self.axis.interpolator

    @property
    def standstill(self) -> bool:
        """Whether nothing moves and no set-point is awaited."""
        return self.axis.standstill

    @property
    def waiting(self) -> bool:
        """Whether the drive holds the place where it was enabled, and nothing else."""
        return self.interpolator.following and not self._moved

    @property
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""
        holds = self.state is State.QUICK_STOP_ACTIVE and self._states.stays
        return self.standstill and (holds or self.state not in _STOPPING)

    @property
    def statusword(self) -> int:
        """Object 6041."""
        word = self._states.statusword | (states.INTERNAL_LIMIT if self._limit_active else 0)
        if self.mode == states.HOMING:
            return word | self.axis.homing.flags
        if self.state is not State.OPERATION_ENABLED:
            return word
        return word | states.FOLLOWS_COMMAND | (states.FOLLOWING_ERROR if self.axis.supervision.astray else 0)

    def boot(self) -> None:
        """Power on: announce the node; the drive is in SWITCH_ON_DISABLED after it."""
        self.node.boot()
        self._states.ready()

    def take(self, pdo: int, data: bytes) -> None:
        """Take RPDO1: controlword and target, obeyed at the next SYNC."""
        if pdo == 1:
            self.ask(*unpack_target(data))

    def aim(self, target: int) -> None:
        """Take a target, counts, for the next controlword that comes alone."""
        self.command = self.command[0], target

    def ask(self, controlword: int, target: int) -> None:
        """Let `controlword` and `target`, counts, be obeyed at the next SYNC."""
        self.command, self._pending = (controlword, target), True

    def sync(self, counter: int) -> None:
        """Do what a SYNC asks: live through the time passed, answer, take the new target."""
        # A moving drive with a clock of its own would have missed more of them long before.
        busy = self.state in _PUSHING or self.axis.moving
        most = self.interpolator.patience + 1 if busy and not self.options.shared_clock else frames.SYNC_COUNTS
        passed = self._syncs.take(counter, most)
        if self._syncs.astray:
            self._stop_for(_NO_SYNC)
        if passed == 0:
            return  # the same SYNC twice, an old one, or somebody else's
        bridge = self._bridge(passed - 1) if passed else []
        for k in range(passed or 0):
            if k > 0 and bridge:
                self.interpolator.go(bridge[k - 1])
            self._live(_NO_SETPOINT if passed == 1 else _NO_SYNC)
        if not self.node.operational:
            return  # no process data, but time passes and a ramp goes on
        self._answer()
        if self._pending:
            self._pending = False
            controlword, target = self.command
            self._obey(controlword, target * self.units.position)

    def leave_operational(self) -> None:
        """Stop a moving machine when the node is stopped or reset."""
        self._pending = False
        self._stop_for(_NODE_STOPPED)

    def lost(self, node: int) -> None:  # noqa: ARG002 - whoever is watched is the host
        """Stop a machine whose host is gone."""
        self._stop_for(_NODE_STOPPED)

    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC, told by the drive's own clock; the next SYNC starts the count anew."""
        self._syncs.forget()
        for _ in range(cycles):
            self._live(_NO_SYNC)

    def fail(self, code: int, register: int = PROFILE_ERROR) -> None:
        """Enter fault with an emergency code: ramp down, then take the power off."""
        self.axis.stop(0x605E)
        self._states.fault()
        self.error = code
        self.node.emergency(code, register)

    def set_mode(self, mode: int) -> None:
        """Change the mode of operation; only where nothing moves."""
        self.axis.homing.enter()
        self.interpolator.stop()
        self.mode, self._fresh = mode, True

    def _stop_for(self, code: int) -> None:
        """Enter fault, where the drive pushes, because of what is or is not heard on the bus."""
        if self.state in _PUSHING:
            self.fail(code, COMMUNICATION_ERROR)

    def _bridge(self, cycles: int) -> list[float]:
        if not (self.options.shared_clock and cycles and self._pending and self.state is State.OPERATION_ENABLED):
            return []
        controlword, target = self.command
        following = controlword == states.ENABLE_OPERATION
        return self.interpolator.bridge(cycles, target * self.units.position) if following else []

    def _live(self, complaint: int) -> None:
        axis = self.axis
        followed = axis.interpolator.following
        axis.live(synced=complaint != _NO_SYNC)
        self.cycle += 1
        if (followed and not axis.interpolator.following) or (axis.homing.active and axis.homing.deserted):
            self.fail(complaint, COMMUNICATION_ERROR)
        if self.state in _PUSHING and (code := axis.complaint()) is not None:
            self._limit_active |= code == LIMIT_SWITCH
            self.fail(code)
        if self.state is not State.OPERATION_ENABLED and axis.standstill:
            self._states.stopped()
            if self.state not in _PUSHING:
                axis.power(False)

    def _answer(self) -> None:
        send, node, units = self.node.send, self.node.identifier, self.units
        self.acceleration = frames.counts(self.axis.machine.measure_acceleration(), units.acceleration, "acceleration")
        position = frames.counts(self.axis.measured, units.position, "position")
        send(frames.TPDO1 + node, pack_actual(self.statusword, position))
        send(frames.TPDO2 + node, frames.pack_long(self.acceleration))

    def _obey(self, controlword: int, target: float) -> None:
        before = self.state
        self._states.command(controlword, standstill=self.standstill and not self.axis.switches.stop)
        after = self.state
        if after is State.OPERATION_ENABLED:
            if before is not after or self._fresh:
                self._start(target)
            elif self.mode == states.CYCLIC_SYNCHRONOUS_POSITION:
                self._follow(target)
            if self.mode == states.HOMING:
                self.axis.home(controlword)
        elif after is State.SWITCH_ON_DISABLED and before in _PUSHING:
            self.axis.let_go()
        elif before is State.OPERATION_ENABLED:
            self.axis.stop(0x605A)
        elif before is State.FAULT and after is not State.FAULT:
            self._limit_active, self.error = False, 0
            self.node.emergency(0x0000, 0x00)

    def _start(self, target: float) -> None:
        """Begin where the table stands."""
        axis, p = self.axis, self.parameters
        axis.interpolator.limits.narrow(*p.limits(axis.zero))
        self._states.stays = p.stays
        self._fresh = self._moved = False
        if self.mode == states.HOMING:
            axis.start(self.cycle, None)
        elif (beyond := axis.interpolator.limits.outside(target)) or abs(target - axis.measured) > p.start_window:
            self.fail(_OUTSIDE if beyond else TOO_FAR)
        else:
            axis.start(self.cycle, target)

    def _follow(self, target: float) -> None:
        self._moved = self._moved or target != self.interpolator.limits.position
        if (refusal := self.interpolator.offer(self.cycle, target)) is not None:
            self._limit_active = True
            self.fail(_CODE_OF[refusal.limit])
