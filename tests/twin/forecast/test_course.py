"""The base's motion as intervals: what they keep of it, how the table's loop changes it, and the ramp-down."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, Record, SineWave
from tests.closed_loop import ClosedLoop
from tests.facts import B6L, P
from twin.forecast.course import (
    COLUMNS,
    K0,
    LENGTH,
    LONGEST,
    POSITION,
    START,
    STRONGEST,
    VELOCITY,
    cubic,
    lay_course,
)
from twin.forecast.loop import TableLoop, follow
from twin.forecast.ramp import RAMP_ROWS, deceleration_for, interval_at, lay_ramp, table_at
from twin.rocking.compiled import FloatArray

G = B6L.gravity
LOOP = TableLoop(frequency=31.9, damping=0.78)
RNG = np.random.default_rng(4)
PULSES: dict[str, Pulse] = {
    "sine": SineWave(3.0, 4.0, 2.5),
    "cosine": CosineWave(4.0, 3.0),
    "constant": ConstantPulse(3.0, 0.2),
    "double pulse": DoublePulse(0.5, 0.02),
    "record": Record(np.convolve(RNG.standard_normal(500), np.hanning(9), "same"), 0.01),
    "dense record": Record(np.convolve(RNG.standard_normal(900), np.hanning(25), "same"), 0.0025),
}


def acceleration(course: FloatArray, t: float) -> float:
    """Return the acceleration of a course, m/s2."""
    row = course[interval_at(course, P * t)]
    x = P * t - row[START]
    return G * float(row[K0] + x * (row[K0 + 1] + x * (row[K0 + 2] + x * row[K0 + 3])))


@given(st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4))
def test_a_cubic_is_found_from_its_ends_and_moments(c: list[float]) -> None:
    rise, mean, moment = c[1] + c[2] + c[3], c[1] / 2 + c[2] / 3 + c[3] / 4, c[1] / 6 + c[2] / 12 + c[3] / 20
    assert cubic(rise, mean, moment) == pytest.approx(c[1:], abs=1e-9)


@pytest.mark.parametrize("loop", [TableLoop(), LOOP])
def test_a_still_base_is_one_interval(loop: TableLoop) -> None:
    sine = PULSES["sine"].pieces
    end = float(sine[-1, 1])
    rest = np.array([[end, end + 3.0, 0.0, 0.0, 0.0, 0.0, 0.0], [end + 3.0, end + 4.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
    again = sine.copy()
    again[:, :2] += end + 4.0
    course = lay_course(np.concatenate([sine, rest, again]), loop, P, G)
    still = course[:-1][course[:-1, STRONGEST] == 0.0]
    # A loop needs some of its time constants to come to rest.
    assert max(still[:, LENGTH]) / P == pytest.approx(4.0, abs=0.15)
    assert not still[:, K0 : K0 + 4].any()
    assert course[:-1, START] + course[:-1, LENGTH] == pytest.approx(course[1:, START], abs=1e-9)
    moving = course[:-1][course[:-1, STRONGEST] > 0.0]
    assert moving[:, LENGTH].max() <= LONGEST + 1e-9


@pytest.mark.parametrize("name", PULSES)
def test_velocity_and_place_are_kept_exactly(name: str) -> None:
    pulse = PULSES[name]
    course = lay_course(pulse.pieces, TableLoop(), P, G)
    ends = course[:, START] / P
    assert ends[-1] == pytest.approx(pulse.duration)
    assert course[:, VELOCITY] == pytest.approx(pulse.velocity(ends), abs=1e-12)
    assert course[:, POSITION] == pytest.approx(pulse.displacement(ends), abs=1e-12)
    k = course[:-1, K0 : K0 + 4] * course[:-1, LENGTH, None] ** np.arange(1, 5) / np.arange(1, 5)
    assert course[:-1, VELOCITY] + G / P * k.sum(axis=1) == pytest.approx(course[1:, VELOCITY], abs=1e-9)


@pytest.mark.parametrize("name", ["sine", "cosine", "constant", "double pulse", "record"])
def test_the_acceleration_between_is_that_of_the_pulse(name: str) -> None:
    pulse = PULSES[name]
    course = lay_course(pulse.pieces, TableLoop(), P, G)
    times = pulse.duration * np.random.default_rng(5).random(400)
    wrong = [abs(acceleration(course, t) - pulse.acceleration(float(t))) for t in times]
    assert max(wrong) < 1e-4 * pulse.peak_acceleration
    assert course[:, STRONGEST].max() == pytest.approx(pulse.peak_acceleration / G, rel=0.02)


def test_samples_closer_than_the_block_can_tell_are_joined() -> None:
    pulse = PULSES["dense record"]
    course = lay_course(pulse.pieces, TableLoop(), P, G)
    assert len(course) < 0.5 * len(pulse.pieces)


def test_pieces_of_no_length_to_speak_of_do_no_harm() -> None:
    """Rounding leaves slivers between the parts of a motion: nothing of them is blown up."""
    times = np.cumsum([0.0, 0.1, 1e-13, 0.1, 1e-9, 3e-7, 0.1])
    rows = np.zeros((6, 7))
    rows[:, 0], rows[:, 1] = times[:-1], times[1:]
    rows[:, 2] = [2.0, -1.0, 0.5, 3.0, -2.0, -1.0]
    for loop in (TableLoop(), LOOP):
        course = lay_course(rows, loop, P, G)
        assert course[:, STRONGEST].max() < 3.2 / G
        assert course[-1, VELOCITY] == pytest.approx(0.15, abs=2e-3)


def test_gain_and_delay() -> None:
    pulse = PULSES["sine"]
    plain = lay_course(pulse.pieces, TableLoop(), P, G)
    late = lay_course(pulse.pieces, TableLoop(delay=0.05, gain=0.25), P, G)
    for t in np.linspace(0.01, pulse.duration - 0.01, 40):
        assert acceleration(late, t + 0.05) == pytest.approx(0.25 * acceleration(plain, t), abs=1e-4)
    assert acceleration(late, 0.02) == 0.0


@given(st.floats(0.2, 3.0), st.floats(-5.0, 5.0), st.floats(-50.0, 50.0), st.floats(-3.0, 3.0), st.floats(-30.0, 30.0))
def test_the_loop_is_solved_exactly(zeta: float, a: float, da: float, u: float, du: float) -> None:
    """Against many small steps of the same loop: the answer does not depend on how it is cut."""
    w, h, n = 200.0, 0.02, 64
    once = follow(w, zeta, a, da, u, du, h)
    x, v = a, da
    for k in range(n):
        x, v = follow(w, zeta, x, v, u + du * h * k / n, du, h / n)
    assert (x, v) == pytest.approx(once, rel=1e-6, abs=1e-6 * w)
    small = 1e-7
    x, v = follow(w, zeta, a, da, u, du, small)
    assert (x - a) / small == pytest.approx(da, abs=1e-3 * w * (1.0 + abs(a) + abs(u)) + 0.02 * abs(da))
    bend = w * w * (u - a) - 2.0 * zeta * w * da
    assert (v - da) / small == pytest.approx(bend, rel=1e-3, abs=w * w * 1e-3)


@pytest.mark.parametrize("name", PULSES)
def test_the_course_is_what_the_emulated_table_makes(name: str) -> None:
    """Against the emulator's own loop, stepped finely."""
    pulse, dt = PULSES[name], 1e-4
    course = lay_course(pulse.pieces, LOOP, P, G)
    table = ClosedLoop(LOOP.angular_frequency, LOOP.damping, dt, 0.0)
    worst = np.zeros(3)
    for k in range(1, math.floor(pulse.duration / dt)):
        table.advance(float(pulse.displacement(k * dt)))
        row = course[interval_at(course, P * k * dt)]
        a, _, v, x = table_at(row, P * k * dt - row[START], P, G)
        worst = np.maximum(worst, np.abs([a - table.acceleration, v - table.velocity, x - table.position]))
    peak = max(1.0, pulse.peak_acceleration)
    # The emulator's set-point is a polygon: its own acceleration is a little off the pulse's.
    assert (worst < np.array([2e-3, 3e-6, 1e-8]) * peak).all()


def ramp(pulse: Pulse, act: float, loop: TableLoop, limit: float = math.inf) -> FloatArray:
    course = lay_course(pulse.pieces, loop, P, G)
    rows = np.zeros((len(course) + RAMP_ROWS, COLUMNS))
    kept = lay_ramp(
        course,
        interval_at(course, 0.0),
        0.0,
        P * act,
        np.array([loop.angular_frequency, loop.damping]),
        np.array([1.09, limit, 9.81]),
        P,
        G,
        rows,
    )
    return rows[:kept]


@pytest.mark.parametrize("name", PULSES)
@pytest.mark.parametrize("share", [0.0, 0.3, 0.8, 1.0])
def test_a_ramp_ends_at_a_standstill(name: str, share: float) -> None:
    pulse = PULSES[name]
    for loop in (TableLoop(), LOOP, TableLoop(delay=0.01)):
        act = share * pulse.duration
        rows = ramp(pulse, act, loop)
        residue = 1e-3 if loop.frequency is None else 0.02 * max(0.1, pulse.peak_velocity)
        assert abs(rows[-1, VELOCITY]) < residue
        assert rows[1:, START] == pytest.approx(rows[:-1, START] + rows[:-1, LENGTH])


def test_a_ramp_is_gentle_where_there_is_room_and_no_steeper_than_the_table() -> None:
    assert deceleration_for(0.4, 0.0, 1.09, math.inf, 9.81) == 1.09
    assert deceleration_for(0.4, 0.06, 1.09, 0.1, 9.81) == pytest.approx(2.0)
    assert deceleration_for(-0.4, 0.06, 1.09, 0.1, 9.81) == 1.09
    assert deceleration_for(0.4, 0.0999, 1.09, 0.1, 9.81) == 9.81
    assert deceleration_for(0.4, 0.2, 1.09, 0.1, 9.81) == 9.81


def test_a_ramp_stops_before_the_limit() -> None:
    pulse = ConstantPulse(4.0, 0.2)
    for limit in (0.16, 0.2, 0.5):
        rows = ramp(pulse, 0.15, TableLoop(), limit)
        assert rows[-1, POSITION] <= limit + 1e-9
        gentle = 0.5 * 4.0 * 0.15**2 + 0.6**2 / (2.0 * 1.09)
        assert rows[-1, POSITION] == pytest.approx(min(limit, gentle), abs=1e-6)


def test_the_ramp_is_what_the_emulated_table_makes_of_it() -> None:
    pulse, dt, act = PULSES["sine"], 1e-4, 0.16
    rows = ramp(pulse, act, LOOP)
    table = ClosedLoop(LOOP.angular_frequency, LOOP.damping, dt, 0.0)
    speed, place = pulse.velocity(act), pulse.displacement(act)
    length = abs(speed) / 1.09
    worst = 0.0
    for k in range(1, int((act + length + 0.1) / dt)):
        t = k * dt
        s = min(max(0.0, t - act), length)
        ramped = place + speed * s - 0.5 * math.copysign(1.09, speed) * s * s
        table.advance(pulse.displacement(t) if t <= act else ramped)
        if t > act + 0.002:
            worst = max(worst, abs(acceleration(rows, t) - table.acceleration))
    assert worst < 0.03
