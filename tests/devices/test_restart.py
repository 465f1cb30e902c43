"""After a trip or the death of a host: the next host finds the table anywhere, perhaps in fault, and goes on."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from devices.cia301 import frames
from devices.cia402.states import State
from devices.clock import ManualClock
from devices.errors import DeviceNotReady, DeviceTimeout, DriveFault
from devices.positioning import bring_to, distance_to
from devices.quanser_st3.driver import open_table
from devices.quanser_st3.parameters import St3Parameters
from excitation import Capacity

if TYPE_CHECKING:
    from devices.cia402.master import Cia402Table

H = 1e-3


def moved(rig, cycles: int = 150, first: float = 0.0) -> None:
    """Enable, and leave the table in motion."""
    rig.table.enable(first)
    rig.follow([first + 0.02 * (1.0 - math.cos(math.tau * 2.0 * (k + 1) * H)) for k in range(cycles)])


def next_host(rig, **arguments) -> Cia402Table:
    """Another host at the same bus, which knows nothing of the first."""
    rig.tap.receive()
    while rig.tap.receive() is not None:
        pass
    return open_table(rig.tap, clock=rig.clock, idle=rig.emulator.service, **arguments)


class Run:
    """A stop signal after some milliseconds of the manual clock."""

    def __init__(self, clock: ManualClock, cycles: int) -> None:
        self.clock, self.cycles = clock, cycles

    def is_set(self) -> bool:
        self.clock.advance(H)
        self.cycles -= 1
        return self.cycles < 0


def test_after_a_trip_the_next_run_starts_where_the_table_stands(rig) -> None:
    moved(rig)
    rig.table.quick_stop()
    rig.table.close()
    table = next_host(rig)
    assert abs(table.position) > 0.01
    assert distance_to(table, 0.0) == -table.position
    accelerations: list[float] = []
    asked = lambda: bool(accelerations.append(rig.emulator.plant.acceleration))  # noqa: E731
    assert bring_to(table, 0.0, 0.5, rig.clock, stopped=asked)
    assert max(map(abs, accelerations)) <= 0.5 * 1.01
    assert max(map(abs, accelerations)) > 0.3
    assert not table.powered
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    table.enable(0.0)
    table.exchange(0, 0.0)


def test_a_table_that_stands_there_is_not_powered(rig) -> None:
    rig.heard()
    assert bring_to(rig.table, 0.0, 1.0, rig.clock)
    assert rig.heard() == []


def test_a_move_is_stopped_by_the_operator(make_rig) -> None:
    rig = make_rig(initial_position=0.1)
    asked = iter([False] * 200)
    assert not bring_to(rig.table, 0.0, 1.0, rig.clock, stopped=lambda: next(asked, True))
    assert rig.emulator.drive.standstill
    assert 0.01 < rig.table.position < 0.099
    assert not rig.table.powered


@pytest.mark.parametrize("limits", [{}, {"velocity": 0.02}, {"jerk": 1.0}, {"frequency": 0.5}, {"acceleration": 0.1}])
@pytest.mark.parametrize("start", [0.1, -0.0999999, 21e-6])
def test_a_move_is_within_every_capacity(make_rig, limits: dict[str, float], start: float) -> None:
    numbers = {"stroke": 0.2, "velocity": 0.6, "acceleration": 9.0} | limits
    rig = make_rig(initial_position=start, capacity=Capacity(name="small", provenance={}, **numbers))
    assert bring_to(rig.table, 0.0, 1.0, rig.clock)
    assert distance_to(rig.table, 0.0) == 0.0


def test_cycles_missed_on_the_way_are_left_out(make_rig) -> None:
    rig = make_rig(initial_position=0.1)

    class Stalling(ManualClock):
        def wait_until(self, moment: float) -> float:
            lateness = super().wait_until(moment)
            if round(moment / H) % 100 == 50:
                self.advance(3.5 * H)
                lateness += 3.5 * H
            return lateness

    assert bring_to(rig.table, 0.0, 1.0, Stalling())
    assert distance_to(rig.table, 0.0) == 0.0


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_acceleration_of_a_move_is_checked(make_rig, wrong: float) -> None:
    rig = make_rig(initial_position=0.1)
    with pytest.raises(ValueError, match="positioning acceleration is"):
        bring_to(rig.table, 0.0, wrong, rig.clock)


def test_a_host_that_died_leaves_a_fault_which_the_next_one_resets(rig) -> None:
    moved(rig)
    rig.emulator.serve(Run(rig.clock, 2000))
    assert rig.emulator.drive.state is State.FAULT
    # its emergency frame went to nobody
    table = next_host(rig)
    with pytest.raises(
        DriveFault, match=r"in fault, left by an earlier run.*reset_fault \(twin run --reset\)"
    ) as fault:
        table.enable(table.position)
    assert fault.value.code == 0
    table.close()
    table = next_host(rig)
    table.reset_fault()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert bring_to(table, 0.0, 1.0, rig.clock)
    table.enable(0.0)
    table.exchange(0, 0.0)
    table.disable()


def test_a_fault_met_on_the_way_up_names_its_code_and_the_remedy(rig) -> None:
    rig.tap.send(0x081, frames.pack_emergency(frames.Emergency(0x8130, 0x11, bytes(5))))
    with pytest.raises(DriveFault, match=r"error 8130: communication lost.*reset_fault \(twin run --reset\)"):
        rig.table.enable(0.0)


def test_reset_without_a_fault_only_looks(rig) -> None:
    rig.heard()
    rig.table.reset_fault()
    assert [identifier for identifier, _ in rig.heard()] == [0x080, 0x181, 0x281, 0x182]
    rig.table.enable(0.0)
    with pytest.raises(DeviceNotReady, match="before it is stopped"):
        rig.table.reset_fault()
    rig.table.close()
    with pytest.raises(DeviceNotReady, match="before it is open"):
        rig.table.reset_fault()


@pytest.mark.parametrize("cycles", [1, 100, 229, 230, 231, 232, 233, 234, 235])
def test_the_next_host_counts_from_its_own_start(rig, cycles: int) -> None:
    """Whatever number the last SYNC had, the same one included."""
    rig.table.enable(0.0)
    rig.follow([0.0] * cycles)
    rig.table.close()
    table = next_host(rig)
    table.enable(0.0)
    assert table.exchange(0, 0.0).cycle == 0
    table.close()


def test_the_specimen_is_set_up_again_each_time_the_power_comes_on(make_rig) -> None:
    angle = 0.15
    set_up: list[float] = []

    def falling(duration: float, start: float, end: float) -> float:
        nonlocal angle
        angle -= 0.001
        return angle

    def anew() -> None:
        nonlocal angle
        set_up.append(angle)
        angle = 0.15

    rig = make_rig(specimen=falling, set_up=anew, initial_rotation=0.15, parameters=St3Parameters())
    for _ in range(2):
        rig.table.enable(rig.table.position)
        first, *_, last = rig.follow([0.0] * 50)
        assert first.rotation == pytest.approx(0.148)
        assert last.rotation < 0.11
        rig.table.disable()
    assert len(set_up) == 2
    assert set_up[0] == 0.15
    assert set_up[1] < 0.11
    # the cycles of one run are no new run
    rig.table.enable(0.0)
    rig.follow([0.0] * 3)
    assert len(set_up) == 3


def test_a_table_that_slips_is_moved_again(rig, monkeypatch) -> None:
    """Whatever left it short: it is not said to stand where it does not."""
    slips = iter([1e-3, -0.5e-3])
    disable = type(rig.table).disable

    def slip(table: Cia402Table) -> None:
        disable(table)
        rig.emulator.plant._mechanics.position += next(slips, 0.0)
        table._paced(None)

    monkeypatch.setattr(type(rig.table), "disable", slip)
    assert bring_to(rig.table, 0.01, 1.0, rig.clock)
    assert distance_to(rig.table, 0.01) == 0.0


def test_a_table_that_never_stays_is_given_up(rig, monkeypatch) -> None:
    disable = type(rig.table).disable

    def slip(table: Cia402Table) -> None:
        disable(table)
        rig.emulator.plant._mechanics.position += 1e-3
        table._paced(None)

    monkeypatch.setattr(type(rig.table), "disable", slip)
    with pytest.raises(DeviceTimeout, match=r"still stands [01]\.\d{3} mm from where it was moved to 3 times"):
        bring_to(rig.table, 0.01, 1.0, rig.clock)
