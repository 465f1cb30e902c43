"""Constant, sine, cosine and double pulses: the table of closed forms, and what every pulse promises."""

from __future__ import annotations

import copy
import dataclasses
import math
import pickle
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.integrate import quad

from excitation import ConstantPulse, CosineWave, DoublePulse, Motion, Pulse, Ramped, Record, Saturated, SineWave

PULSES = [
    ConstantPulse(-2.0, 0.3),
    SineWave(3.0, 2.0),
    SineWave(-3.0, 0.7, 2.4),
    CosineWave(3.0, 2.0, 3),
    CosineWave(1.0, 5.0, 0.4),
    DoublePulse(0.5, 0.02),
    DoublePulse(0.5, 0.02, 0.3, 60.0, 9e3),
    Record([0.0, 1.0, -2.0, 0.5, 0.0], 0.1),
    Ramped(CosineWave(3.0, 2.0), 50.0),
    Saturated(SineWave(3.0, 2.0, 2), 1.1),
    Motion(SineWave(3.0, 2.0), 1.0, settle=0.2),
]
every_pulse = pytest.mark.parametrize("pulse", PULSES, ids=lambda pulse: pulse.kind)

amplitudes = st.floats(0.01, 50.0) | st.floats(-50.0, -0.01)
frequencies = st.floats(0.05, 50.0)


@given(amplitudes, frequencies)
def test_one_sine_meets_the_table_of_closed_forms(a: float, f: float) -> None:
    wave, w = SineWave(a, f), 2.0 * math.pi * f
    assert wave.peak_acceleration == pytest.approx(abs(a), rel=1e-15)
    assert wave.peak_velocity == pytest.approx(2.0 * abs(a) / w, rel=1e-13)
    assert abs(wave.final_velocity) < 1e-15 * wave.peak_velocity
    assert wave.net_displacement == pytest.approx(2.0 * math.pi * a / w**2, rel=1e-13)
    assert wave.net_displacement == pytest.approx(a / f**2 / (2.0 * math.pi), rel=1e-13)
    assert wave.travel == pytest.approx(abs(wave.net_displacement), rel=1e-13)


@given(amplitudes, frequencies)
def test_one_cosine_meets_the_table_of_closed_forms(a: float, f: float) -> None:
    wave, w = CosineWave(a, f), 2.0 * math.pi * f
    assert wave.peak_velocity == pytest.approx(abs(a) / w, rel=1e-13)
    assert abs(wave.final_velocity) < 1e-14 * wave.peak_velocity
    assert wave.travel == pytest.approx(2.0 * abs(a) / w**2, rel=1e-13)
    assert abs(wave.net_displacement) < 1e-14 * wave.travel
    assert wave.largest_jump == pytest.approx(abs(a), rel=1e-15)


@given(amplitudes, st.floats(0.001, 5.0))
def test_a_constant_pulse_meets_the_table_of_closed_forms(a0: float, ta: float) -> None:
    pulse = ConstantPulse(a0, ta)
    assert pulse.peak_velocity == pytest.approx(abs(a0) * ta, rel=1e-14)
    assert pulse.final_velocity == pytest.approx(a0 * ta, rel=1e-14)
    assert pulse.net_displacement == pytest.approx(a0 * ta**2 / 2.0, rel=1e-14)


@given(st.floats(0.05, 0.7), st.floats(0.004, 0.05), st.floats(0.0, 1.0))
def test_a_double_pulse_strikes_its_stopper_at_the_gap(v: float, gap: float, e: float) -> None:
    pulse = DoublePulse(v, gap, e)
    shaper = v**2 / 200.0
    strike = pulse.breakpoints[-2]
    assert pulse.displacement(strike) == pytest.approx(gap, rel=1e-12)
    assert pulse.velocity(strike) == pytest.approx(v, rel=1e-12)
    assert pulse.final_velocity == pytest.approx(-e * v, rel=1e-11, abs=1e-12)
    assert pulse.displacement_range == pytest.approx((0.0, gap + shaper), rel=1e-12)
    assert pulse.net_displacement == pytest.approx(gap + shaper * (1.0 - e**2), rel=1e-11)
    assert pulse.duration == pytest.approx(v / 100.0 + (gap - shaper) / v + (1.0 + e) * v / 100.0, rel=1e-12)


@given(st.floats(0.05, 0.7), st.floats(0.0, 1.0), st.floats(1e3, 1e6))
def test_a_jerk_makes_trapezoids_of_the_same_change_of_speed(v: float, e: float, jerk: float) -> None:
    pulse = DoublePulse(v, 0.05, e, 100.0, jerk)
    (coast,) = pulse.pieces[(pulse.pieces[:, 2:] == 0.0).all(axis=1)]
    assert pulse.largest_jump == 0.0
    assert pulse.peak_jerk == pytest.approx(jerk, rel=1e-9)
    assert pulse.peak_acceleration <= 100.0 * (1.0 + 1e-9)
    assert max(abs(pulse.velocity(pulse.breakpoints))) == pytest.approx(v, rel=1e-9)
    assert pulse.final_velocity == pytest.approx(-e * v, rel=1e-8, abs=1e-9)
    assert pulse.displacement(coast[0]) == pytest.approx(pulse.run_up, rel=1e-9)
    assert pulse.displacement(coast[1]) == pytest.approx(0.05, rel=1e-9)


@every_pulse
def test_motion_is_the_integral_of_the_acceleration(pulse: Pulse) -> None:
    breaks = pulse.breakpoints
    v = x = 0.0
    for t0, t1 in pairwise(breaks):
        # The last instant belongs to the next piece.
        dv, _ = quad(lambda t, end=t1: pulse.acceleration(min(t, np.nextafter(end, 0.0))), t0, t1, epsabs=1e-13)
        dx, _ = quad(pulse.velocity, t0, t1, epsabs=1e-13)
        v, x = v + dv, x + dx
        assert pulse.velocity(float(t1)) == pytest.approx(v, rel=1e-10, abs=1e-12)
        assert pulse.displacement(float(t1)) == pytest.approx(x, rel=1e-10, abs=1e-12)


@every_pulse
def test_pieces_reproduce_the_acceleration_right_continuously(pulse: Pulse) -> None:
    rows = pulse.pieces
    assert rows.shape == (len(rows), 7)
    assert rows[0, 0] == 0.0
    assert rows[-1, 1] == pulse.duration
    assert np.array_equal(rows[1:, 0], rows[:-1, 1])
    assert np.array_equal(pulse.breakpoints, [*rows[:, 0], pulse.duration])
    for t0, t1, c0, c1, a, omega, psi in rows:
        for t in (t0, 0.5 * (t0 + t1), np.nextafter(t1, t0)):
            s = t - t0
            assert pulse.acceleration(float(t)) == pytest.approx(c0 + c1 * s + a * math.sin(omega * s + psi), abs=1e-12)


@every_pulse
def test_before_it_nothing_after_it_no_acceleration(pulse: Pulse) -> None:
    end, v, x = pulse.duration, pulse.final_velocity, pulse.net_displacement
    for ask in (pulse.acceleration, pulse.velocity, pulse.displacement):
        assert ask(-1.0) == 0.0
        assert ask(np.nextafter(0.0, -1.0)) == 0.0
    assert pulse.acceleration(end) == 0.0
    assert pulse.velocity(end + 3.0) == v
    assert pulse.displacement(end + 3.0) == pytest.approx(x + 3.0 * v, rel=1e-14, abs=1e-15)


@every_pulse
def test_floats_give_floats_and_arrays_their_shape(pulse: Pulse) -> None:
    t = np.linspace(-0.1, pulse.duration + 0.1, 24).reshape(2, 3, 4)
    for ask in (pulse.acceleration, pulse.velocity, pulse.displacement):
        answers = ask(t)
        assert answers.shape == t.shape
        assert type(ask(0.05)) is float
        assert type(ask(np.float64(0.05))) is float
        assert [ask(float(each)) for each in t.ravel()] == pytest.approx(answers.ravel().tolist(), rel=1e-14, abs=1e-15)
        assert ask(np.array([])).shape == (0,)


@every_pulse
def test_pulses_are_immutable_values(pulse: Pulse) -> None:
    assert pulse.duration > 0.0
    for again in (pickle.loads(pickle.dumps(pulse)), copy.deepcopy(pulse)):  # noqa: S301
        assert again == pulse
        assert hash(again) == hash(pulse)
        assert np.array_equal(again.pieces, pulse.pieces)
        assert not again.pieces.flags.writeable
    assert not pulse.breakpoints.flags.writeable
    with pytest.raises(dataclasses.FrozenInstanceError):
        pulse.duration = 3.0  # type: ignore[misc]


@every_pulse
def test_scaling_scales_the_acceleration(pulse: Pulse) -> None:
    half = pulse.scaled(0.5)
    assert type(half) is type(pulse)
    assert half.kind == pulse.kind
    if not isinstance(pulse, (Ramped, Motion)):
        assert half.peak_acceleration == pytest.approx(0.5 * pulse.peak_acceleration, rel=1e-14)
    with pytest.raises(ValueError, match="factor is nan"):
        pulse.scaled(math.nan)


def test_a_scaled_double_pulse_keeps_the_length_of_its_pulses_and_its_gap() -> None:
    pulse = DoublePulse(0.5, 0.02, 0.2, 80.0, 4e4)
    half = pulse.scaled(0.5)
    assert half == DoublePulse(0.25, 0.02, 0.2, 40.0, 2e4)
    assert half.pieces[0] == pytest.approx(pulse.pieces[0] * [1, 1, 1, 0.5, 1, 1, 1])
    assert half.duration - half.breakpoints[-4] == pytest.approx(pulse.duration - pulse.breakpoints[-4], rel=1e-12)


def test_names() -> None:
    assert [pulse.kind for pulse in PULSES[:4]] == [
        "constant pulse",
        "single sine",
        "sine of 2.4 cycles",
        "cosine of 3 cycles",
    ]
    assert SineWave(1.0, 2.0).angular_frequency == pytest.approx(4.0 * math.pi)
    assert Saturated(SineWave(1.0, 2.0), 0.5).fundamental == 2.0
    assert ConstantPulse(acceleration=2.0, duration=0.5) == ConstantPulse(2.0, 0.5)
    assert dataclasses.replace(ConstantPulse(2.0, 0.5), duration=1) == ConstantPulse(2, 1)


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf, True, "1", None, 1j, 10**400, [1.0]])
@pytest.mark.parametrize(
    ("make", "name"),
    [
        (lambda bad: ConstantPulse(bad, 1.0), "acceleration"),
        (lambda bad: ConstantPulse(1.0, bad), "duration"),
        (lambda bad: SineWave(bad, 1.0), "amplitude"),
        (lambda bad: SineWave(1.0, bad), "frequency"),
        (lambda bad: CosineWave(1.0, 1.0, bad), "cycles"),
        (lambda bad: DoublePulse(bad, 0.02), "peak_velocity"),
        (lambda bad: DoublePulse(0.1, bad), "stop_gap"),
        (lambda bad: DoublePulse(0.1, 0.02, bad), "rebound"),
        (lambda bad: DoublePulse(0.1, 0.02, 0.0, bad), "pulse_acceleration"),
        (lambda bad: Record([0.0, 1.0], bad), "time_step"),
    ],
)
def test_what_is_no_finite_number_is_refused_by_name(make: object, name: str, bad: object) -> None:
    with pytest.raises(ValidationError) as caught:
        make(bad)  # type: ignore[operator]
    (error,) = caught.value.errors()
    assert error["msg"].startswith(f"{name} is ") or error["msg"].startswith(f"{name} must be a number")


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: SineWave(1.0, 0.0), "frequency is 0 Hz; it must be above 0 Hz"),
        (lambda: SineWave(1.0, -2), "frequency is -2 Hz; it must be above 0 Hz"),
        (lambda: SineWave(1.0, 1e-300), "frequency is 1e-300 Hz; it must be at least 1e-09 Hz"),
        (lambda: SineWave(1.0, 1.0, 0), "cycles is 0; it must be above 0"),
        (lambda: CosineWave(1.0, 1.0, 1e5), "cycles is 100000; it must be at most 10000"),
        (lambda: ConstantPulse(1e7, 1.0), "acceleration is 1e+07 m/s2; it must be at most 1e+06 m/s2"),
        (lambda: ConstantPulse(1.0, 0.0), "duration is 0 s; it must be above 0 s"),
        (lambda: DoublePulse(-0.1, 0.02), "peak_velocity is -0.1 m/s; it must be above 0 m/s"),
        (lambda: DoublePulse(0.1, 0.02, 1.5), "rebound is 1.5; it must be at most 1"),
        (lambda: DoublePulse(0.1, 0.02, jerk=-1.0), "jerk is -1 m/s3; it must be above 0 m/s3"),
        (
            lambda: DoublePulse(0.6, 0.001),
            "double pulse needs 0.0018 m to reach 0.6 m/s; its stop gap is 0.001 m",
        ),
    ],
)
def test_values_out_of_bounds_are_refused_in_one_sentence(make: object, sentence: str) -> None:
    with pytest.raises(ValidationError) as caught:
        make()  # type: ignore[operator]
    assert [error["msg"] for error in caught.value.errors()] == [sentence]


def test_unknown_arguments_are_refused() -> None:
    with pytest.raises(ValidationError, match="phase"):
        SineWave(1.0, 1.0, phase=0.0)  # type: ignore[call-arg]


def test_numpy_numbers_are_numbers() -> None:
    assert SineWave(np.float32(0.5), np.int64(2)) == SineWave(0.5, 2.0)
