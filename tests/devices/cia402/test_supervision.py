"""What makes a drive stop by itself: following error, limit switches, the emergency stop, a host that is gone."""

from __future__ import annotations

import itertools

import pytest

from devices.cia301 import frames
from devices.cia402 import states
from devices.cia402.machine import Switches
from devices.cia402.states import State
from devices.cia402.supervision import EMERGENCY_STOP, LIMIT_SWITCH, TOO_FAR
from tests.devices.cia402.conftest import Bench, H
from tests.devices.cia402.rail import Rail

WINDOW, PATIENCE = 2e-3, 5


def astray(bench: Bench, cycles: int) -> None:
    """Go on commanding while the table is held."""
    for _ in range(cycles):
        bench.x += bench.v * H
        bench.cycle(states.ENABLE_OPERATION, bench.x)


def test_a_blocked_table_is_a_following_error() -> None:
    bench = Bench(following_error=WINDOW, following_time=PATIENCE * H).up().to_speed(0.1)
    bench.rail.blocked = True
    astray(bench, 20 + PATIENCE)
    assert bench.emergencies == []
    assert bench.drive.statusword & states.FOLLOWING_ERROR
    astray(bench, 3)
    assert bench.emergencies == [TOO_FAR]
    assert bench.get(0x603F) == 0x8611
    bench.run_down()
    assert bench.drive.state is State.FAULT
    assert not bench.rail.powered


def test_a_short_one_is_forgiven() -> None:
    """A glitch of the encoder, say."""
    bench = Bench(following_error=WINDOW, following_time=PATIENCE * H).up().to_speed(0.1)
    for _ in range(5):
        bench.rail.blocked = True
        astray(bench, 18 + PATIENCE)
        assert bench.drive.axis.supervision.astray > 0
        bench.rail.blocked = False
        astray(bench, 2)
    assert bench.emergencies == []
    assert bench.drive.state is State.OPERATION_ENABLED


def test_monitoring_can_be_switched_off() -> None:
    bench = Bench()
    assert bench.set(0x6065, 0xFFFFFFFF) == 0
    bench.up().to_speed(0.1)
    bench.rail.blocked = True
    astray(bench, 500)
    assert bench.emergencies == []


def test_a_pushed_table_without_power_does_not_jump_back() -> None:
    bench = Bench(0.02).up()
    bench.cycle(states.DISABLE_VOLTAGE)
    bench.run_down()
    bench.sync()
    bench.rail.position += 5e-3
    bench.sync()
    assert bench.rail.position == 0.025
    bench.up()
    for _ in range(10):
        bench.cycle(states.ENABLE_OPERATION, bench.x)
    assert bench.rail.position == pytest.approx(0.025, abs=1e-9)
    assert bench.emergencies == []


class Inside(Rail):
    """A rail whose switches are inside the stroke."""

    def __init__(self, position: float) -> None:
        super().__init__(position, end=0.05)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_limit_switch_stops_what_goes_into_it(side: float) -> None:
    bench = Bench(0.045 * side, rail=Inside, stop_deceleration=5.0).up().to_speed(0.1 * side)
    while bench.drive.state is State.OPERATION_ENABLED:
        astray(bench, 1)
    assert bench.emergencies == [LIMIT_SWITCH]
    assert bench.drive.statusword & states.INTERNAL_LIMIT
    assert bench.get(0x60FD) == (2 if side > 0.0 else 1)
    bench.run_down()
    # braking from 0.1 m/s with 5 m/s2
    assert abs(bench.rail.position) == pytest.approx(0.05 + 1e-3, abs=3e-4)
    # out of it is free, further in is not
    bench.up().to_speed(-0.05 * side)
    assert bench.drive.state is State.OPERATION_ENABLED
    bench.to_speed(0.0)
    bench.to_speed(0.05 * side)
    astray(bench, 1)
    assert bench.emergencies == [LIMIT_SWITCH, 0, LIMIT_SWITCH]


def test_the_emergency_stop_ramps_down_and_keeps_the_power_off() -> None:
    bench = Bench(stop_deceleration=2.0).up().to_speed(0.3)
    bench.rail.stop = True
    astray(bench, 1)
    assert bench.emergencies == [EMERGENCY_STOP]
    assert bench.get(0x60FD) & 1 << 16
    speeds = bench.run_down()
    assert max((a - b) / H for a, b in itertools.pairwise(speeds)) == pytest.approx(2.0, rel=1e-3)
    assert bench.drive.state is State.FAULT
    for word in (0, states.FAULT_RESET, 0, states.SHUTDOWN, states.SWITCH_ON, states.ENABLE_OPERATION):
        bench.cycle(word)
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    bench.rail.stop = False
    bench.up()


def test_power_follows_the_state() -> None:
    bench = Bench()
    assert not bench.rail.powered
    bench.up()
    assert bench.rail.powered
    bench.to_speed(0.1)
    bench.cycle(states.QUICK_STOP)
    assert bench.rail.powered  # it is ramped down first
    bench.run_down()
    bench.sync()
    assert not bench.rail.powered


@pytest.mark.parametrize("before", [(), (states.QUICK_STOP,)])
def test_voltage_taken_off_at_speed_is_off_at_once(before: tuple[int, ...]) -> None:
    bench = Bench()
    bench.up()
    bench.to_speed(0.1)
    for controlword in (*before, states.DISABLE_VOLTAGE):
        bench.cycle(controlword)
    assert not bench.rail.powered
    assert bench.drive.state is State.SWITCH_ON_DISABLED
    assert bench.drive.axis.interpolator.velocity == 0.0


def test_switches_are_told_in_one_object() -> None:
    bench = Bench()
    for switches, told in (
        (Switches(), 0),
        (Switches(negative=True), 1),
        (Switches(positive=True), 2),
        (Switches(home=True), 4),
        (Switches(stop=True), 1 << 16),
    ):
        bench.drive.axis._switched = type("Fixed", (), {"switches": switches})()
        assert bench.get(0x60FD) == told


def host_beats(bench: Bench, times: int, start: float, *, alive: bool) -> None:
    """A tenth of a second each, with its SYNCs and set-points."""
    for k in range(times):
        for _ in range(100):
            bench.cycle(states.ENABLE_OPERATION, bench.x)
        if alive:
            bench.drive.receive(0x77F, b"\x05")
        bench.drive.node.beat(start + 0.1 * k)


def test_a_host_whose_heartbeat_is_gone_is_not_obeyed_though_it_goes_on_talking() -> None:
    bench = Bench()
    assert bench.set(0x1016, 127 << 16 | 500, 1) == 0
    bench.up()
    host_beats(bench, 10, 0.0, alive=True)
    host_beats(bench, 5, 1.0, alive=False)
    assert bench.emergencies == []
    host_beats(bench, 3, 1.5, alive=False)
    assert bench.emergencies == [0x8130]
    assert bench.drive.state is State.FAULT


def test_a_lost_heartbeat_of_a_drive_without_power_is_nothing() -> None:
    bench = Bench()
    bench.set(0x1016, 127 << 16 | 500, 1)
    bench.drive.receive(0x77F, b"\x05")
    for tenths in range(20):
        bench.drive.node.beat(0.1 * tenths)
    assert bench.emergencies == []
    bench.up()


@pytest.mark.parametrize("patience", [0, 3, 200])
def test_patience_is_an_object(patience: int) -> None:
    bench = Bench()
    assert bench.set(0x2010, patience) == 0
    bench.up()
    for _ in range(patience):
        bench.sync()
        assert bench.emergencies == []
    bench.sync()
    bench.sync()
    assert bench.emergencies == [0x8250]


def test_an_emergency_has_its_register() -> None:
    bench = Bench().up()
    bench.drive.fail(0x7500)
    assert bench.sent[-1] == (0x081, frames.pack_emergency(frames.Emergency(0x7500, 0x21, bytes(5))))
    assert bench.get(0x1001) == 0x21
