"""A host that stands still, is told a wrong set-point, or is no more."""

from __future__ import annotations

import pytest

from devices.clock import ManualClock
from devices.faults.catalogue import parse_fault
from devices.faults.host import StallingClock, with_jump
from devices.faults.schedule import Schedule

H = 1e-3


class Rig:
    def __init__(self, *faults: str) -> None:
        self.inner = ManualClock(5.0)
        self.schedule = Schedule([parse_fault(fault) for fault in faults], self.inner, H)
        self.meanwhile: list[float] = []
        self.killed: list[float] = []
        self.clock = StallingClock(
            self.schedule,
            lambda: self.meanwhile.append(self.inner.now()),
            lambda: self.killed.append(self.inner.now()),
        )

    def cycles(self, count: int) -> list[float]:
        """Lateness of each cycle; cycles are not left out here."""
        begin = self.clock.now()
        return [self.clock.wait_until(begin + k * H) for k in range(count)]


def test_the_first_look_begins_the_run() -> None:
    rig = Rig()
    assert not rig.schedule.running
    assert rig.clock.now() == 5.0
    assert rig.schedule.running
    assert rig.cycles(10) == [0.0] * 10


def test_it_stands_still_once_and_others_live_on() -> None:
    rig = Rig("host_stall@0.002:0.0035")
    assert rig.cycles(8) == pytest.approx([0.0, 0.0, 3.5e-3, 2.5e-3, 1.5e-3, 0.5e-3, 0.0, 0.0])
    assert rig.meanwhile == pytest.approx([5.003, 5.004, 5.005, 5.0055])


def test_it_is_killed_at_its_time() -> None:
    rig = Rig("host_killed@0.003")
    rig.cycles(10)
    assert rig.killed == [pytest.approx(5.003)]


def test_jumps_are_in_their_cycles() -> None:
    faults = [parse_fault("setpoint_in_exchange@0.002:0.5"), parse_fault("setpoint_in_exchange@0.0031:-0.25")]
    planned = [0.0] * 6
    assert with_jump(planned, faults, H) == [0.0, 0.0, 0.5, 0.0, -0.25, 0.0]
    assert planned == [0.0] * 6
    assert with_jump(planned, [parse_fault("setpoint_in_exchange@1:0.5")], H) == planned
    assert with_jump(planned, [parse_fault("operator_stop@0.002")], H) == planned
