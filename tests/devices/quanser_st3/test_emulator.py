"""The emulated ST-III as its host meets it: payload, switches, homing and power, over the bus."""

from __future__ import annotations

import numpy as np
import pytest

from devices.cia402.home import NEGATIVE_SWITCH, home
from devices.cia402.states import State
from devices.errors import DeviceError
from devices.quanser_st3.parameters import St3Parameters
from excitation import Capacity

H = 1e-3
SMALL = Capacity(name="small", stroke=0.02, velocity=0.3, acceleration=9.81)
PURE = St3Parameters(accelerometer_noise=0.0, accelerometer_bias=0.0, encoder_step=0.0)


def creep(cycles: int, speed: float = 0.05) -> list[float]:
    """Set-points of a table that speeds up with 1 m/s2 and goes on."""
    return (H * np.cumsum(np.minimum(H * np.arange(1, cycles + 1), speed))).tolist()


@pytest.mark.parametrize("payload", [0.0, 50.0])
def test_the_payload_makes_the_table_less_willing(make_rig, payload: float) -> None:
    rig = make_rig(parameters=PURE, payload=payload)
    rig.table.enable(0.0)
    rig.follow(creep(120))
    # two cycles on the way, then the loop: for a ramp both give the lag 2 zeta / w, whatever the mass
    behind = creep(120)[-2] - rig.emulator.plant.position
    lag = PURE.loop(payload).delay
    assert lag == pytest.approx(PURE.loop().delay)
    assert behind == pytest.approx(0.05 * lag, rel=0.1)
    a, w = rig.emulator.plant.acceleration, PURE.loop(payload).angular_frequency
    assert (abs(a) > 1e-3) is (payload > 0.0), (a, w)


def test_homing_finds_the_switch_beyond_the_stroke(make_rig) -> None:
    rig = make_rig(initial_position=-0.1, specimen=None)
    home(rig.table, NEGATIVE_SWITCH, offset=0.113, acceleration=1.0)
    # The switch's edge is 5 mm beyond the end of the stroke: minus its distance from the centre there, the centre is 0,
    # but for the way to the edge in one cycle and the encoder's step.
    assert rig.table.position == pytest.approx(rig.emulator.plant.position, abs=20e-6)
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED
    # and it ended where a run can begin
    rig.table.enable(rig.table.position)


def test_a_switch_that_closes_under_way_stops_the_drive(make_rig) -> None:
    """A table whose switch is inside its stroke, as one mounted wrongly would be."""
    rig = make_rig(capacity=SMALL)
    rig.emulator.plant._half_stroke = 0.001 - PURE.switch_distance
    rig.table.enable(0.0)
    with pytest.raises(DeviceError, match="FF10"):
        rig.follow(creep(300))
    rig.table.close()
    assert abs(rig.emulator.plant.velocity) < 1e-4


def test_an_emergency_stop_ends_operation(make_rig) -> None:
    rig = make_rig()
    rig.table.enable(0.0)
    rig.follow(creep(100))
    rig.emulator.plant.stop = True
    with pytest.raises(DeviceError, match="9000"):
        rig.follow([creep(103)[k] for k in range(100, 103)], 100)
    rig.table.close()
    assert abs(rig.emulator.plant.velocity) < 1e-4
    assert not rig.emulator.plant.powered


def test_without_power_the_table_stays_where_it_is(make_rig) -> None:
    rig = make_rig(parameters=PURE, initial_position=0.01)
    assert not rig.emulator.plant.powered
    rig.table.enable(0.01)
    assert rig.emulator.plant.powered
    rig.follow([0.01 + x for x in creep(60)])
    rig.table.quick_stop()
    assert not rig.emulator.plant.powered
    there = rig.emulator.plant.position
    for _ in range(50):
        rig.table.steer(0)
    # it is off below 0.1 mm/s, which friction takes in no time
    assert rig.emulator.plant.position == pytest.approx(there, abs=1e-8)
    assert rig.emulator.plant.velocity == 0.0
    # and on again, where it stands
    rig.table.enable(rig.table.position)
    samples = rig.follow([rig.table.position] * 20)
    assert max(abs(s.acceleration) for s in samples) < 0.1


def test_switches_follow_the_capacity(make_rig) -> None:
    rig = make_rig(capacity=SMALL, initial_position=0.0099)
    assert not rig.emulator.plant.switches.positive
    rig = make_rig(capacity=SMALL, initial_position=0.0151)
    assert rig.emulator.plant.switches.positive
