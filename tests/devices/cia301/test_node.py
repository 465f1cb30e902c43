"""The CANopen side of an emulated device: states, heartbeats, emergencies, and who may command it."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand, NmtState
from tests.devices.cia301.example import Example


def booted(**arguments) -> Example:
    device = Example(**arguments)
    device.boot()
    device.sent.clear()
    return device


def nmt(device: Example, command: int, node: int = 5) -> None:
    device.receive(frames.NMT, bytes([command, node]))


@pytest.mark.parametrize("number", [0, 128, -1])
def test_node_numbers(number: int) -> None:
    with pytest.raises(ValueError, match="1 to 127"):
        Example(number)


def test_boot_up_is_announced_once() -> None:
    device = Example()
    device.boot()
    assert device.sent == [(0x705, b"\0")]
    assert device.node.state is NmtState.PRE_OPERATIONAL


def test_process_data_flow_in_operation_alone() -> None:
    device = booted()
    device.receive(0x205, b"\x07")
    device.receive(frames.SYNC, b"\x01")
    assert device.sent == []
    assert device.heard == [1]
    nmt(device, NmtCommand.START)
    device.receive(0x205, b"\x07")
    device.receive(0x305, b"\x08")
    device.receive(0x206, b"\x09")
    device.receive(frames.SYNC, b"\x02")
    assert device.heard == [1, (1, b"\x07"), (2, b"\x08"), 2]
    assert device.sent == [(0x185, b"\x08")]


@pytest.mark.parametrize(
    ("command", "state"),
    [
        (NmtCommand.STOP, NmtState.STOPPED),
        (NmtCommand.ENTER_PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL),
        (NmtCommand.RESET_NODE, NmtState.PRE_OPERATIONAL),
        (NmtCommand.RESET_COMMUNICATION, NmtState.PRE_OPERATIONAL),
    ],
)
@pytest.mark.parametrize("node", [0, 5])
def test_leaving_operation_is_told_before(command: NmtCommand, state: NmtState, node: int) -> None:
    device = booted()
    nmt(device, NmtCommand.START)
    nmt(device, command, node)
    assert device.node.state is state
    assert device.heard == ["left"]
    resets = command in (NmtCommand.RESET_NODE, NmtCommand.RESET_COMMUNICATION)
    assert ((0x705, b"\0") in device.sent) is resets


def test_others_commands_and_unknown_ones_do_nothing() -> None:
    device = booted()
    nmt(device, NmtCommand.START, 6)
    nmt(device, 0x33)
    assert device.node.state is NmtState.PRE_OPERATIONAL


def test_heartbeat_as_the_eds_says_or_as_told_or_as_written() -> None:
    device = booted()
    for tenths in range(21):
        device.node.beat(0.1 * tenths)
    assert device.sent.count((0x705, b"\x7f")) == 7
    device = booted(heartbeat_period=0.1)
    for tenths in range(21):
        device.node.beat(0.1 * tenths + 1e-6 * tenths)
    assert device.sent.count((0x705, b"\x7f")) == 21
    device.receive(0x605, bytes.fromhex("2b17100000000000"))
    device.sent.clear()
    for tenths in range(21, 40):
        device.node.beat(0.1 * tenths)
    assert device.sent == []


def watch(device: Example, node: int, milliseconds: int) -> None:
    device.receive(0x605, bytes.fromhex("23161001") + (node << 16 | milliseconds).to_bytes(4, "little"))
    assert device.sent.pop()[1][0] == 0x60


def beats(device: Example, times: list[float], *, heard: bool) -> None:
    for now in times:
        if heard:
            device.receive(0x77F, b"\x05")
        device.node.beat(now)


def test_a_watched_heartbeat_that_stays_away_is_told_once() -> None:
    device = booted()
    watch(device, 127, 500)
    # not before the first one was heard (CiA 301)
    beats(device, [0.1 * k for k in range(20)], heard=False)
    assert device.heard == []
    beats(device, [2.0 + 0.1 * k for k in range(20)], heard=True)
    beats(device, [3.9 + 0.1 * k for k in range(6)], heard=False)
    assert device.heard == []
    beats(device, [4.45 + 0.1 * k for k in range(20)], heard=False)
    assert device.heard == ["lost 127"]
    beats(device, [7.0, 7.1], heard=True)
    beats(device, [7.2 + 0.1 * k for k in range(20)], heard=False)
    assert device.heard == ["lost 127", "lost 127"]


def test_time_in_which_it_did_not_look_itself_is_no_silence() -> None:
    device = booted()
    watch(device, 127, 500)
    beats(device, [0.0, 0.1], heard=True)
    beats(device, [0.2, 10.0, 10.1], heard=False)
    assert device.heard == []
    beats(device, [10.2, 10.3, 10.4, 10.5, 10.55], heard=False)
    assert device.heard == ["lost 127"]


def test_a_reset_forgets_whom_to_watch() -> None:
    device = booted()
    watch(device, 127, 500)
    nmt(device, NmtCommand.RESET_COMMUNICATION)
    beats(device, [0.0], heard=True)
    beats(device, [0.1 * k for k in range(30)], heard=False)
    assert device.heard == []
    assert device.node.objects.get(0x1016, 1) == 0


def test_emergencies_are_sent_and_remembered() -> None:
    device = booted()
    for code in range(1, 11):
        device.node.emergency(code, 0x21)
    assert device.sent[-1] == (0x085, bytes([10, 0, 0x21, 0, 0, 0, 0, 0]))
    objects = device.node.objects
    assert objects.get(0x1001) == 0x21
    assert [objects.get(0x1003, sub) for sub in range(9)] == [8, 10, 9, 8, 7, 6, 5, 4, 3]
    device.node.emergency(0, 0)
    assert objects.get(0x1001) == 0
    assert objects.get(0x1003) == 8


def test_a_stopped_node_says_nothing_but_its_heartbeat() -> None:
    device = booted()
    nmt(device, NmtCommand.STOP)
    device.receive(0x605, bytes.fromhex("4000100000000000"))
    device.node.emergency(0x1000, 1)
    assert device.sent == []
    device.node.beat(0.0)
    assert device.sent == [(0x705, b"\x04")]


def test_malformed_frames_are_counted_and_do_nothing() -> None:
    device = booted()
    watch(device, 127, 500)
    nmt(device, NmtCommand.START)
    for identifier, data in (
        (0, b"\x01"),
        (0x80, b""),
        (0x80, b"\xf1"),
        (0x205, b""),
        (0x605, b"\x40"),
        (0x77F, b"\x33"),
    ):
        device.receive(identifier, data)
    assert device.node.refused_frames == 6
    assert device.heard == []


@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=50))
def test_no_bytes_raise(events: list[tuple[int, bytes]]) -> None:
    device = booted()
    for k, (identifier, data) in enumerate(events):
        device.receive(identifier, data)
        device.node.beat(0.1 * k)
    assert all(0 <= identifier < 0x800 and len(data) <= 8 for identifier, data in device.sent)
