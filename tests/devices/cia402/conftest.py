"""A drive on a rail, by its frames alone, and a whole chain of it with our host."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Any

import pytest

from devices.cia301 import frames
from devices.cia301.buses import CanBus, open_bus
from devices.cia301.frames import NmtCommand
from devices.cia402 import states
from devices.cia402.drive import Drive, DriveOptions
from devices.cia402.frames import pack_target, unpack_actual
from devices.cia402.master import Cia402Table
from devices.cia402.states import State, decode
from devices.clock import ManualClock
from excitation import Capacity
from tests.devices.cia402.rail import Rail

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

H, NM = 1e-3, 1e-9
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})
_channels = itertools.count()


class Bench:
    """A booted and started drive, what it sent at the last SYNC, and the codes of all its emergencies."""

    def __init__(self, position: float = 0.0, rail: type[Rail] = Rail, **options: Any) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.emergencies: list[int] = []
        self.rail = rail(position)
        self.drive = Drive(
            1,
            self._send,
            self.rail,
            CAPACITY,
            H,
            position=position,
            options=DriveOptions(**options),
        )
        self.drive.boot()
        self.drive.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 1))
        self.counter = 0
        self.x, self.v = position, 0.0

    def _send(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, data))
        if identifier == 0x081:
            self.emergencies.append(frames.unpack_emergency(data).code)

    def sync(self, steps: int = 1) -> dict[int, bytes]:
        """One SYNC, so many numbers after the last; what was answered."""
        self.sent.clear()
        self.counter += steps
        self.drive.receive(frames.SYNC, frames.pack_sync(frames.sync_counter(self.counter)))
        return dict(self.sent)

    def cycle(self, controlword: int, target: float | None = None, steps: int = 1) -> int:
        """One RPDO and one SYNC; the statusword answered."""
        target = self.drive.axis.measured if target is None else target
        self.drive.receive(0x201, pack_target(controlword, round(target / NM)))
        return unpack_actual(self.sync(steps)[0x181])[0]

    def up(self) -> Bench:
        """Enable it where it stands."""
        for word in (0, states.FAULT_RESET, 0, states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
            self.cycle(word)
        assert self.drive.state is State.OPERATION_ENABLED, self.emergencies
        self.x, self.v = self.drive.axis.measured, 0.0
        return self

    def to_speed(self, velocity: float, acceleration: float = 9.0) -> Bench:
        """Speed up at a steady rate, as far as the drive follows."""
        step = acceleration * H if velocity > self.v else -acceleration * H
        while self.v != velocity and self.drive.state is State.OPERATION_ENABLED:
            self.v = velocity if abs(velocity - self.v) <= abs(step) else self.v + step
            self.x += self.v * H
            self.cycle(states.ENABLE_OPERATION, self.x)
        return self

    def run_down(self, controlword: int | None = None, limit: int = 5000) -> list[float]:
        """Until nothing moves; the velocities on the way."""
        speeds = [self.rail.velocity]
        for _ in range(limit):
            if self.drive.at_ease:
                return speeds
            if controlword is None:
                self.sync()
            else:
                self.cycle(controlword)
            speeds.append(self.rail.velocity)
        raise TimeoutError("the drive does not come to rest")

    def set(self, index: int, value: int, sub: int = 0) -> int:
        """Write an object by SDO; 0, or the abort code."""
        size = len(self.drive.node.objects.object_dictionary.get_variable(index, sub)) // 8
        head = bytes([0x23 | (4 - size) << 2]) + index.to_bytes(2, "little") + bytes([sub])
        self.sent.clear()
        self.drive.receive(0x601, head + (value & 0xFFFFFFFF).to_bytes(4, "little"))
        answer = self.sent.pop()[1]
        return 0 if answer[0] == 0x60 else int.from_bytes(answer[4:], "little")

    def get(self, index: int, sub: int = 0) -> int:
        """Read an object as the SDO server does."""
        return self.drive.node.objects.get(index, sub)


class Chain:
    """Our host, two ends of a virtual bus, and a drive on a rail, on one thread and a manual clock."""

    def __init__(self, host: CanBus, far: CanBus, position: float, options: dict[str, Any], host_options: Any) -> None:
        self.clock = ManualClock()
        self.bus, self.far = host, far
        self.rail = Rail(position)
        self.drive = Drive(1, far.send, self.rail, CAPACITY, H, position=position, options=DriveOptions(**options))
        self.drive.boot()
        self.deaf = False
        self.table = Cia402Table(host, CAPACITY, clock=self.clock, idle=self.idle, **host_options)

    def idle(self) -> None:
        """Let the drive answer."""
        while (frame := self.far.receive()) is not None:
            if not self.deaf:
                self.drive.receive(*frame)
        self.drive.node.beat(self.clock.now())

    def state(self) -> State | None:
        """As the host sees it."""
        return decode(self.table._feedback.statusword)


@pytest.fixture
def make_chain() -> Iterator[Callable[..., Chain]]:
    """Factory of chains; nothing is opened yet."""
    buses: list[CanBus] = []

    def make(position: float = 0.0, options: dict[str, Any] | None = None, **host_options: Any) -> Chain:
        channel = f"cia402 {next(_channels)}"
        host, far = open_bus("virtual", channel), open_bus("virtual", channel)
        buses.extend((host, far))
        return Chain(host, far, position, options or {}, host_options)

    yield make
    for bus in buses:
        bus.close()
