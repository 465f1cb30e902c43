"""What the host takes in, beats out, and misses."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.frames import NmtState
from devices.cia301.host import HEARTBEAT_LIMIT, HEARTBEAT_PERIOD, Host
from devices.clock import ManualClock


class Script:
    """A bus that hands over what it is told to, and writes down what is sent."""

    errors = 0

    def __init__(self, *frames_in: tuple[int, bytes]) -> None:
        self.waiting = list(frames_in)
        self.sent: list[tuple[int, bytes]] = []

    def send(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, bytes(data)))

    def receive(self, time_limit: float = 0.0) -> tuple[int, bytes] | None:
        return self.waiting.pop(0) if self.waiting else None


def host(*frames_in: tuple[int, bytes], nodes: tuple[int, ...] = (1, 2)) -> tuple[Host, Script, ManualClock]:
    bus, clock = Script(*frames_in), ManualClock(100.0)
    return Host(bus, nodes, clock, None, answers=[0x181], own=[0x201]), bus, clock


def heartbeat(node: int, state: NmtState = NmtState.OPERATIONAL) -> tuple[int, bytes]:
    return frames.HEARTBEAT + node, frames.pack_heartbeat(state)


def test_no_device_can_have_the_hosts_number() -> None:
    with pytest.raises(ValueError, match="node 127 is the host's own"):
        host(nodes=(127,))


def test_only_our_nodes_are_started() -> None:
    ours, bus, _ = host()
    ours.start()
    assert bus.sent == [(0x000, b"\x01\x01"), (0x000, b"\x01\x02")]


def test_it_beats_in_its_own_time() -> None:
    ours, bus, clock = host()
    for _ in range(1000):
        ours.beat()
        clock.advance(1e-3)
    assert set(bus.sent) == {(0x77F, b"\x05")}
    assert len(bus.sent) == pytest.approx(1.0 / HEARTBEAT_PERIOD, abs=1)


def test_every_frame_has_its_place() -> None:
    ours, _, _ = host(
        (0x181, b""),
        (0x581, bytes(8)),
        (0x081, bytes.fromhex("3081110000000000")),
        (0x081, bytes.fromhex("0087110000000000")),
        heartbeat(2),
        (0x701, b"\x33"),
        (0x083, bytes(8)),
        (0x456, b"x"),
    )
    ours.drain()
    counts = ours.counts
    assert (counts.stale, counts.heartbeats, counts.malformed, counts.foreign) == (2, 2, 1, 2)
    # the first cause is what counts
    assert ours.emergencies == {1: frames.Emergency(0x8130, 0x11, bytes(5))}
    assert ours.restarted is None


def test_an_error_reset_forgets_the_cause() -> None:
    ours, bus, _ = host((0x082, bytes.fromhex("3081110000000000")))
    ours.drain()
    assert set(ours.emergencies) == {2}
    bus.waiting.append((0x082, bytes(8)))
    ours.drain()
    assert ours.emergencies == {}


@pytest.mark.parametrize("state", [NmtState.BOOT_UP, NmtState.STOPPED, NmtState.PRE_OPERATIONAL])
def test_a_node_that_is_not_operational_has_restarted(state: NmtState) -> None:
    ours, _, _ = host(heartbeat(2, state))
    ours.drain()
    assert ours.restarted == 2


def look(ours: Host, clock: ManualClock, duration: float, step: float = 0.01) -> list[int]:
    found = []
    for _ in range(round(duration / step)):
        clock.advance(step)
        ours.drain()
        if (node := ours.silent()) is not None:
            found.append(node)
    return found


def test_a_silent_node_is_named_after_the_limit_and_not_before() -> None:
    ours, bus, clock = host()
    ours.watch(1)
    ours.watch(2)
    for _ in range(20):
        bus.waiting += [heartbeat(1), heartbeat(2)]
        assert look(ours, clock, HEARTBEAT_PERIOD) == []
    for _ in range(4):
        bus.waiting.append(heartbeat(1))
        assert look(ours, clock, HEARTBEAT_PERIOD) == []
    bus.waiting.append(heartbeat(1))
    assert set(look(ours, clock, HEARTBEAT_LIMIT - 0.4 + 0.02)) == {2}


def test_nodes_that_are_not_watched_may_be_silent() -> None:
    ours, _, clock = host()
    assert look(ours, clock, 3.0) == []


def test_a_host_that_did_not_look_blames_nobody() -> None:
    ours, _, clock = host()
    ours.watch(1)
    assert look(ours, clock, 0.3) == []
    clock.advance(10.0)
    assert look(ours, clock, HEARTBEAT_LIMIT - 0.02) == []
    assert set(look(ours, clock, 0.2)) == {1}


@settings(max_examples=100)
@given(st.lists(st.tuples(st.integers(0, 0x7FF), st.binary(max_size=8)), max_size=60))
def test_no_bytes_raise(events: list[tuple[int, bytes]]) -> None:
    ours, _, _ = host(*events)
    ours.watch(1)
    assert ours.await_frame(0x181, 0.1) in [None, *(data for identifier, data in events if identifier == 0x181)]
    ours.drain()
    ours.silent()
    counts = ours.counts
    # A heartbeat that makes no sense is counted as both.
    total = counts.stale + max(counts.heartbeats, counts.malformed) + counts.foreign
    assert total <= len(events)
