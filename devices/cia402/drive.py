"""The protocol side of an emulated servo drive: frames in, frames out, a machine to move.

At each SYNC the drive first lets its machine live through the cycles that passed since the last one, told by the SYNC
counter, so that lost SYNCs do not slow its clock; then it latches and sends statusword, position and acceleration; then
it takes controlword and target of the last RPDO. A target is where to be one cycle later.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Protocol

from pydantic import BaseModel, ConfigDict, Field

from devices.cia402 import frames
from devices.cia402.interpolation import Interpolator
from devices.cia402.node import Node
from devices.cia402.states import ENABLE_OPERATION, INTERNAL_LIMIT, State, StateMachine

if TYPE_CHECKING:
    from devices.cia402.node import Send
    from excitation import Capacity

COMMUNICATION_ERROR, PROFILE_ERROR = 0x11, 0x21
"""Error registers (object 1001): generic with communication, generic with device profile."""

_NODE_STOPPED, _NO_SETPOINT, _NO_SYNC = 0x8130, 0x8250, 0x8700
_CODE_OF = {"stroke": 0x8612, "braking": 0x8612, "velocity": 0x8400, "acceleration": 0x8500}
_NM = frames.POSITION_UNIT
_STANDSTILL = 1e-4


class Machine(Protocol):
    """What a drive moves and measures."""

    def advance(self, setpoint: float) -> None:
        """Live through one cycle while the set-point goes linearly from where it was to `setpoint`, m."""
        ...

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        ...

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2."""
        ...

    @property
    def velocity(self) -> float:
        """Velocity, m/s, by which standstill is told."""
        ...


_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]


class DriveOptions(BaseModel):
    """What is set up in a drive before it runs.

    Attributes
    ----------
    stop_deceleration : float
        Quick-stop and fault-reaction deceleration, m/s2 (object 6085), as long as the stroke left allows it. Default
        1 m/s2: under half of g tan(alpha) of block B6L, so that stopping does not rock it.
    patience : int
        Cycles without SYNC or without set-point that are bridged before the drive stops itself; 200 at most, for the
        SYNC counter cannot tell 240 from none.
    start_window : float
        Largest distance of the first set-point from the measured position, m.
    heartbeat_period : float
        s.
    shared_clock : bool
        Whether drive and host run on one thread, so that they stand still together. Cycles left out between two SYNCs
        are then no silence: the set-point that came with the second one is known, and the gap is interpolated.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    stop_deceleration: _Positive = 1.0
    patience: Annotated[int, Field(ge=0, le=200)] = 20
    start_window: _Positive = 20e-6
    heartbeat_period: _Positive = 0.1
    shared_clock: bool = False


class Drive:
    """One emulated drive.

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
        s.
    position : float
        Set-point the machine rests at, m.
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
        self.node = Node(identifier, send, self.options.heartbeat_period)
        self.cycle = 0
        self.interpolator = Interpolator(
            capacity, cycle_time, _NM, self.options.stop_deceleration, self.options.patience
        )
        self.interpolator.hold(position)
        self.refused_frames = 0
        self.moved = False
        self._machine = machine
        self._states = StateMachine()
        self._counter: int | None = None
        self._command: tuple[int, int] | None = None
        self._limit_active = False

    @property
    def state(self) -> State:
        """State of CiA 402's machine."""
        return self._states.state

    @property
    def standstill(self) -> bool:
        """Whether neither set-point nor machine moves."""
        return self.interpolator.at_rest and abs(self._machine.velocity) < _STANDSTILL

    @property
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""
        stopping = self.state in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE)
        return self.standstill and not stopping

    def boot(self) -> None:
        """Power on: announce the node; the drive is in SWITCH_ON_DISABLED after it."""
        self.node.boot()
        self._states.ready()

    def receive(self, identifier: int, data: bytes) -> None:
        """Take one frame from the bus; other nodes' are ignored, malformed ones counted in `refused_frames`."""
        counter: int | None = None
        try:
            if identifier == frames.SYNC:
                counter = frames.unpack_sync(data)
            elif identifier == frames.RPDO1 + self.node.identifier:
                if self.node.operational:
                    self._command = frames.unpack_target(data)
            elif identifier == frames.NMT:
                self.node.command(data, self)
        except frames.FrameError:
            self.refused_frames += 1
        if counter is not None:
            self.sync(counter)

    def sync(self, counter: int) -> None:
        """Do what a SYNC asks: live through the time passed, answer, take the new target."""
        if self._counter is not None:
            passed = (counter - self._counter) % frames.SYNC_COUNTS
            if passed == 0:
                return  # the same SYNC twice
            bridge = self._bridge(passed - 1)
            for k in range(passed):
                if k > 0 and bridge:
                    self.interpolator.go(bridge[k - 1])
                self._live(_NO_SETPOINT if passed == 1 else _NO_SYNC)
        self._counter = counter
        if not self.node.operational:
            return  # no process data, but time passes and a ramp goes on
        self._answer()
        if self._command is not None:
            controlword, target = self._command
            self._command = None
            self._obey(controlword, target * _NM)

    def leave_operational(self) -> None:
        """Stop a moving machine when the node is stopped or reset."""
        self._command = None
        if self.state is State.OPERATION_ENABLED:
            self._fault(_NODE_STOPPED, COMMUNICATION_ERROR)

    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC, told by the drive's own clock; the next SYNC starts the count anew."""
        self._counter = None
        for _ in range(cycles):
            self._live(_NO_SYNC)

    def _bridge(self, cycles: int) -> list[float]:
        if not (self.options.shared_clock and cycles and self._command and self.state is State.OPERATION_ENABLED):
            return []
        controlword, target = self._command
        return self.interpolator.bridge(cycles, target * _NM) if controlword == ENABLE_OPERATION else []

    def _live(self, complaint: int) -> None:
        interpolator = self.interpolator
        followed = interpolator.following
        self._machine.advance(interpolator.step())
        self.cycle += 1
        if followed and not interpolator.following:
            self._fault(complaint, COMMUNICATION_ERROR)
        if self.state in (State.QUICK_STOP_ACTIVE, State.FAULT_REACTION_ACTIVE) and self.standstill:
            self._states.stopped()

    def _answer(self) -> None:
        send, node = self.node.send, self.node.identifier
        position = frames.counts(self._machine.measure_position(), _NM, "position")
        acceleration = frames.counts(self._machine.measure_acceleration(), frames.ACCELERATION_UNIT, "acceleration")
        statusword = self._states.statusword | (INTERNAL_LIMIT if self._limit_active else 0)
        send(frames.TPDO1 + node, frames.pack_actual(statusword, position))
        send(frames.TPDO2 + node, frames.pack_long(acceleration))

    def _obey(self, controlword: int, target: float) -> None:
        before = self.state
        self._states.command(controlword, standstill=self.standstill)
        after = self.state
        if after is State.OPERATION_ENABLED:
            if before is State.OPERATION_ENABLED:
                self._follow(target)
            else:
                self._start(target)
        elif before is State.OPERATION_ENABLED:
            self.interpolator.stop()
        elif before is State.FAULT and after is not State.FAULT:
            self._limit_active = False
            self.node.emergency(0x0000, 0x00)

    def _start(self, target: float) -> None:
        distance = target - self._machine.measure_position()
        outside = self.interpolator.limits.outside(target)
        if outside is not None or abs(distance) > self.options.start_window:
            self._fault(0x8612 if outside else 0x8611, PROFILE_ERROR)
            return
        self.moved = False
        self.interpolator.begin(self.cycle, target)

    def _follow(self, target: float) -> None:
        self.moved = self.moved or target != self.interpolator.limits.position
        if (refusal := self.interpolator.offer(self.cycle, target)) is not None:
            self._limit_active = True
            self._fault(_CODE_OF[refusal.limit], PROFILE_ERROR)

    def _fault(self, code: int, register: int) -> None:
        self.interpolator.stop()
        self._states.fault()
        self.node.emergency(code, register)
