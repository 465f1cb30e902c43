"""A stop reaches a standstill whatever fails on the way, and says so where it cannot."""

from __future__ import annotations

import itertools
import math
from typing import TYPE_CHECKING

import pytest

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.cia402 import states
from devices.cia402.frames import pack_target
from devices.cia402.states import State
from devices.errors import BusFailure, DeviceError, DeviceNotReady, DeviceTimeout
from devices.sample import Sample

if TYPE_CHECKING:
    from collections.abc import Callable

H = 1e-3
SPEED = 0.3


def in_motion(rig) -> int:
    """Enable, and bring the table to `SPEED`; return the next cycle."""
    rig.table.enable(0.0)
    x = v = 0.0
    for cycle in itertools.count():
        if v >= SPEED:
            return cycle
        v += 5.0 * H
        x += v * H
        rig.table.exchange(cycle, x)
    raise AssertionError


def at_rest(rig) -> bool:
    return rig.emulator.drive.standstill and rig.emulator.drive.state in (State.SWITCH_ON_DISABLED, State.FAULT)


def answering(rig, identifier: int, answer: Callable[[bytes], bytes | None]) -> None:
    """Put something between a node and the bus: bytes as they shall arrive, None where they shall not."""
    for node in (rig.emulator.drive.node, rig.emulator.sensor.node):

        def send(number: int, data: bytes, real=node.send) -> None:
            sent = answer(data) if number == identifier else data
            if sent is not None:
                real(number, sent)

        node.send = send


@pytest.fixture
def undisturbed(make_rig) -> int:
    """Cycles a stop takes."""
    rig = make_rig()
    in_motion(rig)
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    return len(way)


@pytest.mark.parametrize("answer", [lambda _: None, lambda _: b"", lambda data: data + b"\0"])
def test_the_specimens_sensor_is_not_needed(rig, undisturbed: int, answer) -> None:
    cycle = in_motion(rig)
    answering(rig, 0x182, answer)
    with pytest.raises(DeviceError):
        rig.table.exchange(cycle, 0.0 + rig.table._limits.position + SPEED * H)
    assert rig.emulator.plant.velocity > 0.8 * SPEED
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    assert at_rest(rig)
    assert not rig.table.powered
    # no slower for it: the drive's ramp is paced by SYNC
    assert abs(len(way) - undisturbed) < 20
    assert all(math.isnan(sample.rotation) and math.isfinite(sample.acceleration) for sample in way)
    rig.table.close()


def test_a_silent_sensor_does_not_slow_the_stop_down(rig) -> None:
    """A drive in another process lives by SYNC: one every 20 ms only would make its ramp twenty times as long."""
    in_motion(rig)
    answering(rig, 0x182, lambda _: None)
    serviced = rig.table._link._idle

    def idle() -> None:
        serviced()
        rig.clock.advance(20e-6)

    rig.table._link._idle = idle
    before = rig.clock.now()
    rig.table.quick_stop()
    assert at_rest(rig)
    assert rig.clock.now() - before < 2.0 * SPEED / 1.0


def test_without_acceleration_it_stops_too(rig) -> None:
    in_motion(rig)
    answering(rig, 0x281, lambda _: None)
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    assert at_rest(rig)
    assert way == []


@pytest.mark.parametrize("spoil", [lambda _: None, lambda _: b"\x37\x16"])
def test_lost_or_malformed_answers_of_the_drive_are_waited_out(rig, spoil) -> None:
    in_motion(rig)
    spoiled = iter([*[True] * 40, *[True, False] * 50])
    answering(rig, 0x181, lambda data: spoil(data) if next(spoiled, False) else data)
    rig.table.quick_stop()
    assert at_rest(rig)


def test_a_bus_that_comes_back(rig) -> None:
    in_motion(rig)
    send, receive, gone = rig.host.send, rig.host.receive, iter([True] * 300)

    def failing(what, *arguments):
        if next(gone, False):
            raise BusFailure("the cable is out")
        return what(*arguments)

    rig.host.send = lambda *arguments: failing(send, *arguments)
    rig.host.receive = lambda *arguments: failing(receive, *arguments)
    before = rig.clock.now()
    rig.table.quick_stop()
    assert at_rest(rig)
    # each attempt is paced, so that a bus that is gone is not asked a thousand times in a moment
    assert rig.clock.now() - before > 0.1


def test_a_node_that_left_operation_is_started_again(rig) -> None:
    in_motion(rig)
    rig.emulator.drive.receive(frames.NMT, frames.pack_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 1))
    rig.table.quick_stop()
    assert at_rest(rig)
    assert rig.emulator.drive.state is State.FAULT


def test_power_off_is_no_standstill(rig) -> None:
    """Somebody took the power off: the table still runs down, and is waited for."""
    in_motion(rig)
    rig.tap.send(0x201, pack_target(states.DISABLE_VOLTAGE, 0))
    rig.emulator.service()
    rig.emulator.drive.sync(frames.sync_counter(rig.table._bus_cycle + 1))
    rig.table._bus_cycle += 1
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert rig.emulator.plant.velocity > 0.8 * SPEED
    rig.table.quick_stop()
    assert abs(rig.emulator.plant.velocity) < 0.03


def test_no_standstill_is_said_plainly_and_close_tries_again(rig) -> None:
    cycle = in_motion(rig)
    receive = rig.emulator.drive.receive
    rig.emulator.drive.receive = lambda *_: None
    with pytest.raises(
        DeviceTimeout, match=r"within 3 s \(no statusword and position .*\): THE TABLE MAY STILL BE MOVING"
    ):
        rig.table.quick_stop()
    assert rig.table.powered
    with pytest.raises(DeviceNotReady, match="before it is enabled"):
        rig.table.exchange(cycle, 0.0)
    rig.emulator.drive.receive = receive
    rig.table.close()
    assert at_rest(rig)
    assert not rig.table.powered


def test_a_stop_that_the_drive_does_not_make_says_its_state(rig) -> None:
    in_motion(rig)
    rig.emulator.drive._states.command = lambda *_, **__: None
    rig.emulator.drive._states.stopped = lambda: None
    with pytest.raises(DeviceTimeout, match=r"it last was in fault reaction active"):
        rig.table.quick_stop()
    rig.table._powered = False


def test_the_time_limit_is_in_seconds_not_in_attempts(rig) -> None:
    in_motion(rig)

    def idle() -> None:
        rig.clock.advance(0.5e-3)

    rig.table._link._idle = idle
    before = rig.clock.now()
    with pytest.raises(DeviceTimeout, match="MAY STILL BE MOVING"):
        rig.table.quick_stop()
    assert 3.0 < rig.clock.now() - before < 3.1


def test_disable_needs_no_sensor(rig) -> None:
    rig.table.enable(0.0)
    rig.table.exchange(0, 0.0)
    answering(rig, 0x182, lambda _: None)
    rig.table.disable()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert not rig.table.powered


def test_a_table_that_did_not_come_up_is_stopped_on_closing(rig) -> None:
    """An answer lost on the way up leaves a drive that may have power."""
    answers = iter([True] * 4)
    answering(rig, 0x181, lambda data: data if next(answers, False) else None)
    with pytest.raises(DeviceTimeout, match="no statusword"):
        rig.table.enable(0.0)
    answering(rig, 0x000, lambda data: data)
    rig.emulator.drive.node.send = rig.emulator._bus.send
    assert rig.table.powered
    rig.table.close()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
