"""A stop from any moment: gentle where it can be, no steeper than the stroke left asks for where it cannot."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation import Capacity, Motion, SineWave
from tests.twin.conftest import short_scene
from twin.ramp_down import ramp_down, ramp_down_lines, ramp_downs

CAPACITY = Capacity(name="table", stroke=0.2, velocity=0.6, acceleration=9.0)


@given(x=st.floats(-0.099, 0.099), v=st.floats(-0.6, 0.6).filter(lambda v: abs(v) > 1e-9), gentle=st.floats(0.1, 5.0))
def test_it_ends_inside_and_is_the_least(x: float, v: float, gentle: float) -> None:
    stop = ramp_down(1.0, x, v, gentle, 0.1)
    end = x + stop.distance * (1.0 if v > 0 else -1.0)
    assert abs(end) <= 0.1 * (1.0 + 1e-12)
    assert stop.deceleration * stop.duration == pytest.approx(abs(v))
    assert 0.5 * stop.duration * abs(v) == pytest.approx(stop.distance)
    if stop.deceleration > gentle:
        assert abs(end) == pytest.approx(0.1), "steeper than gentle only where all the room is needed"


def test_mirrored() -> None:
    one, other = ramp_down(0.0, 0.09, 0.3, 1.0, 0.1), ramp_down(0.0, -0.09, -0.3, 1.0, 0.1)
    assert one == other


def test_no_room_says_so() -> None:
    assert ramp_down(0.0, 0.1, 0.3, 1.0, 0.1).deceleration == float("inf")


def test_a_whole_run() -> None:
    scene = short_scene()
    motion = Motion(SineWave(2.8, 1.5), 1.0, capacity=CAPACITY)  # 0.198 of the 0.2 m
    stops = ramp_downs(motion, scene, CAPACITY)
    lifting = scene.block.block().uplift_acceleration
    assert stops.gentle == pytest.approx(0.5 * lifting)
    assert stops.hardest.deceleration > lifting, "late in the pulse little stroke is left"
    assert stops.rocking_from is not None
    assert motion.pulse_start < stops.rocking_from < motion.pulse_start + motion.shaking.duration
    speed = abs(motion.velocity(stops.longest.time))
    assert stops.longest.duration == pytest.approx(speed / stops.longest.deceleration)
    assert all(line.startswith(("limits", "stopping", "   ")) for line in ramp_down_lines(stops))


def test_a_table_that_stands_still_needs_no_stop() -> None:
    stops = ramp_downs(Motion.standstill(0.5), short_scene(), CAPACITY)
    assert stops.longest.duration == stops.hardest.distance == 0.0
    assert len(ramp_down_lines(stops)) == 2
