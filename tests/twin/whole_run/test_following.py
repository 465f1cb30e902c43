"""The compiled table and ramp are the emulated ones."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.cia402.interpolation import Interpolator
from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant
from twin.rocking.compiled import FloatArray
from twin.whole_run.following import ACCELERATION, POSITION, VELOCITY, follow, ramp
from twin.whole_run.mechanics import TableMechanics

CYCLE = 1e-3
HALF = 0.5 * ST3.stroke


def mechanics_of(p: St3Parameters, payload: float) -> TableMechanics:
    loop = p.loop(payload)
    return TableMechanics(
        frequency=loop.angular_frequency / math.tau,
        damping=loop.damping,
        delay=p.delay,
        strongest=p.largest_acceleration(payload),
        top_speed=p.top_speed,
        switch=HALF + p.switch_distance,
        bumper=HALF + p.bumper_distance,
        bumper_stiffness=p.bumper_stiffness,
        bumper_damping=p.bumper_damping,
        friction=p.friction,
        mass=p.moving_mass + payload,
    )


def emulated(p: St3Parameters, payload: float, points: FloatArray) -> FloatArray:
    plant = St3Plant(p, CYCLE, np.random.default_rng(1), payload=payload, position=float(points[0]))
    rows = [(plant.position, 0.0, 0.0)]
    for point in points[1:].tolist():
        plant.advance(point)
        rows.append((plant.position, plant.velocity, plant.acceleration))
    return np.array(rows).T


def compiled(p: St3Parameters, payload: float, points: FloatArray) -> FloatArray:
    table = mechanics_of(p, payload)
    made = np.zeros((3, points.size))
    made[POSITION, 0] = points[0]
    follow(table.numbers, points, 0, CYCLE, table.delay, made)
    return made


def sine(amplitude: float, frequency: float, count: int = 600) -> FloatArray:
    t = np.arange(count) * CYCLE
    return amplitude * (1.0 - np.cos(math.tau * frequency * t))


@settings(max_examples=15, deadline=None)
@given(
    loop=st.floats(3.0, 60.0),
    damping=st.floats(0.1, 2.0),
    delay=st.floats(0.0, 0.01),
    payload=st.floats(0.0, 100.0),
    amplitude=st.floats(1e-4, 0.02),
    frequency=st.floats(0.5, 6.0),
)
def test_the_table_is_the_emulated_one(
    loop: float, damping: float, delay: float, payload: float, amplitude: float, frequency: float
) -> None:
    p = St3Parameters(loop_frequency=loop, loop_damping=damping, delay=delay)
    points = sine(amplitude, frequency, 300)
    ours, theirs = compiled(p, payload, points), emulated(p, payload, points)
    assert np.max(np.abs(ours[POSITION] - theirs[POSITION])) < 1e-9
    assert np.max(np.abs(ours[VELOCITY] - theirs[VELOCITY])) < 1e-7
    assert np.max(np.abs(ours[ACCELERATION] - theirs[ACCELERATION])) < 1e-4


@pytest.mark.parametrize(
    ("p", "points", "off"),
    [
        (St3Parameters(peak_current=0.2), sine(0.03, 4.0), 1e-4),  # the motor makes 4.6 m/s2 of 9.5 asked
        (St3Parameters(top_speed=0.4), sine(0.03, 4.0), 1e-4),
        (St3Parameters(), np.minimum(np.arange(400) * 0.5e-3, 0.14), 1e-3),  # chatters at the limit switch
    ],
)
def test_what_holds_the_table_back_is_that_of_the_emulated_one(
    p: St3Parameters, points: FloatArray, off: float
) -> None:
    ours, theirs = compiled(p, 0.0, points), emulated(p, 0.0, points)
    free = compiled(St3Parameters(switch_distance=1.0, bumper_distance=2.0), 0.0, points)
    assert np.max(np.abs(theirs[POSITION] - free[POSITION])) > 10.0 * off
    assert np.max(np.abs(ours[POSITION] - theirs[POSITION])) < off


@settings(max_examples=60, deadline=None)
@given(
    position=st.floats(-0.1, 0.1),
    share=st.floats(0.0, 1.0),
    sign=st.sampled_from((1.0, -1.0)),
    gentle=st.floats(0.2, 9.0),
)
def test_the_ramp_is_the_drives(position: float, share: float, sign: float, gentle: float) -> None:
    room = HALF - sign * position
    velocity = sign * share * min(ST3.velocity, math.sqrt(2.0 * 9.0 * room))
    drive = Interpolator(ST3, CYCLE, 1e-9, gentle, 20)
    drive.lead(position, velocity)
    drive.stop()
    points = np.zeros(5000)
    points[0], points[1] = position - velocity * CYCLE, position
    last = ramp(points, 1, HALF, gentle, ST3.acceleration, CYCLE, 4000)
    steps = [drive.step() for _ in range(last - 1)]
    assert points[2 : last + 1].tolist() == pytest.approx(steps, abs=1e-9)
    assert drive.velocity == pytest.approx(0.0, abs=1e-9)
    assert np.max(np.abs(points[1 : last + 1])) <= HALF + 1e-9


def test_a_table_at_rest_stays_there() -> None:
    points = np.full(200, 0.03)
    made = compiled(St3Parameters(), 2.0, points)
    assert np.all(made[POSITION] == 0.03)
    assert np.all(made[VELOCITY] == 0.0)
