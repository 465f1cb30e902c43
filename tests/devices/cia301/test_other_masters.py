"""Own frames that come back are told from those of another master; what is wrong with a bus is said in the cycle."""

from __future__ import annotations

import itertools
import socket
from collections.abc import Iterator

import pytest

from devices.cia301 import frames
from devices.cia301.buses import CanBus, open_bus
from devices.cia301.disturbance import MOST_ERRORS
from devices.cia402.frames import pack_target
from devices.cia402.states import ENABLE_OPERATION
from devices.errors import BusDisturbed, DeviceError

FRAME = (0x201, b"\x0f\x00abcd")
_channels = itertools.count()


def _free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


@pytest.fixture(params=["udp_multicast", "virtual", "virtual, echoing"])
def ends(request: pytest.FixtureRequest) -> Iterator[tuple[CanBus, CanBus]]:
    """Two ends of one bus."""
    interface, _, echoing = request.param.partition(", ")
    if interface == "virtual":
        options = {"channel": f"echo {next(_channels)}", "receive_own_messages": bool(echoing)}
    else:
        options = {"port": _free_port()}
    try:
        with open_bus(interface, **options) as one, open_bus(interface, **options) as other:
            one.send(0x123, b"probe")
            if other.receive(0.5) is None:
                pytest.skip("UDP multicast does not reach its own machine here")
            one.receive(0.05)
            yield one, other
    except DeviceError as error:
        pytest.skip(str(error))


def test_an_own_frame_does_not_come_back_and_the_same_of_another_does(ends: tuple[CanBus, CanBus]) -> None:
    one, other = ends
    for _ in range(3):
        one.send(*FRAME)
        assert other.receive(0.5) == FRAME
        assert one.receive(0.05) is None
        other.send(*FRAME)
        assert one.receive(0.5) == FRAME


def test_error_frames_are_counted_apart(ends: tuple[CanBus, CanBus]) -> None:
    one, other = ends
    one.send_error()
    one.send(*FRAME)
    assert other.receive(0.5) == FRAME
    assert (other.errors, other.ignored) == (1, 0)


@pytest.mark.parametrize(
    ("frame", "what"),
    [
        ((frames.SYNC, frames.pack_sync(77)), "SYNC"),
        ((0x201, pack_target(ENABLE_OPERATION, 0)), "set-points"),
        ((frames.NMT, b"\x01\x05"), "NMT"),
        ((frames.HEARTBEAT + frames.HOST_NODE, b"\x05"), "the host's heartbeat"),
        ((0x601, bytes(8)), "SDO requests"),
    ],
)
def test_another_master_is_named(rig, frame: tuple[int, bytes], what: str) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0, 0.0])
    rig.tap.send(*frame)
    with pytest.raises(BusDisturbed, match=rf"^another master sends {what} on .*, the bus of quanser_st3$"):
        rig.follow([0.0, 0.0], 2)
    rig.table.quick_stop()
    assert rig.emulator.drive.at_ease


def test_who_was_there_before_the_run_is_forgotten(rig) -> None:
    rig.tap.send(frames.HEARTBEAT + frames.HOST_NODE, b"\x05")
    rig.table.enable(0.0)
    rig.follow([0.0] * 5)
    assert rig.table.counts.commands == 1


def test_others_that_do_not_command_are_left_alone(rig) -> None:
    rig.table.enable(0.0)
    for frame in ((0x585, bytes(8)), (0x205, bytes(6)), (0x705, b"\x05"), (0x605, bytes(8))):
        rig.tap.send(*frame)
    rig.follow([0.0] * 5)
    assert rig.table.counts.foreign == 4


@pytest.mark.parametrize("count", [MOST_ERRORS, MOST_ERRORS + 1])
def test_error_frames_end_a_run_where_they_are_many(rig, count: int) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    for _ in range(count):
        rig.tap.send_error()
    if count == MOST_ERRORS:
        rig.follow([0.0] * 50, 1)
        return
    with pytest.raises(BusDisturbed, match="16 error frames within 2 cycles: look at cable, termination and bit rate"):
        rig.follow([0.0] * 50, 1)
