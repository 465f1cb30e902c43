"""Host, bus, drive, table, specimen and back, in one thread."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.signal import lsim

from devices.cia402.drive import DriveOptions
from devices.cia402.states import State, decode
from devices.errors import DeviceNotReady, DriveFault, DriveStopped, SetpointRefused
from devices.quanser_st3.parameters import St3Parameters
from devices.sample import Sample

H = 1e-3
SPAN, FREQUENCY = 0.06, 1.2


def stroke(cycles: int) -> list[float]:
    """One smooth there and back, at rest at both ends."""
    return [
        0.5 * SPAN * (1.0 - math.cos(math.tau * FREQUENCY * min((k + 1) * H, 1 / FREQUENCY))) for k in range(cycles)
    ]


def test_up_along_and_down(rig) -> None:
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    rig.table.enable(0.0)
    assert rig.table.enabled
    samples = rig.follow(stroke(900))
    assert [s.cycle for s in samples] == list(range(900))
    assert samples[-1].time == pytest.approx(0.899)
    assert {decode(s.status) for s in samples} == {State.OPERATION_ENABLED}
    assert max(s.position for s in samples) == pytest.approx(SPAN, abs=1e-4)
    rig.table.disable()
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert not rig.table.enabled
    rig.table.disable()
    rig.table.close()
    rig.table.close()


def test_measured_acceleration_is_the_closed_loop_s(make_rig) -> None:
    parameters = St3Parameters(accelerometer_noise=0.0, accelerometer_bias=0.0)
    rig = make_rig(parameters=parameters)
    rig.table.enable(0.0)
    targets = stroke(900)
    samples = rig.follow(targets)
    w, zeta = math.tau * 31.9, 0.78
    # the target of cycle k is to be reached at the beginning of cycle k + 1; the loop takes it a cycle later
    assert parameters.delay == H
    setpoints = np.concatenate(([0.0, 0.0], targets[:-2]))
    system = ([[0, 1], [-w * w, -2 * zeta * w]], [[0], [w * w]], [[-w * w, -2 * zeta * w]], [[w * w]])
    _, theory, _ = lsim(system, setpoints, np.arange(900) * H)
    measured = np.array([s.acceleration for s in samples])
    # set-points in whole nanometres leave w^2 times half of one; the frame half a um/s2
    assert np.abs(measured - theory).max() < w * w * 0.5e-9 * 3 + 0.6e-6
    # and in the field's terms: lag of 2 zeta / w and the delay behind the asked motion
    lag = 2 * zeta / w + H
    k = np.arange(200, 600)
    asked = 0.5 * SPAN * (math.tau * FREQUENCY) ** 2 * np.cos(math.tau * FREQUENCY * (k * H - lag))
    assert np.abs(measured[k] - asked).max() < 0.02


def test_position_comes_in_encoder_steps(rig) -> None:
    rig.table.enable(0.0)
    step = 12.7e-3 / 8192
    for sample in rig.follow(stroke(300)):
        counts = sample.position / step
        assert abs(counts - round(counts)) * step < 1e-9


def test_rotation_is_the_specimen_s_at_the_same_instant(make_rig) -> None:
    angle = 0.0

    def specimen(duration: float, start: float, end: float) -> float:
        nonlocal angle
        angle += 0.01 * duration * 0.5 * (start + end)
        return angle

    rig = make_rig(specimen=specimen, initial_rotation=0.05)
    rig.table.enable(0.0)
    for target in stroke(300):
        rotation = rig.emulator.plant.rotation
        sample = rig.table.exchange(0 if rig.table._last_cycle is None else rig.table._last_cycle + 1, target)
        assert sample.rotation == pytest.approx(rig.emulator.plant.rotation, abs=0.51e-4)
        assert rotation == pytest.approx(sample.rotation, abs=1e-3)


def test_the_specimen_is_held_until_the_drive_is_enabled(make_rig) -> None:
    lived: list[float] = []

    def falling(duration: float, start: float, end: float) -> float:
        assert start == end == 0.0
        lived.append(duration)
        return 0.15 - 0.01 * len(lived)

    rig = make_rig(specimen=falling, initial_rotation=0.15)
    assert rig.emulator.plant.rotation == 0.15
    rig.table.enable(0.0)
    sample = rig.table.exchange(0, 0.0)
    assert len(lived) == 2
    assert sample.rotation == pytest.approx(0.13)


def test_without_specimen_there_is_no_sensor_and_no_rotation(make_rig) -> None:
    rig = make_rig(specimen=None)
    rig.table.enable(0.0)
    assert math.isnan(rig.follow(stroke(3))[-1].rotation)


def test_equal_seeds_give_equal_samples_and_frames(make_rig) -> None:
    runs = []
    for seed in (5, 5, 6):
        rig = make_rig(seed=seed)
        rig.table.enable(0.0)
        rig.heard()
        runs.append((rig.follow(stroke(200)), rig.heard()))
    assert runs[0] == runs[1]
    assert runs[0][0] != runs[2][0]


def test_table_starts_anywhere_but_only_where_it_stands(make_rig) -> None:
    rig = make_rig(initial_position=-0.05)
    with pytest.raises(SetpointRefused, match=r"is to be enabled at 0\.000000 m; it stands at -0\.05") as refused:
        rig.table.enable(0.0)
    assert refused.value.limit == "start"
    assert rig.emulator.drive.state is not State.OPERATION_ENABLED
    rig.table.enable(-0.05)
    assert rig.follow([-0.05])[0].position == pytest.approx(-0.05, abs=1e-6)


def test_quick_stop_ends_at_rest_with_samples_on_the_way(rig) -> None:
    rig.table.enable(0.0)
    rig.follow(stroke(200))
    speed = rig.emulator.plant.velocity
    assert speed > 0.1
    way: list[Sample] = []
    rig.table.quick_stop(way.append)
    assert [s.cycle for s in way] == list(range(200, 200 + len(way)))
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert abs(rig.emulator.plant.velocity) < 1e-4
    # the ramp of 1 m/s2, and the loop's settling
    assert len(way) * H == pytest.approx(speed / 1.0, abs=0.05)
    assert not rig.table.enabled
    rig.table.enable(rig.table.position)


def test_close_stops_a_moving_table(rig) -> None:
    with rig.table as table:
        table.enable(0.0)
        rig.follow(stroke(150))
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    assert abs(rig.emulator.plant.velocity) < 1e-4


def test_disable_of_a_moving_table_stops_it_first(rig) -> None:
    rig.table.enable(0.0)
    rig.follow(stroke(150))
    rig.table.disable()
    assert abs(rig.emulator.plant.velocity) < 1e-4
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED


def test_order_of_calls(rig) -> None:
    with pytest.raises(DeviceNotReady, match="before it is enabled"):
        rig.table.exchange(0, 0.0)
    rig.table.enable(0.0)
    rig.table.exchange(3, 0.0)
    with pytest.raises(ValueError, match="cycle numbers must rise"):
        rig.table.exchange(3, 0.0)
    for wrong in (math.nan, math.inf, 1e300):
        with pytest.raises(ValueError, match="finite"):
            rig.table.exchange(4, wrong)
    rig.table.close()
    with pytest.raises(DeviceNotReady, match="before it is open"):
        rig.table.enable(0.0)
    with pytest.raises(DeviceNotReady, match="before it is open"):
        rig.table.quick_stop()


def test_missed_cycles_keep_time(rig) -> None:
    rig.table.enable(0.0)
    targets = stroke(700)
    before = rig.emulator.drive.cycle
    kept = [k for k in range(700) if k % 50 not in (7, 8, 9)]
    samples = [rig.table.exchange(k, targets[k]) for k in kept]
    assert rig.emulator.drive.cycle - before == 700
    errors = [s.position - (targets[s.cycle - 1] if s.cycle else 0.0) for s in samples]
    # the loop's lag and delay, 8.8 ms at 0.23 m/s at most, and nothing that grows
    assert max(abs(e) for e in errors) < 0.0089 * 0.5 * SPAN * math.tau * FREQUENCY


def test_a_host_that_stalls_longer_than_the_drive_waits(rig) -> None:
    rig.table.enable(0.0)
    targets = stroke(400)
    rig.follow(targets[:150])
    rig.clock.advance(0.03)
    with pytest.raises(DriveFault, match="error 8700: SYNC lost"):
        rig.table.exchange(180, targets[180])
    rig.table.quick_stop()
    assert rig.emulator.drive.state is State.FAULT
    assert abs(rig.emulator.plant.velocity) < 1e-4


@pytest.mark.parametrize("gap", [30, 60, 238])
def test_a_host_that_stalls_together_with_its_drive(make_rig, gap: int) -> None:
    """On one thread: the emulator neither trips nor jerks, for the time did not pass for it."""
    parameters = St3Parameters(accelerometer_noise=0.0, accelerometer_bias=0.0)
    targets = stroke(900)
    accelerations = []
    for left_out in (0, gap):
        rig = make_rig(parameters=parameters, options=DriveOptions(shared_clock=True))
        rig.table.enable(0.0)
        kept = [k for k in range(900) if not 200 <= k < 200 + left_out]
        samples = [rig.table.exchange(k, targets[k]) for k in kept]
        assert samples[-1].position == pytest.approx(targets[-1], abs=2e-6)
        accelerations.append({s.cycle: s.acceleration for s in samples})
    whole, gappy = accelerations
    difference = max(abs(whole[cycle] - gappy[cycle]) for cycle in gappy)
    assert difference < {30: 0.03, 60: 0.2, 238: 6.0}[gap]


def test_a_stall_the_counter_cannot_tell(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0])
    with pytest.raises(DriveStopped, match="comes 240 cycles after the last"):
        rig.table.exchange(240, 0.0)
