"""Clipping: the given pulse is within every limit, nothing but parameters changed, and the report says why."""

from __future__ import annotations

import dataclasses
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import cumulative_simpson

from excitation import (
    Capacity,
    Clipped,
    ConstantPulse,
    CosineWave,
    DoublePulse,
    Pulse,
    Ramped,
    Record,
    Saturated,
    SineWave,
    clip,
)

ST3 = Capacity(name="quanser_st3", stroke=0.216, velocity=0.664, acceleration=9.81, frequency=10.0, payload=100.0)
JERKY = ST3.model_copy(update={"name": "jerky", "jerk": 200.0})
TRACK = Capacity(name="air_track", stroke=2.0, velocity=2.0, acceleration=6.0, kinds=("constant",), one_signed=True)

amplitudes = st.floats(0.01, 80.0) | st.floats(-80.0, -0.01)
frequencies = st.floats(0.1, 40.0)
pulses = st.one_of(
    st.builds(SineWave, amplitudes, frequencies, st.sampled_from([1.0, 1.0, 3.0, 0.4])),
    st.builds(CosineWave, amplitudes, frequencies, st.sampled_from([1.0, 1.0, 2.0, 1.7])),
    st.builds(ConstantPulse, amplitudes, st.floats(0.01, 2.0)),
    st.builds(
        DoublePulse, st.floats(0.02, 0.6), st.floats(0.002, 0.2), st.sampled_from([0.0, 0.3, 1.0]), st.just(100.0)
    ),
    st.builds(Record, st.lists(st.floats(-40.0, 40.0), min_size=2, max_size=25), st.floats(0.005, 0.2)),
)
capacities = st.builds(
    Capacity,
    name=st.just("table"),
    stroke=st.floats(0.02, 1.0),
    velocity=st.floats(0.05, 3.0),
    acceleration=st.floats(1.0, 50.0),
    jerk=st.none() | st.floats(20.0, 5000.0),
    frequency=st.none() | st.floats(0.5, 20.0),
)


def braking(velocity: float, brake: float, jerk: float | None) -> float:
    """Distance in which `velocity` is taken out: a rectangle, a trapezoid or a triangle of deceleration."""
    v = abs(velocity)
    if jerk is None:
        return v**2 / (2.0 * brake)
    return v / 2.0 * (v / brake + brake / jerk if v >= brake**2 / jerk else 2.0 * math.sqrt(v / jerk))


def sampled(pulse: Pulse) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Time, acceleration, velocity and displacement from the pieces alone, 65 samples in each."""
    time, acceleration, velocity, displacement = [], [], [], []
    v = x = 0.0
    for t0, t1, c0, c1, a, omega, psi in pulse.pieces:
        s = np.linspace(0.0, t1 - t0, 65)
        values = c0 + c1 * s + a * np.sin(omega * s + psi)
        speeds = v + cumulative_simpson(values, x=s, initial=0.0)
        places = x + cumulative_simpson(speeds, x=s, initial=0.0)
        v, x = speeds[-1], places[-1]
        for kept, new in zip(
            (time, acceleration, velocity, displacement), (t0 + s, values, speeds, places), strict=True
        ):
            kept.append(new)
    return tuple(map(np.concatenate, (time, acceleration, velocity, displacement)))  # type: ignore[return-value]


def assert_within(pulse: Pulse, capacity: Capacity, brake: float, coast: float) -> None:
    """The pulse keeps every limit: by its own closed forms to the digit, by independent sampling to its accuracy."""
    v = pulse.final_velocity
    moving = abs(v) > 1e-9 * pulse.peak_velocity
    stop = math.copysign(abs(v) * coast + braking(v, brake, capacity.jerk), v) if moving else 0.0
    lowest, highest = pulse.displacement_range
    end = pulse.net_displacement + stop
    assert max(highest, end) - min(lowest, end) <= capacity.stroke * (1.0 + 1e-12)
    assert pulse.peak_velocity <= capacity.velocity * (1.0 + 1e-12)
    assert pulse.peak_acceleration <= capacity.acceleration * (1.0 + 1e-12)
    if capacity.jerk is not None:
        assert pulse.peak_jerk <= capacity.jerk * (1.0 + 1e-12)
        assert pulse.largest_jump == 0.0
    if capacity.frequency is not None and pulse.fundamental is not None:
        assert pulse.fundamental <= capacity.frequency * (1.0 + 1e-12)
    t, a, v_sampled, x = sampled(pulse)
    accuracy = 1.0 + 2e-4
    assert np.abs(a).max() <= capacity.acceleration * (1.0 + 1e-9)
    assert np.abs(v_sampled).max() <= capacity.velocity * accuracy
    assert max(x.max(), x[-1] + stop) - min(x.min(), x[-1] + stop) <= capacity.stroke * accuracy
    if capacity.jerk is not None:
        with_ends = np.concatenate([[0.0], a, [0.0]])
        gaps = np.diff(t, prepend=0.0, append=t[-1])
        assert (np.abs(np.diff(with_ends)) <= capacity.jerk * gaps + 1e-8 * max(pulse.peak_acceleration, 1.0)).all()


@given(pulses, capacities, st.floats(0.05, 1.0), st.sampled_from([0.0, 0.1]), st.sampled_from([None, "velocity"]))
@settings(max_examples=150, deadline=None)
def test_a_clipped_pulse_never_exceeds_its_capacity(
    pulse: Pulse, capacity: Capacity, share: float, coast: float, way: str | None
) -> None:
    brake = share * capacity.acceleration
    give_way = way if isinstance(pulse, DoublePulse) else None
    clipped = clip(pulse, capacity, give_way=give_way, brake=brake, coast=coast)  # type: ignore[arg-type]
    assert clipped.asked is pulse
    given_ = clipped.given
    if given_ is None:
        # Only a gap leaves no pulse of its kind.
        assert isinstance(pulse, DoublePulse)
        assert pulse.stop_gap > 0.9 * capacity.stroke or pulse.rebound > 0.0
        given_ = clipped.suggestion
    if given_ is not None:
        assert_within(given_, capacity, brake, coast)
    if clipped.given is not None:
        assert clip(clipped.given, capacity, give_way=give_way, brake=brake, coast=coast).feasible  # type: ignore[arg-type]
    assert clipped.feasible == (not clipped.limits)
    assert clipped.feasible == (clipped.given is pulse)
    used = [share for name, share in clipped.usage.items() if name not in ("frequency", "payload")]
    if isinstance(clipped.given, DoublePulse) and isinstance(pulse, DoublePulse):
        # Nothing is given away either: some limit, or the gap, leaves no higher velocity.
        free = [s for name, s in clipped.usage.items() if name in ("stroke", "velocity") or give_way]
        free.append(clipped.given.run_up / clipped.given.stop_gap)
        assert clipped.given.peak_velocity == pulse.peak_velocity or max(free) > 1.0 - 1e-9
    elif clipped.factor < 1.0 - 1e-9 and clipped.given is not None:
        assert max(used) > 1.0 - 1e-9


@given(pulses, capacities, st.floats(0.05, 1.0))
@settings(max_examples=25, deadline=None)
def test_a_saturated_pulse_never_exceeds_its_capacity(pulse: Pulse, capacity: Capacity, share: float) -> None:
    brake = share * capacity.acceleration
    clipped = clip(pulse, capacity, mode="saturate", brake=brake)
    if clipped.given is None:
        assert {"jerk", "frequency"} & {limit.name for limit in clipped.limits}
    else:
        assert_within(clipped.given, capacity, brake, 0.0)
    if clipped.suggestion is not None:
        assert_within(clipped.suggestion, capacity, brake, 0.0)


@given(pulses, st.floats(0.3, 0.99))
@settings(max_examples=40, deadline=None)
def test_a_pulse_that_fits_exactly_is_feasible_and_one_that_does_not_says_by_how_much(
    pulse: Pulse, share: float
) -> None:
    brake = 5.0
    v = pulse.final_velocity if abs(pulse.final_velocity) > 1e-9 * pulse.peak_velocity else 0.0
    end = pulse.net_displacement + math.copysign(braking(v, brake, None), v)
    lowest, highest = pulse.displacement_range
    stroke = max(highest, end) - min(lowest, end)
    if not 1e-6 < stroke < 1e5 or pulse.peak_velocity < 1e-6:
        return
    exact = Capacity(
        name="exact", stroke=stroke, velocity=pulse.peak_velocity, acceleration=max(5.0, pulse.peak_acceleration)
    )
    clipped = clip(pulse, exact, brake=brake)
    assert clipped.feasible
    assert (clipped.factor, clipped.limits, clipped.binding) == (1.0, (), None)
    slower = exact.model_copy(update={"velocity": share * exact.velocity})
    limit = clip(pulse, slower, brake=brake).binding
    assert limit is not None
    assert (limit.name, limit.unit, limit.limit) == ("velocity", "m/s", slower.velocity)
    assert limit.ratio == pytest.approx(1.0 / share, rel=1e-9)


def test_a_sine_is_reduced_in_amplitude_only() -> None:
    # The issue's own example: T = 0.6 s, A = 5 m/s2 asks A T^2 / (2 pi) = 0.286 m.
    asked = SineWave(5.0, 1.0 / 0.6)
    clipped = clip(asked, ST3)
    assert [limit.sentence for limit in clipped.limits] == [
        "single sine asks 0.955 m/s of velocity; quanser_st3 has 0.664 m/s",
        "single sine asks 0.286 m of stroke; quanser_st3 has 0.216 m",
    ]
    assert isinstance(clipped.given, SineWave)
    assert (clipped.given.frequency, clipped.given.cycles) == (asked.frequency, asked.cycles)
    assert clipped.given.amplitude == pytest.approx(5.0 * clipped.factor, rel=1e-14)
    assert clipped.factor == pytest.approx(min(0.216 / asked.travel, 0.664 / asked.peak_velocity), rel=1e-10)
    assert clipped.usage["velocity"] == pytest.approx(1.0, abs=1e-9)
    assert clipped.binding is not None
    assert clipped.binding.name == "velocity"
    assert (clipped.shape_error, clipped.extra_duration, clipped.suggestion) == (0.0, 0.0, None)
    assert pickle.loads(pickle.dumps(clipped)) == clipped  # noqa: S301


def test_a_wave_above_the_highest_frequency_is_lowered_to_it() -> None:
    clipped = clip(SineWave(9.0, 15.0), ST3)
    assert clipped.given == SineWave(9.0, 10.0)
    assert clipped.factor == 1.0
    assert clipped.extra_duration == pytest.approx(0.1 - 1.0 / 15.0)
    assert [limit.sentence for limit in clipped.limits] == [
        "single sine asks 15 Hz of frequency; quanser_st3 has 10 Hz"
    ]
    # Lower frequency, longer way: the stroke that now binds is reported though the asked wave kept it.
    short = clip(SineWave(9.0, 15.0), ST3.model_copy(update={"stroke": 0.01}))
    assert [limit.name for limit in short.limits] == ["stroke", "frequency"]


def test_a_pulse_of_no_size_is_no_trouble() -> None:
    assert clip(SineWave(0.0, 2.0), JERKY).feasible
    slowed = clip(SineWave(0.0, 15.0), ST3)
    assert (slowed.given, slowed.factor) == (SineWave(0.0, 10.0), 1.0)
    ramped = Ramped(ConstantPulse(0.0, 1.0), 500.0)
    assert clip(ramped, JERKY).feasible


def test_a_record_is_scaled_and_keeps_its_shape() -> None:
    record = Record([0.0, 30.0, -20.0, -15.0, 0.0], 0.02)
    clipped = clip(record, ST3, brake=2.0)
    assert isinstance(clipped.given, Record)
    assert clipped.given.samples == pytest.approx(record.samples * clipped.factor, rel=1e-14)
    assert clipped.factor == pytest.approx(9.81 / 30.0, rel=1e-10)


def test_coast_and_brake_count_in_the_stroke() -> None:
    pulse = ConstantPulse(2.0, 0.3)
    # 2 * 0.3^2 / 2 + 0.6 * 0.1 + 0.6^2 / (2 * 3)
    clipped = clip(pulse, ST3, brake=3.0, coast=0.1)
    assert clipped.given == pulse
    assert clipped.stopping_distance == pytest.approx(0.12)
    assert clipped.residual_velocity == pytest.approx(0.6)
    assert clipped.usage["stroke"] == pytest.approx(0.21 / 0.216)
    tight = clip(pulse, ST3.model_copy(update={"stroke": 0.1}), brake=3.0, coast=0.1)
    # f 0.09 + f 0.06 + f^2 0.06 = 0.1
    assert tight.factor == pytest.approx((math.sqrt(0.15**2 + 0.024) - 0.15) / 0.12, rel=1e-9)


def test_a_double_pulse_gives_way_in_duration_or_in_velocity() -> None:
    pulse = DoublePulse(0.5, 0.02)
    longer = clip(pulse, ST3)
    assert isinstance(longer.given, DoublePulse)
    assert (longer.given.peak_velocity, longer.given.stop_gap) == (0.5, 0.02)
    assert longer.given.pulse_acceleration == pytest.approx(9.81, rel=1e-10)
    slower = clip(pulse, ST3, give_way="velocity")
    assert isinstance(slower.given, DoublePulse)
    assert slower.given.peak_velocity == pytest.approx(0.5 * 0.0981, rel=1e-10)
    assert slower.given.pulse_acceleration == pytest.approx(9.81, rel=1e-10)
    # Too short a gap for 0.6 m/s at 9.81 m/s2: v^2 / (2 a) = gap.
    both = clip(DoublePulse(0.6, 0.01), ST3)
    assert isinstance(both.given, DoublePulse)
    assert both.given.peak_velocity == pytest.approx(math.sqrt(2.0 * 9.81 * 0.01), rel=1e-9)
    assert both.factor == pytest.approx(0.0981, rel=1e-9)


def test_a_gap_longer_than_the_stroke_is_refused_and_a_shorter_one_suggested() -> None:
    clipped = clip(DoublePulse(0.5, 0.3), ST3)
    assert (clipped.given, clipped.factor, clipped.changed, clipped.feasible) == (None, 0.0, True, False)
    assert (clipped.usage, clipped.residual_velocity, clipped.extra_duration) == ({}, 0.0, 0.0)
    assert isinstance(clipped.suggestion, DoublePulse)
    assert clipped.suggestion.peak_velocity == 0.5
    assert clipped.suggestion.travel == pytest.approx(0.216, rel=1e-9)


def test_jumps_become_stated_ramps() -> None:
    clipped = clip(CosineWave(6.0, 2.0), JERKY, brake=5.0)
    assert isinstance(clipped.given, Ramped)
    assert clipped.given.pulse == CosineWave(6.0, 2.0)
    assert clipped.extra_duration == pytest.approx(2.0 * 6.0 / 200.0, rel=1e-9)
    assert clipped.residual_velocity == pytest.approx(6.0**2 / 200.0, rel=1e-9)
    assert clipped.factor == 1.0
    (limit,) = clipped.limits
    assert (limit.name, limit.asked, limit.ratio) == ("jerk", None, None)
    assert limit.sentence == "single cosine asks a jump of 6 m/s2; jerky has ramps of 200 m/s3"
    smooth = clip(SineWave(9.0, 5.0), JERKY)
    assert isinstance(smooth.given, SineWave)
    assert smooth.given.amplitude == pytest.approx(200.0 / (10.0 * math.pi), rel=1e-9)
    assert smooth.binding is not None
    assert smooth.binding.sentence == "single sine asks 283 m/s3 of jerk; jerky has 200 m/s3"
    double = clip(DoublePulse(0.1, 0.02), JERKY).given
    assert isinstance(double, DoublePulse)
    assert double.jerk == pytest.approx(200.0, rel=1e-9)
    assert double.peak_velocity == 0.1


def test_a_ramped_pulse_asked_at_the_limit_can_still_be_reduced() -> None:
    clipped = clip(Ramped(ConstantPulse(20.0, 0.1), 200.0), JERKY, brake=5.0)
    assert isinstance(clipped.given, Ramped)
    assert clipped.factor < 0.5


def test_a_table_that_does_not_make_the_kind_suggests_the_nearest_constant_pulse() -> None:
    clipped = clip(SineWave(-4.0, 2.0), TRACK, brake=3.0)
    assert clipped.given is None
    assert [limit.name for limit in clipped.limits] == ["kind", "sense"]
    assert clipped.limits[0].sentence == "air_track makes pulses of kind constant only, no single sine"
    # Same peak acceleration and peak velocity 2 A / omega: a duration of 2 / omega.
    assert isinstance(clipped.suggestion, ConstantPulse)
    assert clipped.suggestion.amplitude == pytest.approx(4.0, rel=1e-12)
    assert clipped.suggestion.duration == pytest.approx(2.0 / (4.0 * math.pi), rel=1e-12)
    # Without a brake the table's own acceleration stops the suggestion; beyond the capacity it is clipped.
    strong = clip(SineWave(12.0, 2.0), TRACK)
    assert [limit.name for limit in strong.limits] == ["kind", "sense", "acceleration"]
    assert isinstance(strong.suggestion, ConstantPulse)
    assert strong.suggestion.amplitude == pytest.approx(6.0, rel=1e-10)
    assert strong.suggestion.duration == pytest.approx(2.0 / (4.0 * math.pi), rel=1e-12)
    assert clip(SineWave(0.0, 2.0), TRACK).suggestion is None
    elsewhere = TRACK.model_copy(update={"kinds": ("record",)})
    assert clip(SineWave(1.0, 2.0), elsewhere).suggestion is None


def test_a_one_sided_table_refuses_the_other_sense_and_suggests_its_own() -> None:
    clipped = clip(ConstantPulse(-2.0, 0.3), TRACK, brake=3.0)
    assert clipped.given is None
    assert [limit.sentence for limit in clipped.limits] == [
        "constant pulse asks acceleration towards -x; air_track has it towards +x only"
    ]
    assert clipped.suggestion == ConstantPulse(2.0, 0.3)
    assert clip(ConstantPulse(2.0, 0.3), TRACK, brake=3.0).feasible


def test_too_heavy_a_payload_is_refused() -> None:
    clipped = clip(SineWave(1.0, 2.0), ST3, payload=120)
    assert (clipped.given, clipped.suggestion) == (None, None)
    assert [limit.sentence for limit in clipped.limits] == ["the run asks 120 kg of payload; quanser_st3 has 100 kg"]
    heavy = clip(SineWave(1.0, 2.0), ST3, payload=100.0)
    assert heavy.feasible
    assert heavy.usage["payload"] == 1.0
    assert clip(SineWave(40.0, 2.0), ST3, payload=100.0).given is not None


def test_saturation_reports_the_residual_velocity_and_the_shape_error() -> None:
    asked = SineWave(12.0, 6.0)
    clipped = clip(asked, ST3, mode="saturate")
    level = 9.81
    assert isinstance(clipped.given, Saturated)
    assert clipped.given.level == pytest.approx(level, rel=1e-10)
    assert clipped.factor == pytest.approx(level / 12.0, rel=1e-10)
    t = np.linspace(0.0, asked.duration, 200001)
    a = asked.acceleration(t)
    shape_error = math.sqrt(np.mean((a - np.clip(a, -level, level)) ** 2) / np.mean(a**2))
    assert clipped.shape_error == pytest.approx(shape_error, rel=1e-5)
    assert abs(clipped.residual_velocity) < 1e-12
    assert clip(SineWave(1.0, 2.0), ST3, mode="saturate").feasible
    # Nothing to cut: only what the mode shares with "scale" is changed.
    assert clip(SineWave(9.0, 15.0), ST3, mode="saturate").given == SineWave(9.0, 10.0)
    lopsided = Record([0.0, 30.0, -10.0, -10.0, -10.0, 0.0], 0.02)
    assert abs(lopsided.final_velocity) < 1e-12
    moving = clip(lopsided, ST3, mode="saturate", brake=2.0)
    assert moving.residual_velocity < -0.1
    assert moving.stopping_distance < 0.0
    with pytest.raises(ValueError, match="saturated record ends moving at"):
        clip(lopsided, ST3, mode="saturate")


def test_where_cutting_cannot_help_scaling_is_suggested() -> None:
    clipped = clip(SineWave(9.0, 5.0), JERKY, mode="saturate")
    assert clipped.given is None
    assert clipped.binding is not None
    assert clipped.binding.name == "jerk"
    assert isinstance(clipped.suggestion, SineWave)


def test_enough_digits_are_shown_to_see_the_difference() -> None:
    sine = SineWave(9.8101, 8.0)
    binding = clip(sine, ST3).binding
    assert binding is not None
    assert binding.sentence == "single sine asks 9.8101 m/s2 of acceleration; quanser_st3 has 9.81 m/s2"


@pytest.mark.parametrize(
    ("pulse", "options", "sentence"),
    [
        (ConstantPulse(2.0, 0.3), {}, "constant pulse ends moving at 0.6 m/s; a brake in m/s2 must be given"),
        (DoublePulse(0.5, 0.02, 0.5), {}, "double pulse ends moving at -0.25 m/s; a brake in m/s2 must be given"),
        (SineWave(1.0, 1.0), {"brake": 10.0}, "brake asks 10 m/s2; quanser_st3 has 9.81 m/s2"),
        (SineWave(1.0, 1.0), {"brake": 0.0}, "brake is 0 m/s2; it must be above 0 m/s2"),
        (SineWave(1.0, 1.0), {"brake": math.nan}, "brake is nan; it must be finite"),
        (SineWave(1.0, 1.0), {"coast": -0.1}, "coast is -0.1 s; it must be at least 0 s"),
        (SineWave(1.0, 1.0), {"payload": -1.0}, "payload is -1 kg; it must be at least 0 kg"),
        (SineWave(1.0, 1.0), {"mode": "wrap"}, "mode is 'wrap'; it must be 'scale' or 'saturate'"),
        (
            SineWave(1.0, 1.0),
            {"give_way": "duration"},
            "give_way is 'duration'; for a single sine in mode 'scale' it must be 'amplitude'",
        ),
        (
            DoublePulse(0.1, 0.02),
            {"give_way": "amplitude"},
            "give_way is 'amplitude'; for a double pulse in mode 'scale' it must be 'duration' or 'velocity'",
        ),
        (
            DoublePulse(0.1, 0.02),
            {"give_way": "velocity", "mode": "saturate"},
            "give_way is 'velocity'; for a double pulse in mode 'saturate' it must be left out",
        ),
    ],
)
def test_bad_options_are_refused_in_one_sentence(pulse: Pulse, options: dict[str, object], sentence: str) -> None:
    with pytest.raises(ValueError, match=r".") as caught:
        clip(pulse, ST3, **options)  # type: ignore[arg-type]
    assert str(caught.value) == sentence


def test_a_report_is_immutable() -> None:
    clipped: Clipped = clip(SineWave(1.0, 2.0), ST3)
    with pytest.raises(dataclasses.FrozenInstanceError):
        clipped.given = None  # type: ignore[misc]
