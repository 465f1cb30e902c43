"""Faults begin and end by cycles of the table's clock."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.clock import ManualClock
from devices.faults.catalogue import FAULTS, parse_fault
from devices.faults.fault import Fault, fault_of
from devices.faults.schedule import Schedule

H = 1e-3


def active_cycles(fault: Fault, cycles: int, begin: float = 0.0, h: float = H) -> list[int]:
    clock = ManualClock(begin)
    schedule = Schedule([fault], clock, h)
    schedule.start()
    found = []
    for k in range(cycles):
        clock.wait_until(begin + k * h)
        # anywhere in the cycle
        if schedule.active(fault.name):
            found.append(k)
        clock.advance(0.7 * h)
        assert (schedule.active(fault.name) is not None) == (k in found)
    return found


@pytest.mark.parametrize("begin", [0.0, 12345.678])
def test_it_lasts_its_cycles(begin: float) -> None:
    bus_off = FAULTS["bus_off"]
    assert active_cycles(fault_of(bus_off, 0.010, duration=0.005), 40, begin) == [10, 11, 12, 13, 14]
    # between two cycles: from the next one
    assert active_cycles(fault_of(bus_off, 0.0101, duration=0.005), 40, begin) == [11, 12, 13, 14, 15]
    # however short, one cycle
    assert active_cycles(fault_of(bus_off, 0.010, duration=1e-6), 40, begin) == [10]
    assert active_cycles(parse_fault("encoder_frozen@0.03"), 40, begin) == list(range(30, 40))
    assert active_cycles(parse_fault("encoder_glitch@0.03"), 40, begin, h=4e-3) == [8]


@given(st.integers(0, 30_000), st.integers(1, 5000), st.sampled_from([250, 1000, 2000]))
def test_whole_cycles_are_met_exactly(first: int, count: int, rate: int) -> None:
    h = 1.0 / rate
    clock = ManualClock()
    schedule = Schedule([fault_of(FAULTS["bus_off"], first * h, duration=count * h)], clock, h)
    schedule.start()
    for cycle, expected in ((first - 1, False), (first, True), (first + count - 1, True), (first + count, False)):
        if cycle >= 0:
            clock.wait_until(cycle * h)
            assert (schedule.active("bus_off") is not None) is expected


def test_nothing_before_the_first_cycle() -> None:
    clock = ManualClock()
    schedule = Schedule([parse_fault("encoder_frozen@0"), parse_fault("operator_stop@0")], clock, H)
    clock.advance(10.0)
    assert schedule.cycle == -1
    assert schedule.active("encoder_frozen") is None
    assert schedule.due("operator_stop") is None
    schedule.start()
    assert schedule.active("encoder_frozen")
    assert schedule.due("operator_stop")
    clock.advance(1.0)
    schedule.start()  # it has begun already
    assert schedule.cycle == 1000


def test_an_instant_is_due_once_and_announced_once() -> None:
    clock = ManualClock()
    schedule = Schedule([parse_fault("operator_stop@0.1"), parse_fault("operator_stop@0.2")], clock, H)
    heard: list[tuple[str, float, float]] = []
    schedule.announce = lambda fault, time: heard.append((fault.name, fault.at, time))
    schedule.start()
    found = []
    for k in range(300):
        clock.wait_until(k * H)
        if schedule.due("operator_stop"):
            found.append(k)
    assert found == [100, 200]
    assert heard == [("operator_stop", 0.1, pytest.approx(0.1)), ("operator_stop", 0.2, pytest.approx(0.2))]


def test_a_late_look_finds_it_late() -> None:
    clock = ManualClock()
    schedule = Schedule([parse_fault("operator_stop@0.1")], clock, H)
    heard: list[float] = []
    schedule.announce = lambda _, time: heard.append(time)
    schedule.start()
    clock.advance(0.150)
    assert schedule.due("operator_stop")
    assert heard == [pytest.approx(0.150)]
    assert np.isfinite(heard).all()
