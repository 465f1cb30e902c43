"""What goes through the buses that faults put between nodes, bus and host."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator

import numpy as np
import pytest

from devices.cia301 import frames
from devices.cia301.buses import CanBus, open_bus
from devices.cia402.frames import pack_target, unpack_target
from devices.cia402.states import ENABLE_OPERATION
from devices.clock import ManualClock
from devices.errors import BusFailure, FaultRefused
from devices.faults.catalogue import parse_fault
from devices.faults.foreign import ForeignMaster
from devices.faults.host_bus import HostBus
from devices.faults.injector import Injector
from devices.faults.node_bus import NodeBus
from devices.faults.schedule import Schedule

SYNC = (frames.SYNC, frames.pack_sync(1))
TPDO = (0x181, b"123456")
H = 1e-3
_channels = itertools.count()


class Ends:
    """A bus with a node's end behind `NodeBus` and a host's end behind `HostBus`, and a plain third one."""

    def __init__(self, *faults: str) -> None:
        channel = f"fault buses {next(_channels)}"
        self.ends = [open_bus("virtual", channel) for _ in range(4)]
        node, host, another, self.third = self.ends
        self.clock = ManualClock()
        self.schedule = Schedule([parse_fault(fault) for fault in faults], self.clock, H)
        self.schedule.start()
        self.polls = 0
        self.node = NodeBus(node, self.schedule, np.random.default_rng(1), 1, self._poll)
        self.host = HostBus(host, self.schedule, ForeignMaster(another, self.schedule, 1), self._poll)

    def _poll(self) -> None:
        self.polls += 1
        self.node.look()


@pytest.fixture
def ends() -> Iterator[Callable[..., Ends]]:
    made: list[Ends] = []

    def make(*faults: str) -> Ends:
        made.append(Ends(*faults))
        return made[-1]

    yield make
    for each in made:
        for bus in each.ends:
            bus.close()


def heard(bus: CanBus) -> list[tuple[int, bytes]]:
    return list(iter(bus.receive, None))


def test_before_its_time_everything_goes_through(ends) -> None:
    both = ends(
        "node_silent@1", "host_bus_off@1", "second_master@1", "receive_queue_full@1", "sync_lost@1", "bus_off@1"
    )
    both.host.send(*SYNC)
    assert heard(both.node) == [SYNC]
    both.node.send(*TPDO)
    assert heard(both.host) == [TPDO]
    assert heard(both.third) == [SYNC, TPDO]
    assert both.polls > 0
    assert str(both.node) == str(both.host) == str(both.third)


def test_so_many_syncs_are_lost_and_nothing_else(ends) -> None:
    both = ends("sync_lost@0.002:2")
    arrived = []
    for k in range(6):
        both.clock.wait_until(k * H)
        both.host.send(frames.SYNC, frames.pack_sync(k + 1))
        both.host.send(0x201, bytes(6))
        arrived += [data[0] for identifier, data in heard(both.node) if identifier == frames.SYNC]
    assert arrived == [1, 2, 5, 6]


def test_a_late_sync_comes_late(ends) -> None:
    both = ends("sync_late@0:0.004")
    both.host.send(*SYNC)
    assert heard(both.node) == [SYNC]
    assert both.clock.now() == pytest.approx(0.004)
    both.host.send(*SYNC)
    heard(both.node)
    assert both.clock.now() == pytest.approx(0.004)


@pytest.mark.parametrize("fault", ["node_silent@0", "bus_off@0"])
def test_a_line_that_is_cut_is_cut_both_ways(ends, fault: str) -> None:
    both = ends(fault)
    both.host.send(*SYNC)
    assert heard(both.node) == []
    both.node.send(*TPDO)
    assert heard(both.host) == []


def test_a_silent_sensor_is_not_heard_and_the_drive_is(ends) -> None:
    both = ends("node_silent@0:2")
    both.node.send(0x182, b"1234")
    both.node.send(*TPDO)
    assert heard(both.host) == [TPDO]
    both.host.send(*SYNC)
    assert heard(both.node) == [SYNC]


def test_bus_off_recovers_and_says_so(ends) -> None:
    both = ends("bus_off@0.010")
    said: list[float] = []
    both.node.recovered = lambda: said.append(both.clock.now())
    for k in range(600):
        both.clock.wait_until(k * H)
        both.host.send(*SYNC)
        arrived = heard(both.node)
        assert (arrived == []) == (10 <= k < 510)
    assert said == [pytest.approx(0.510)]


def test_heartbeats_that_end(ends) -> None:
    both = ends("heartbeat_lost@0", "host_heartbeat_lost@0")
    both.node.send(0x701, b"\x05")
    both.node.send(0x702, b"\x05")
    both.node.send(*TPDO)
    assert heard(both.host) == [(0x702, b"\x05"), TPDO]
    both.host.send(frames.HEARTBEAT + frames.HOST_NODE, b"\x05")
    both.host.send(*SYNC)
    assert heard(both.node) == [SYNC]


def test_a_host_that_is_bus_off(ends) -> None:
    both = ends("host_bus_off@0")
    with pytest.raises(BusFailure, match="is bus-off"):
        both.host.send(*SYNC)
    with pytest.raises(BusFailure, match="is bus-off"):
        both.host.receive()
    both.clock.advance(0.5)
    both.host.send(*SYNC)
    assert both.host.receive() is None


def test_a_full_queue_has_foreign_frames_and_loses_ours(ends) -> None:
    both = ends("receive_queue_full@0:5")
    both.host.send(*SYNC)
    both.node.send(*TPDO)
    arrived = heard(both.host)
    assert len(arrived) == 5
    assert TPDO not in arrived
    both.clock.advance(0.005)
    both.node.send(*TPDO)
    assert heard(both.host) == [TPDO]


def test_a_second_master_comes_between_set_point_and_sync(ends) -> None:
    both = ends("second_master@0:0.001")
    both.host.send(0x201, pack_target(ENABLE_OPERATION, 5))
    both.host.send(*SYNC)
    arrived = heard(both.node)
    assert [identifier for identifier, _ in arrived] == [0x201, 0x201, frames.SYNC, frames.SYNC]
    assert unpack_target(arrived[1][1]) == (ENABLE_OPERATION, 1_000_000)


def test_a_foreign_set_point_jumps_from_the_host_s_own_once(ends) -> None:
    both = ends("setpoint_on_bus@0:0.002")
    for _ in range(2):
        both.host.send(0x201, pack_target(ENABLE_OPERATION, 5_000))
        both.host.send(*SYNC)
    targets = [unpack_target(data) for identifier, data in heard(both.node) if identifier == 0x201]
    assert targets == [(ENABLE_OPERATION, target) for target in (5_000, 2_005_000, 5_000)]


def test_a_foreign_command_and_a_taken_number(ends) -> None:
    both = ends("foreign_nmt@0:2", "host_number_taken@0")
    for k in range(150):
        both.clock.wait_until(k * H)
        both.host.send(*SYNC)
    arrived = [frame for frame in heard(both.third) if frame[0] != frames.SYNC]
    beat = (frames.HEARTBEAT + frames.HOST_NODE, b"\x05")
    assert arrived == [(frames.NMT, b"\x02\x00"), beat, beat]


def test_closing_them_closes_nothing(ends) -> None:
    both = ends()
    both.node.close()
    both.host.close()
    both.third.send(*TPDO)
    assert heard(both.node) == heard(both.host) == [TPDO]


def test_the_other_master_s_end_never_fills_up() -> None:
    """Read by nobody, a full queue of the virtual bus would hold every sender."""
    channel = f"fault buses {next(_channels)}"
    with open_bus("virtual", channel) as end, open_bus("virtual", channel, rx_queue_size=10) as another:
        clock = ManualClock()
        schedule = Schedule([parse_fault("foreign_nmt@1")], clock, H)
        host = HostBus(end, schedule, ForeignMaster(another, schedule, 1), lambda: None)
        for _ in range(100):
            host.send(0x201, pack_target(ENABLE_OPERATION, 0))
            host.send(*SYNC)


def test_a_machine_without_the_part_refuses_the_fault() -> None:
    class Bare:
        """An emulation of somebody else's."""

        def live_alone(self) -> None: ...

    for fault, part in (("encoder_frozen", "encoder"), ("accelerometer_stuck", "accelerometer"), ("bus_off", "drive")):
        injector = Injector([parse_fault(f"{fault}@1")], ManualClock(), H, np.random.default_rng(1))
        with open_bus("virtual", f"fault buses {next(_channels)}") as bus:
            injector.node_bus(bus)
            with pytest.raises(FaultRefused, match=f"fault {fault} needs an? .*{part}; this machine has none"):
                injector.take_over(Bare(), host_here=True)


@pytest.mark.parametrize("fault", ["setpoint_on_bus@0:2", "setpoint_on_bus@0:-2", "second_master@0:2"])
def test_the_largest_foreign_set_points_fit_their_frame(ends, fault: str) -> None:
    both = ends(fault)
    both.host.send(0x201, pack_target(ENABLE_OPERATION, 140_000_000))
    both.host.send(*SYNC)
    assert [len(data) for identifier, data in heard(both.node) if identifier == 0x201] == [6, 6]
