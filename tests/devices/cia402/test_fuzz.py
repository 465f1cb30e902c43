"""Whatever bytes come: no exception, and no movement beyond the capacity."""

from __future__ import annotations

import contextlib
import struct
from typing import NamedTuple

from hypothesis import given, settings
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.buses import open_bus
from devices.cia301.dictionary import ObjectStore
from devices.cia402 import states
from devices.cia402.drive import Drive
from devices.cia402.frames import pack_target
from devices.cia402.master import Cia402Table
from devices.cia402.units import SERVO_DRIVE
from devices.clock import ManualClock
from devices.errors import DeviceError
from excitation import Capacity
from tests.devices.cia402.rail import Rail

H = 1e-3
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})
HOMING_ENDS = 0.6 * CAPACITY.stroke


class Watched(Rail):
    """A rail that looks at every step it is told to make."""

    def __init__(self) -> None:
        super().__init__()
        self.speed = 0.0
        self.steps = 0

    def advance(self, setpoint: float) -> None:
        before, h = self.position, self.cycle_time
        super().advance(setpoint)
        if not self.powered:
            # Without power no set-point is followed: this rail stands where it was let go, with no ramp of its own.
            self.speed = 0.0
            return
        self.steps += 1
        step = self.position - before
        speed = step / h
        assert abs(speed) <= CAPACITY.velocity + 2e-6
        assert abs(speed - self.speed) / h <= CAPACITY.acceleration + 8e-9 / h**2 + 1e-6
        assert abs(self.position) <= HOMING_ENDS
        self.speed = speed


OBJECTS = sorted({(index, sub) for index in ObjectStore(SERVO_DRIVE, 1).object_dictionary for sub in (0, 1, 2)})
INDEX = st.one_of(st.sampled_from(OBJECTS), st.tuples(st.integers(0, 0xFFFF), st.integers(0, 0xFF)))
# Numbers near what is meant, so that some are taken.
VALUE = st.one_of(
    st.integers(-10, 300), st.integers(-(2**31), 2**32 - 1), st.sampled_from([17, 18, 35, 37, 6, 8, 500, 1000, 50_000])
)


def download(index: int, sub: int, value: int, size: int) -> bytes:
    """An expedited download of 1, 2 or 4 bytes."""
    return struct.pack("<BHB", 0x23 | (4 - size) << 2, index, sub) + (value & 0xFFFFFFFF).to_bytes(4, "little")


WRITES = st.builds(
    lambda where, value, size: (0x601, download(*where, value, size)), INDEX, VALUE, st.sampled_from([1, 2, 4])
)
SDO = st.one_of(
    WRITES,
    st.builds(lambda where: (0x601, struct.pack("<BHBL", 0x40, *where, 0)), INDEX),
    st.builds(lambda data: (0x601, data), st.binary(max_size=8)),
)
CONTROLWORDS = st.sampled_from(
    [states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION, states.QUICK_STOP, 0, 0x80, 0x1F, 0x11F]
)
TARGETS = st.one_of(st.integers(-(2**31), 2**31 - 1), st.integers(-200, 200).map(lambda k: k * 1000))
RPDO = st.builds(lambda word, target: (0x201, pack_target(word, target)), CONTROLWORDS, TARGETS)
NMT = st.builds(
    lambda command, node: (0x000, bytes([command, node])),
    st.sampled_from([1, 1, 1, 2, 0x80, 0x81, 0x82, 7]),
    st.sampled_from([0, 1, 2]),
)
ANY = st.tuples(
    st.sampled_from([0x000, 0x080, 0x081, 0x181, 0x201, 0x301, 0x601, 0x701, 0x77F, 0x7FF]), st.binary(max_size=8)
)
SYNCS = st.integers(1, 60)
BEAT = st.floats(0.0, 1.0)
WAY_UP = st.just("up")
"""Walk up where it stands: by chance nobody would."""


class Run(NamedTuple):
    """Set-points that speed up steadily, from what the drive follows now."""

    cycles: int
    acceleration: float


RUNS = st.builds(Run, st.integers(1, 120), st.floats(-12.0, 12.0))


class Bus:
    """The drive, its watched rail, and what was sent."""

    def __init__(self) -> None:
        self.rail = Watched()
        self.sent: list[tuple[int, bytes]] = []
        self.drive = Drive(1, lambda *frame: self.sent.append(frame), self.rail, CAPACITY, H)
        self.drive.boot()
        self.counter = 0
        self.now = 0.0

    def sync(self, steps: int = 1) -> None:
        self.counter += steps
        self.drive.receive(frames.SYNC, frames.pack_sync(frames.sync_counter(self.counter)))

    def walk_up(self) -> None:
        self.drive.receive(0x000, b"\x01\x01")
        for word in (0, 0x80, 0, states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
            here = round(self.drive.axis.measured / self.drive.units.position)
            self.drive.receive(0x201, pack_target(word, max(-(2**31), min(2**31 - 1, here))))
            self.sync()

    def run(self, run: Run) -> None:
        limits = self.drive.interpolator.limits
        position, velocity, h = limits.position, limits.velocity, limits.cycle_time
        for _ in range(run.cycles):
            velocity += run.acceleration * h
            position += velocity * h
            target = round(position / self.drive.units.position)
            self.drive.receive(0x201, pack_target(states.ENABLE_OPERATION, max(-(2**31), min(2**31 - 1, target))))
            self.sync()

    def play(self, event) -> None:
        if event == "up":
            self.walk_up()
        elif isinstance(event, Run):
            self.run(event)
        elif isinstance(event, int):
            self.sync(event)
        elif isinstance(event, float):
            self.now += event
            self.drive.node.beat(self.now)
        else:
            self.drive.receive(*event)


@settings(max_examples=150, deadline=None)
@given(st.lists(st.one_of(SDO, WRITES, RPDO, RPDO, NMT, ANY, SYNCS, BEAT, WAY_UP, RUNS, RUNS), max_size=60))
def test_the_drive_survives_anything_within_its_capacity(events: list) -> None:
    bus = Bus()
    for event in events:
        bus.play(event)
    assert all(0 <= identifier < 0x800 and len(data) <= 8 for identifier, data in bus.sent)
    # And it can be brought to rest.
    bus.drive.receive(0x000, b"\x80\x00")
    for _ in range(200):
        bus.drive.elapse(100)
        if bus.drive.at_ease:
            break
    assert bus.drive.at_ease


@settings(max_examples=60, deadline=None)
@given(
    st.lists(WRITES, max_size=6),
    st.sampled_from([17, 18, 35, 37]),
    st.integers(1, 2**32 - 1),
    st.integers(1, 2**32 - 1),
    st.integers(1, 1500),
    st.sampled_from([states.QUICK_STOP, 0, 0x0F, 0x11F, 0x1F]),
)
def test_homing_with_any_numbers_stays_near(writes, method, speed, acceleration, cycles, end) -> None:
    bus = Bus()
    for index, value in ((0x6098, method), (0x609A, acceleration), (0x6060, 6)):
        bus.drive.receive(0x601, download(index, 0, value, 1 if index != 0x609A else 4))
    for sub in (1, 2):
        bus.drive.receive(0x601, download(0x6099, sub, speed, 4))
    bus.walk_up()
    for write in writes:
        bus.drive.receive(*write)
    for k in range(cycles):
        bus.drive.receive(0x201, pack_target(0x1F if k else 0x0F, 0))
        bus.sync()
    bus.drive.receive(0x201, pack_target(end, 0))
    for _ in range(300):
        bus.sync()
    assert bus.rail.steps > cycles


STRANGERS = st.lists(
    st.one_of(ANY, st.tuples(st.sampled_from([0x081, 0x181, 0x281, 0x581, 0x701, 0x77F]), st.binary(max_size=8))),
    max_size=4,
)


@settings(max_examples=60, deadline=None)
@given(st.lists(STRANGERS, min_size=1, max_size=40))
def test_a_host_among_strangers_raises_nothing_but_our_errors(events: list) -> None:
    """Anybody sends anything to both between the cycles of a run: it goes on, or ends, within the capacity."""
    with (
        open_bus("virtual", "fuzz host") as near,
        open_bus("virtual", "fuzz host") as far,
        open_bus("virtual", "fuzz host") as third,
    ):
        rail, clock = Watched(), ManualClock()
        drive = Drive(1, far.send, rail, CAPACITY, H)
        drive.boot()

        def idle() -> None:
            while (frame := far.receive()) is not None:
                drive.receive(*frame)
            drive.node.beat(clock.now())

        table = Cia402Table(near, CAPACITY, clock=clock, idle=idle)
        table.open()
        table.enable(0.0)
        with contextlib.suppress(DeviceError):
            for cycle, strangers in enumerate(events):
                for stranger in strangers:
                    third.send(*stranger)
                clock.advance(H)
                table.exchange(cycle, 2.0 * ((cycle + 1) * H) ** 2)
        with contextlib.suppress(DeviceError):
            table.close()
        for _ in range(50):
            drive.elapse(100)
        assert rail.velocity == 0.0
