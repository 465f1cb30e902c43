"""Homing to a limit switch: the set-points, the mode around them, and our host's way to ask for it."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.cia301.dictionary import WRONG_VALUE
from devices.cia402 import states
from devices.cia402.home import NEGATIVE_SWITCH, POSITIVE_SWITCH, WHERE_IT_STANDS, home
from devices.cia402.homing import Homing, HomingSettings, Phase
from devices.cia402.machine import Switches
from devices.cia402.states import State
from devices.errors import DeviceNotReady, DeviceTimeout, DriveFault, ObjectRefused
from tests.devices.cia402.conftest import NM, Bench, H

ENABLE_AND_START = states.ENABLE_OPERATION | states.HOMING_START


@settings(max_examples=50, deadline=None)
@given(
    method=st.sampled_from([17, 18]),
    start=st.floats(0.07, 0.106),
    edge=st.floats(0.1, 0.104),
    fast=st.floats(1e-2, 0.05),
    slow=st.floats(2e-3, 5e-3),
    acceleration=st.floats(0.2, 10.0),
)
def test_the_edge_is_found_from_anywhere(
    method: int, start: float, edge: float, fast: float, slow: float, acceleration: float
) -> None:
    side = 1.0 if method == 18 else -1.0
    homing = Homing(HomingSettings(method, fast, slow, acceleration, H), side * start, -0.11, 0.11)
    path = [side * start]
    for _ in range(round(0.5 / min(fast, slow) / H)):
        if homing.over:
            break
        at = homing.position
        path.append(homing.step(Switches(at <= -edge, at >= edge), at))
    if fast**2 / (2.0 * acceleration) > 0.11 - edge - 2e-3:
        # too fast to stop before the end: it may fail, and then it stands still all the same
        assert homing.over
    else:
        assert homing.phase is Phase.ATTAINED
        assert homing.edge == pytest.approx(side * edge, abs=2.0 * slow * H)
    assert homing.velocity == 0.0
    steps = [b - a for a, b in itertools.pairwise(path)]
    assert max(abs(step) for step in steps) <= max(fast, slow) * H + 1e-12
    assert max((abs(b - a) for a, b in itertools.pairwise(steps)), default=0.0) <= acceleration * H * H + 1e-12


def test_a_switch_that_is_never_found_is_a_failure_inside_the_bounds() -> None:
    homing = Homing(HomingSettings(18, 0.02, 0.002, 0.5, H), 0.0, -0.11, 0.11)
    while not homing.over:
        homing.step(Switches(), homing.position)
    assert homing.phase is Phase.FAILED
    assert homing.edge is None
    assert 0.11 <= homing.position <= 0.11 + 0.02**2 / (2 * 0.5) + 1e-4


def homed(bench: Bench, method: int, limit: int = 20_000) -> int:
    """Home with the frames of mode 6; the statusword at the end."""
    assert bench.set(0x6098, method) == 0
    assert bench.set(0x6060, 6) == 0
    bench.up()
    word = bench.cycle(states.ENABLE_OPERATION)
    assert word & states.TARGET_REACHED
    assert not word & (states.HOMING_ATTAINED | states.HOMING_ERROR)
    bench.cycle(ENABLE_AND_START)
    for _ in range(limit):
        word = bench.cycle(ENABLE_AND_START, 0.0)
        if word & states.TARGET_REACHED:
            return word
        assert not word & states.HOMING_ATTAINED
    raise TimeoutError("homing does not end")


@pytest.mark.parametrize(("method", "start", "edge"), [(18, 0.09, 0.102), (17, -0.09, -0.102), (18, 0.1025, 0.102)])
def test_the_switchs_edge_becomes_the_home(method: int, start: float, edge: float) -> None:
    bench = Bench(start)
    assert homed(bench, method) & states.HOMING_ATTAINED
    axis = bench.drive.axis
    assert axis.zero == pytest.approx(edge, abs=3e-6)
    assert axis.measured == pytest.approx(bench.rail.position - edge, abs=3e-6)
    # it ends where the software limits let the next operation begin
    assert abs(bench.rail.position) <= 0.1
    assert bench.emergencies in ([], [0])
    bench.cycle(states.DISABLE_VOLTAGE)
    bench.set(0x6060, 8)
    bench.up().to_speed(0.01 if method == 17 else -0.01)
    assert bench.drive.state is State.OPERATION_ENABLED


def test_the_home_offset_puts_the_zero_where_it_is_wanted() -> None:
    """CiA 402: zero position = home position + home offset."""
    bench = Bench(0.09)
    bench.set(0x607C, -102_000_000)
    assert homed(bench, 18) & states.HOMING_ATTAINED
    assert bench.drive.axis.zero == pytest.approx(0.0, abs=3e-6)
    assert bench.get(0x6064) * NM == pytest.approx(bench.rail.position, abs=3e-6)


@pytest.mark.parametrize("method", [35, 37])
def test_where_it_stands(method: int) -> None:
    bench = Bench(0.03)
    assert homed(bench, method) & states.HOMING_ATTAINED
    assert bench.rail.position == 0.03
    assert bench.get(0x6064) == 0


def test_the_stroke_stays_where_the_machine_is_whatever_the_zero() -> None:
    bench = Bench(0.03)
    homed(bench, 37)
    bench.cycle(states.DISABLE_VOLTAGE)
    bench.set(0x6060, 8)
    bench.up()
    limits = bench.drive.interpolator.limits
    assert (limits.lower, limits.upper) == (pytest.approx(-0.13), pytest.approx(0.07))


def test_a_start_bit_that_falls_interrupts_it() -> None:
    bench = Bench(0.0)
    bench.set(0x6098, 18)
    bench.set(0x6060, 6)
    bench.up()
    for _ in range(200):
        bench.cycle(ENABLE_AND_START)
    assert bench.rail.velocity > 0.01
    for _ in range(200):
        word = bench.cycle(states.ENABLE_OPERATION)
    assert word & states.TARGET_REACHED
    assert not word & (states.HOMING_ATTAINED | states.HOMING_ERROR)
    assert bench.rail.velocity == 0.0
    assert bench.drive.axis.zero == 0.0


def test_halt_stops_it() -> None:
    bench = Bench(0.0)
    bench.set(0x6098, 18)
    bench.set(0x6060, 6)
    bench.up()
    for _ in range(200):
        bench.cycle(ENABLE_AND_START)
    for _ in range(200):
        word = bench.cycle(ENABLE_AND_START | states.HALT)
    assert bench.rail.velocity == 0.0
    assert word & states.HOMING_ERROR


@pytest.mark.parametrize("word", [states.QUICK_STOP, states.DISABLE_VOLTAGE, states.SHUTDOWN])
def test_every_way_out_ends_at_rest(word: int) -> None:
    bench = Bench(0.0)
    bench.set(0x6098, 17)
    bench.set(0x6060, 6)
    bench.up()
    for _ in range(300):
        bench.cycle(ENABLE_AND_START)
    assert bench.rail.velocity < -0.01
    bench.cycle(word)
    bench.run_down(word)
    assert bench.rail.velocity == 0.0
    assert not bench.drive.axis.homing.active


def test_silence_of_sync_ends_it() -> None:
    bench = Bench(0.0)
    bench.set(0x6098, 18)
    bench.set(0x6060, 6)
    bench.up()
    for _ in range(200):
        bench.cycle(ENABLE_AND_START)
    bench.sync(21)
    assert bench.emergencies == [0x8700]
    bench.run_down()
    assert bench.drive.state is State.FAULT


def test_without_a_method_it_is_an_error_and_nothing_moves() -> None:
    bench = Bench(0.0)
    bench.set(0x6060, 6)
    bench.up()
    for _ in range(3):
        word = bench.cycle(ENABLE_AND_START)
    assert word & states.HOMING_ERROR
    assert bench.rail.position == 0.0


def test_a_machine_without_switches_refuses_to_look_for_one() -> None:
    bench = Bench()
    bench.drive.axis._switched = None
    assert bench.set(0x6098, 18) == WRONG_VALUE
    assert bench.set(0x6098, 37) == 0


@pytest.mark.parametrize(
    ("method", "offset"), [(POSITIVE_SWITCH, -0.102), (NEGATIVE_SWITCH, 0.102), (WHERE_IT_STANDS, 0.05)]
)
def test_our_host_homes_it_and_runs_afterwards(make_chain, method: int, offset: float) -> None:
    chain = make_chain(0.05)
    with chain.table as table:
        home(table, method, offset=offset, fast=0.05, time_limit=20.0)
        zero = 0.1 if method == WHERE_IT_STANDS else 0.0
        assert chain.drive.axis.zero == pytest.approx(zero, abs=3e-6)
        assert table.position == pytest.approx(chain.rail.position - zero, abs=3e-6)
        assert not table.powered
        assert chain.drive.mode == states.CYCLIC_SYNCHRONOUS_POSITION
        table.enable(table.position)
        here = table.position
        for cycle in range(20):
            table.exchange(cycle, here)
        table.disable()


def test_our_host_says_when_no_switch_is_found(make_chain) -> None:
    chain = make_chain()
    chain.rail.end = 1.0
    with chain.table as table:
        with pytest.raises(DriveFault, match=r"homing of bench failed: .* found no switch"):
            home(table, POSITIVE_SWITCH, fast=0.05, acceleration=2.0)
        assert not table.powered
        assert chain.rail.velocity == 0.0
        with pytest.raises(DeviceTimeout, match=r"is not done after 0\.5 s"):
            home(table, NEGATIVE_SWITCH, fast=0.001, time_limit=0.5)
        assert chain.rail.velocity == 0.0
        assert chain.drive.mode == states.CYCLIC_SYNCHRONOUS_POSITION


def test_our_host_homes_only_a_table_that_is_open_and_not_enabled(make_chain) -> None:
    chain = make_chain()
    with chain.table as table:
        table.enable(0.0)
        table.exchange(0, 0.0)
        with pytest.raises(DeviceNotReady, match="before it is stopped"):
            home(table, WHERE_IT_STANDS)
        assert table.enabled
        assert chain.drive.state is State.OPERATION_ENABLED
        table.exchange(1, 0.0)
        table.disable()
        chain.drive.axis._switched = None
        with pytest.raises(ObjectRefused, match="6098"):
            home(table, POSITIVE_SWITCH)
