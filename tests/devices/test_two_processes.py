"""The same frames between two processes, over multicast on this machine."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from devices.cia301.buses import open_bus
from devices.cia402.states import State
from devices.clock import WallClock
from devices.errors import BusUnavailable, DriveFault
from devices.positioning import bring_to
from devices.quanser_st3.driver import open_table
from tests.devices.far_process import FarProcess, free_port, multicast_works

if TYPE_CHECKING:
    from collections.abc import Iterator

H = 1e-3


@pytest.fixture(scope="module")
def port() -> int:
    number = free_port()
    if not multicast_works(number):
        pytest.skip("UDP multicast does not reach its own machine here")
    return number


@pytest.fixture
def far(port: int) -> Iterator[FarProcess]:
    process = FarProcess("emulator_process.py", "__emulator__", port=port)
    try:
        assert process.ready.wait(20.0)
        yield process
    finally:
        process.close()


def test_a_motion_between_two_processes(far: FarProcess, port: int) -> None:
    clock = WallClock()
    with open_bus("udp_multicast", port=port) as bus, open_table(bus, time_limit=0.5) as table:
        table.enable(0.0)
        start = clock.now()
        samples = []
        cycle = 0
        while cycle < 200:
            clock.wait_until(start + cycle * H)
            x = 0.005 * (1.0 - math.cos(math.tau * 5.0 * (cycle + 1) * H))
            samples.append(table.exchange(cycle, x))
            cycle = max(cycle + 1, int((clock.now() - start) / H))  # late cycles are missed, not made up for
        table.quick_stop()
        echoes = bus.echoes
    assert max(s.position for s in samples) == pytest.approx(0.01, abs=1e-3)
    assert all(s.rotation == pytest.approx(0.01, abs=1e-9) for s in samples[1:])
    assert echoes > 0
    state, standstill, cycles = far.end()
    assert (state, standstill) == ("switch on disabled", True)
    assert cycles >= samples[-1].cycle


def test_a_host_that_falls_silent_leaves_no_moving_table(far: FarProcess, port: int) -> None:
    with open_bus("udp_multicast", port=port) as bus:
        table = open_table(bus, time_limit=0.5)
        table.enable(0.0)
        clock = WallClock()
        start = clock.now()
        cycle, moved = 0, 0.0
        while cycle < 70:
            clock.wait_until(start + cycle * H)
            moved = 0.005 * (1.0 - math.cos(math.tau * 5.0 * (cycle + 1) * H))
            table.exchange(cycle, moved)
            cycle = max(cycle + 1, int((clock.now() - start) / H))
        # not a word more; the drive says by itself that it stops
        codes = []
        for _ in range(500):
            frame = bus.receive(0.01)
            if frame is not None and frame[0] == 0x081:
                codes.append(frame[1][:2])
                break
        assert codes == [b"\x00\x87"]
        state, standstill, _ = far.end()
    assert (state, standstill) == ("fault", True)


def test_the_next_host_after_one_that_died(far: FarProcess, port: int) -> None:
    clock = WallClock()
    with open_bus("udp_multicast", port=port) as bus:
        first = open_table(bus, time_limit=0.5)
        first.enable(0.0)
        start, cycle = clock.now(), 0
        while cycle < 70:
            clock.wait_until(start + cycle * H)
            first.exchange(cycle, 0.005 * (1.0 - math.cos(math.tau * 5.0 * (cycle + 1) * H)))
            cycle = max(cycle + 1, int((clock.now() - start) / H))
        # dead: not a word more; its emergency frame goes to nobody
        for _ in range(500):
            frame = bus.receive(0.01)
            if frame is not None and frame[0] == 0x081:
                break
    with open_bus("udp_multicast", port=port) as bus, open_table(bus, time_limit=0.5) as table:
        with pytest.raises(DriveFault, match="twin run --reset"):
            table.enable(table.position)
        for _ in range(500):
            # The drive's ramp ends with SYNC or without.
            clock.wait_until(clock.now() + H)
            table._paced(None)
            if table.state is State.FAULT:
                break
        table.reset_fault()
        for _ in range(2):
            assert bring_to(table, 0.001, 1.0, clock)
            table.enable(0.001)
            table.exchange(0, 0.001)
            table.disable()
    assert far.end()[:2] == ("switch on disabled", True)


def test_nobody_at_the_other_end() -> None:
    from devices.cia402.master import Cia402Table
    from devices.errors import DeviceTimeout
    from devices.quanser_st3.capacity import CAPACITY

    try:
        bus = open_bus("udp_multicast", port=free_port())
    except BusUnavailable as reason:
        pytest.skip(str(reason))
    with bus, pytest.raises(DeviceTimeout, match="does not answer"):
        Cia402Table(bus, CAPACITY, time_limit=0.01, open_limit=0.05).open()
