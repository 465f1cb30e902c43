"""What the host refuses before sending, and what the drive refuses from whoever sends it."""

from __future__ import annotations

import math

import pytest

from devices.cia301 import frames
from devices.cia301.buses import open_bus
from devices.cia402 import states
from devices.cia402.frames import pack_actual, pack_target
from devices.cia402.states import State
from devices.errors import DeviceNotReady, DeviceTimeout, DriveFault, DriveStopped, SetpointRefused
from devices.quanser_st3.driver import open_table

H = 1e-3


def speed_up(rig, velocity: float) -> tuple[int, float]:
    """Enable, and bring the set-point to `velocity`; return the next cycle and the last target."""
    rig.table.enable(0.0)
    x = v = 0.0
    cycle = 0
    while v < velocity - 1e-12:
        v = min(velocity, v + 9.8 * H)
        x += v * H
        rig.table.exchange(cycle, x)
        cycle += 1
    return cycle, x


@pytest.mark.parametrize(
    ("step", "limit"),
    [
        (0.663 * H, None),
        (0.664 * H, None),
        (0.664003 * H, "velocity"),
        (0.660 * H - 9.80 * H * H, None),
        (0.660 * H - 9.81 * H * H, None),
        (0.660 * H - 9.815 * H * H, "acceleration"),
        (0.2, "stroke"),
    ],
)
def test_at_just_below_and_just_above_each_limit(rig, step: float, limit: str | None) -> None:
    cycle, x = speed_up(rig, 0.660)
    rig.heard()
    if limit is None:
        rig.table.exchange(cycle, x + step)
        assert rig.emulator.drive.state is State.OPERATION_ENABLED
        return
    with pytest.raises(SetpointRefused, match="quanser_st3 has") as refused:
        rig.table.exchange(cycle, x + step)
    assert refused.value.limit == limit
    assert isinstance(refused.value, ValueError)
    assert rig.heard() == []  # nothing was sent
    rig.table.quick_stop()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED


def test_stroke(make_rig) -> None:
    rig = make_rig(initial_position=0.108)
    rig.table.enable(0.108)
    rig.table.exchange(0, 0.108)
    with pytest.raises(SetpointRefused, match=r"asks 0\.108000002 m from the centre; quanser_st3 has 0\.108 m"):
        rig.table.exchange(1, 0.108 + 2e-9)
    rig.table.exchange(1, 0.108 - 2e-9)


def test_enabling_outside_the_stroke(rig) -> None:
    with pytest.raises(SetpointRefused, match="from the centre"):
        rig.table.enable(0.2)


def test_injected_below_the_host_the_drive_refuses_and_stops(rig) -> None:
    cycle, x = speed_up(rig, 0.4)
    drive = rig.emulator.drive
    rig.table.exchange(cycle, x + 0.4 * H)
    # somebody else's RPDO comes after ours and before the next SYNC; ours is then the forged one's target
    refused = round((x + 0.05) / 1e-9)
    drive.receive(0x201, pack_target(states.ENABLE_OPERATION, refused))
    drive.receive(frames.SYNC, frames.pack_sync(frames.sync_counter(rig.table._bus_cycle + 1)))
    rig.table._bus_cycle += 1
    assert drive.state is State.FAULT_REACTION_ACTIVE
    with pytest.raises(DriveFault, match=r"reports error 8400: velocity limit; it is in") as fault:
        rig.table.exchange(cycle + 1, x + 0.8 * H)
    assert fault.value.code == 0x8400
    positions: list[float] = []
    rig.table.quick_stop(lambda sample: positions.append(sample.position))
    assert drive.state is State.FAULT
    assert drive.standstill
    assert max(positions) <= 0.108
    # a fault is not reset by enabling
    with pytest.raises(DriveFault, match="8400"):
        rig.table.enable(rig.table.position)
    rig.table.reset_fault()
    assert drive.state is State.SWITCH_ON_DISABLED
    rig.table.enable(rig.table.position)
    rig.table.disable()


def test_reset_of_a_fault_that_stays(rig) -> None:
    speed_up(rig, 0.4)
    rig.emulator.drive.leave_operational()
    with pytest.raises(DeviceNotReady, match="to be reset before it is stopped"):
        rig.table.reset_fault()
    # another host, which does not know that the table still runs down
    with (
        open_table(rig.tap, clock=rig.clock, idle=rig.emulator.service) as other,
        pytest.raises(DriveFault, match="in fault reaction active"),
    ):
        other.reset_fault()
    rig.table.quick_stop()
    rig.table.reset_fault()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED


def silence(rig, *, drive: bool = True, sensor: bool = True) -> None:
    """Let the named nodes hear nothing any more."""
    if drive:
        rig.emulator.drive.receive = lambda *_: None
    if sensor:
        rig.emulator.sensor.receive = lambda *_: None


@pytest.mark.parametrize(
    ("drive", "sensor", "missing"),
    [
        (True, True, "statusword and position and acceleration and rotation"),
        (True, False, "statusword and position and acceleration"),
        (False, True, "rotation"),
    ],
)
def test_a_silent_node_is_a_time_out(rig, drive: bool, sensor: bool, missing: str) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0, 0.0])
    silence(rig, drive=drive, sensor=sensor)
    with pytest.raises(DeviceTimeout, match=rf"no {missing} came within 0\.02 s of the SYNC"):
        rig.table.exchange(2, 0.0)


def test_nobody_there(make_rig) -> None:
    with pytest.raises(
        DeviceTimeout,
        match=r"quanser_st3 does not answer: node 1 .* did not read object 1000:00 .*: no answer came within",
    ):
        make_rig(drive_node=9)


def test_a_close_that_fails_does_not_hide_the_first_error(rig) -> None:
    def mistake() -> None:
        with rig.table:
            rig.table.enable(0.0)
            silence(rig)
            raise KeyError("the operator's mistake")

    with pytest.raises(KeyError) as first:
        mistake()
    assert "could not be stopped and closed" in first.value.__notes__[0]
    with pytest.raises(DeviceTimeout, match="does not answer"):
        rig.table.open()


def test_foreign_and_stale_frames_are_ignored_and_counted(rig) -> None:
    rig.table.enable(0.0)
    before = rig.follow([0.0])[0]
    counts = rig.table.counts
    foreign, stale, malformed = counts.foreign, counts.stale, counts.malformed
    rig.tap.send(0x183, pack_actual(0x1637, 5_000_000))  # another drive
    rig.tap.send(0x123, b"")
    rig.tap.send(0x181, pack_actual(0x1637, 7_000_000))  # ours, before the SYNC
    rig.tap.send(0x701, b"\x99")
    sample = rig.table.exchange(1, 0.0)
    assert sample.position == before.position
    assert (counts.foreign - foreign, counts.stale - stale, counts.malformed - malformed) == (2, 1, 1)


def test_a_flood_of_foreign_frames_does_not_hold_the_host(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    for _ in range(6000):
        rig.tap.send(0x555, b"flood")
    rig.table.exchange(1, 0.0)
    assert rig.table.counts.foreign >= 6000


def test_a_node_that_restarts(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    rig.tap.send(0x702, b"\x00")
    with pytest.raises(DriveStopped, match="node 2 of quanser_st3 is no longer operational"):
        rig.table.exchange(1, 0.0)


def test_a_drive_that_leaves_operation_enabled(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    rig.emulator.drive._states.quick_stop()
    with pytest.raises(DriveStopped, match="left operation enabled by itself: quick stop active"):
        rig.table.exchange(1, 0.0)


def test_malformed_answer_is_an_error_not_a_number(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    silence(rig, sensor=False)
    rig.emulator.drive.receive = lambda identifier, _: (
        [rig.emulator.drive.node.send(i, b"\x00") for i in (0x181, 0x281)] if identifier == frames.SYNC else None
    )
    with pytest.raises(ValueError, match="TPDO1 frame has 1 bytes; it must have 6"):
        rig.table.exchange(1, 0.0)


@pytest.mark.parametrize("wrong", [0.0, -1.0, math.nan, math.inf])
def test_cycle_time_is_checked(make_rig, wrong: float) -> None:
    with pytest.raises(ValueError, match="cycle time is"):
        make_rig(cycle_time=wrong)
    with open_bus("virtual", "cycle time") as bus, pytest.raises(ValueError, match="cycle time is"):
        open_table(bus, cycle_time=wrong)


def test_a_stop_at_the_last_moment_ends_inside_the_stroke(rig) -> None:
    """Run at the end of the stroke until the limits call, then stop: the true position, not only the set-point's."""

    def run_at_the_end() -> None:
        x = v = 0.0
        for cycle in range(1000):
            v = min(0.66, v + 9.8 * H)
            x += v * H
            rig.table.exchange(cycle, x)

    rig.table.enable(0.0)
    with pytest.raises(SetpointRefused) as refused:
        run_at_the_end()
    assert refused.value.limit == "braking"
    furthest: list[float] = []
    rig.table.quick_stop(lambda _: furthest.append(rig.emulator.plant.position))
    assert max(furthest) <= 0.108 + 30e-6  # the loop's own overshoot, braking with 9.81 m/s2
    assert max(furthest) > 0.1
    assert rig.emulator.drive.interpolator.position <= 0.108 + 1e-9
