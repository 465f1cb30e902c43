"""The release device of a machine: digital outputs that arm, release and switch its air supply, inputs that answer.

RPDO1 carries the outputs (object 6200:1), TPDO1 the inputs (6000:1), one byte each, at every SYNC. Releasing takes two
steps, as a two-hand control does: the output releases only a base that was armed at an earlier SYNC.
"""

from __future__ import annotations

from enum import IntFlag
from importlib.resources import files
from typing import TYPE_CHECKING, Protocol

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.cia301.node import Device
from devices.cia301.sync_count import SyncCount
from devices.errors import FrameError

if TYPE_CHECKING:
    from devices.cia301.node import Send

RELEASE_OUTPUT = files("devices.cia401").joinpath("release.eds").read_text(encoding="utf-8")
"""EDS of the release device."""

_HEARTBEAT_LOST, _SYNC_LOST = 0x8130, 0x8700
_COMMUNICATION_ERROR = 0x11

PATIENCE = 20
"""Cycles without SYNC after which a machine that was released takes its host for gone."""


class Output(IntFlag):
    """Bits of object 6200:1."""

    ARM = 1
    RELEASE = 2
    AIR = 4


class Input(IntFlag):
    """Bits of object 6000:1."""

    HELD = 1
    ARMED = 2
    AIR = 4


class Base(Protocol):
    """What is released."""

    @property
    def held(self) -> bool:
        """Whether it stands in its latch."""
        ...

    @property
    def at_rest(self) -> bool:
        """Whether nothing moves it and nothing will."""
        ...

    @property
    def air(self) -> bool:
        """Whether its air supply is on."""
        ...

    @air.setter
    def air(self, on: bool) -> None: ...

    def release(self) -> None:
        """Open the latch, or fire."""
        ...

    def advance(self) -> None:
        """Live through one cycle."""
        ...

    def set_up(self) -> None:
        """Be put back into the latch, as an operator does between two runs."""
        ...


def pack_outputs(outputs: Output) -> bytes:
    """Return RPDO1."""
    return bytes([outputs])


def unpack_inputs(data: bytes) -> Input:
    """Return the inputs that TPDO1 carries."""
    if len(data) != 1:
        raise FrameError(f"inputs TPDO1 has {len(data)} bytes; it must have 1")
    return Input(data[0] & 0x07)


class ReleaseDevice(Device):
    """The emulated release device; it moves its machine through time, told by the SYNC counter, as a drive does.

    A host that has gone (heartbeat, SYNC, a stopped node) leaves the outputs at their error values (6206, 6207): off,
    so that a machine that was not released is disarmed, and one with an air supply loses it and is braked by friction.

    Whenever a host starts the node while the machine is disarmed and has come to rest, the operator has put the base
    back into its latch.

    Parameters
    ----------
    identifier : int
        CANopen node number.
    send : callable
        Takes identifier and bytes of each frame.
    base : Base
    shared_clock : bool
        Whether the host runs on the same thread: a SYNC that comes late is then no sign that it is gone.
    """

    def __init__(
        self, identifier: int, send: Send, base: Base, *, shared_clock: bool = False, heartbeat_period: float = 0.1
    ) -> None:
        super().__init__(identifier, send, RELEASE_OUTPUT, heartbeat_period=heartbeat_period)
        self._base = base
        self._asked = self._outputs = Output(0)
        self._shared_clock = shared_clock
        self._syncs = SyncCount()
        objects = self.node.objects
        objects.on_read(0x6000, lambda: int(self.inputs), 1)
        objects.on_read(0x6200, lambda: int(self._outputs), 1)
        objects.on_write(0x6200, self._ask, 1)

    @property
    def armed(self) -> bool:
        """Whether the next release output releases."""
        return Output.ARM in self._outputs

    @property
    def at_ease(self) -> bool:
        """Whether nothing moves and nothing will without a new command."""
        return not self.armed and self._base.at_rest

    @property
    def inputs(self) -> Input:
        """Object 6000:1."""
        inputs = Input.HELD if self._base.held else Input(0)
        inputs |= Input.ARMED if self.armed else Input(0)
        return inputs | (Input.AIR if self._base.air else Input(0))

    def receive(self, identifier: int, data: bytes) -> None:
        """Take one frame from the bus."""
        super().receive(identifier, data)
        if identifier == frames.NMT and self.at_ease and not self._base.held and self._started_by(data):
            self._base.set_up()

    def take(self, pdo: int, data: bytes) -> None:
        """Take the outputs of RPDO1, obeyed at the next SYNC."""
        if pdo == 1:
            if len(data) != 1:
                raise FrameError(f"outputs RPDO1 has {len(data)} bytes; it must have 1")
            self._ask(data[0])

    def sync(self, counter: int) -> None:
        """Do what a SYNC asks: live through the time passed, say what is, take the outputs asked for."""
        # A base that moves would have missed more of them long before, by a clock of its own.
        busy = not self._base.at_rest and not self._shared_clock
        passed = self._syncs.take(counter, PATIENCE + 1 if busy else frames.SYNC_COUNTS)
        if self._syncs.astray and self._outputs:
            self._fail(_SYNC_LOST)
        if passed == 0:
            return  # the same SYNC twice, an old one, or somebody else's
        for _ in range(passed or 0):
            self._base.advance()
        if self.node.operational:
            self.node.send(frames.TPDO1 + self.node.identifier, bytes([self.inputs]))
            self._obey()

    def elapse(self, cycles: int) -> None:
        """Live through `cycles` without SYNC, told by the device's own clock; the next SYNC starts the count anew."""
        if self._outputs:
            self._fail(_SYNC_LOST)
        self._syncs.forget()
        for _ in range(cycles):
            self._base.advance()

    def leave_operational(self) -> None:
        """Set the outputs to their error values."""
        self._fall_back()

    def lost(self, node: int) -> None:  # noqa: ARG002 - there is one host
        """Set the outputs to their error values: the host has died."""
        if self._outputs:
            self._fail(_HEARTBEAT_LOST)

    def _ask(self, outputs: int) -> None:
        self._asked = Output(outputs & 0x07)

    def _obey(self) -> None:
        """Take the outputs asked for; releasing needs a base that was armed before."""
        if Output.RELEASE in self._asked and self.armed:
            self._base.release()
        self._outputs = self._asked
        self._base.air = Output.AIR in self._outputs

    def _fail(self, code: int) -> None:
        self._fall_back()
        self.node.emergency(code, _COMMUNICATION_ERROR)

    def _fall_back(self) -> None:
        objects = self.node.objects
        mode, value = objects.get(0x6206, 1), objects.get(0x6207, 1)
        self._outputs = self._asked = Output((self._outputs & ~mode | value & mode) & 0x07)
        self._base.air = Output.AIR in self._outputs

    def _started_by(self, data: bytes) -> bool:
        try:
            command, node = frames.unpack_nmt(data)
        except FrameError:
            return False
        return command == NmtCommand.START and node in (0, self.node.identifier)
