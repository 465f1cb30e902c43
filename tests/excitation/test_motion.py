"""The whole run: at rest at both ends, inside the capacity throughout, and in its stated order."""

from __future__ import annotations

import math
import pickle

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from excitation import (
    Capacity,
    ConstantPulse,
    CosineWave,
    DoublePulse,
    Motion,
    Phase,
    Pulse,
    Record,
    SineWave,
    clip,
)

ST3 = Capacity(name="quanser_st3", stroke=0.216, velocity=0.664, acceleration=9.81, frequency=10.0)

amplitudes = st.floats(0.1, 30.0) | st.floats(-30.0, -0.1)
pulses = st.one_of(
    st.builds(SineWave, amplitudes, st.floats(0.3, 20.0), st.sampled_from([1.0, 3.0, 0.4])),
    st.builds(CosineWave, amplitudes, st.floats(0.3, 20.0), st.sampled_from([1.0, 1.7])),
    st.builds(ConstantPulse, amplitudes, st.floats(0.02, 0.5)),
    st.builds(DoublePulse, st.floats(0.05, 0.6), st.floats(0.003, 0.04), st.sampled_from([0.0, 0.3])),
    st.builds(Record, st.lists(st.floats(-20.0, 20.0), min_size=2, max_size=20), st.floats(0.01, 0.1)),
)
capacities = st.builds(
    Capacity,
    name=st.just("table"),
    stroke=st.floats(0.05, 1.0),
    velocity=st.floats(0.1, 2.0),
    acceleration=st.floats(2.0, 30.0),
    jerk=st.none() | st.floats(50.0, 5000.0),
    frequency=st.none() | st.floats(1.0, 20.0),
)


def part(motion: Motion, name: str) -> list[Phase]:
    return [phase for phase in motion.phases if phase.name == name]


@given(pulses, capacities, st.floats(0.05, 1.0), st.sampled_from([0.0, 0.05]), st.floats(0.2, 5.0))
@settings(max_examples=100, deadline=None)
def test_the_whole_run_stays_inside_the_capacity_and_ends_where_it_began(
    asked: Pulse, capacity: Capacity, share: float, coast: float, positioning: float
) -> None:
    brake = share * capacity.acceleration
    pulse = clip(asked, capacity, brake=brake, coast=coast).given
    assume(pulse is not None)
    run = Motion(pulse, positioning, capacity=capacity, brake=brake, coast=coast, settle=0.3)

    # By the exact extremes; only the times' place in the run rounds differently.
    slack = 1.0 + 1e-9
    assert run.peak_acceleration <= capacity.acceleration * slack
    assert run.peak_velocity <= capacity.velocity * slack
    lowest, highest = run.displacement_range
    assert -capacity.stroke / 2.0 * slack <= lowest <= highest <= capacity.stroke / 2.0 * slack
    if capacity.jerk is not None:
        assert run.peak_jerk <= capacity.jerk * slack
        assert run.largest_jump == 0.0

    # By sampling, at the ends and in the pauses too.
    t = np.linspace(0.0, run.duration, 2001)
    assert np.abs(run.displacement(t)).max() <= capacity.stroke / 2.0 * slack
    for phase in (*part(run, "approach"), *part(run, "return")):
        move = run.acceleration(np.linspace(phase.start, np.nextafter(phase.end, 0.0), 101))
        assert np.abs(move).max() <= positioning
    for phase in part(run, "settle"):
        assert np.abs(run.acceleration(np.linspace(phase.start, phase.end, 7)[:-1])).max() < 1e-8
    assert run.displacement(0.0) == 0.0
    for instant in (run.duration, run.duration + 10.0):
        assert abs(run.displacement(instant)) < 1e-12
        assert abs(run.velocity(instant)) < 1e-12

    # Centred: from the start of the pulse to the end of the brake, both sides get the same room.
    ends = [phase.end for phase in run.phases if phase.name in ("pulse", "coast", "brake")]
    inner = run.breakpoints[(run.breakpoints >= run.pulse_start) & (run.breakpoints <= ends[-1])]
    assert max(run.displacement(inner)) <= highest + 1e-12
    assert lowest == pytest.approx(-highest, rel=1e-6, abs=1e-9)

    # The pulse itself is unchanged, only moved.
    s = np.linspace(0.0, pulse.duration, 33)[:-1] + 1e-9
    start = run.pulse_start
    scale = pulse.peak_acceleration
    inside = s < pulse.duration
    assert run.velocity(start + s[inside]) == pytest.approx(pulse.velocity(s[inside]), rel=1e-6, abs=1e-9 * scale)
    moved = run.displacement(start + s[inside]) - run.displacement(start)
    assert moved == pytest.approx(pulse.displacement(s[inside]), rel=1e-6, abs=1e-9)

    # Phases follow each other without a gap.
    assert [phase.start for phase in run.phases] == [0.0, *(phase.end for phase in run.phases[:-1])]
    assert run.phases[-1].end == run.duration
    assert set(run.breakpoints) >= {phase.start for phase in run.phases}


@given(pulses, st.floats(1.0, 9.0), st.floats(0.01, 3.0))
@settings(max_examples=40, deadline=None)
def test_what_shakes_the_block_is_the_run_from_the_pulse_to_the_end_of_the_brake(
    pulse: Pulse, brake: float, wait: float
) -> None:
    run = Motion(pulse, 1.0, brake=brake, settle=0.2, wait=wait)
    shaking = run.shaking
    last = [phase for phase in run.phases if phase.name in ("pulse", "coast", "brake")][-1]
    assert shaking.duration == pytest.approx(last.end - run.pulse_start, rel=1e-12)
    assert abs(shaking.final_velocity) < 1e-9 * max(shaking.peak_velocity, 1.0)
    t = np.linspace(0.0, shaking.duration, 50)
    assert shaking.velocity(t) == pytest.approx(run.velocity(run.pulse_start + t), abs=1e-9 * pulse.peak_acceleration)
    assert shaking.family == pulse.family
    assert "shaking" in shaking.kind
    assert shaking.scaled(0.5).duration > 0.0
    after = run.phases[run.phases.index(last) + 1]
    assert (after.name, after.end - after.start) == ("settle", pytest.approx(wait, rel=1e-9))


def test_the_order_of_a_run_with_a_brake() -> None:
    run = Motion(ConstantPulse(2.0, 0.3), 1.0, capacity=ST3, brake=3.0, coast=0.05, settle=0.5)
    names = ["settle", "approach", "settle", "pulse", "coast", "brake", "settle", "return", "settle"]
    assert [phase.name for phase in run.phases] == names
    assert run.pulse_start == part(run, "pulse")[0].start
    # 0.09 m in the pulse, 0.03 m in the coast and 0.06 m in the brake, centred.
    assert run.displacement(run.pulse_start) == pytest.approx(-0.09, rel=1e-12)
    assert run.displacement(part(run, "brake")[0].end) == pytest.approx(0.09, rel=1e-12)
    brake = part(run, "brake")[0]
    assert brake.end - brake.start == pytest.approx(0.2, rel=1e-12)
    assert run.acceleration(0.5 * (brake.start + brake.end)) == pytest.approx(-3.0)
    assert (run.kind, run.family, run.fundamental) == ("run of a constant pulse", "constant", None)
    assert pickle.loads(pickle.dumps(run)) == run  # noqa: S301
    assert hash(run) == hash(pickle.loads(pickle.dumps(run)))  # noqa: S301


def test_a_jerk_limit_makes_the_brake_a_trapezoid() -> None:
    table = ST3.model_copy(update={"jerk": 100.0, "stroke": 2.0})
    pulse = clip(ConstantPulse(2.0, 0.3), table, brake=3.0).given
    run = Motion(pulse, 1.0, capacity=table, brake=3.0)
    brake = part(run, "brake")[0]
    assert pulse is not None
    assert brake.end - brake.start == pytest.approx(pulse.final_velocity / 3.0 + 3.0 / 100.0, rel=1e-9)
    assert run.acceleration(0.5 * (brake.start + brake.end)) == pytest.approx(-3.0)


@pytest.mark.parametrize(
    ("capacity", "duration"),
    [
        ({}, math.sqrt(2.0 * math.pi * 0.05 / 1.0)),
        ({"acceleration": 0.5}, math.sqrt(2.0 * math.pi * 0.05 / 0.5)),
        ({"velocity": 0.05}, 2.0 * 0.05 / 0.05),
        ({"jerk": 0.5}, (4.0 * math.pi**2 * 0.05 / 0.5) ** (1.0 / 3.0)),
        ({"frequency": 0.25}, 4.0),
    ],
)
def test_the_approach_takes_the_longest_of_the_times_its_limits_need(
    capacity: dict[str, float], duration: float
) -> None:
    # A pulse of next to no size around x = 0.1 m: the approach covers 0.05 m.
    base = {"stroke": 1.0, "velocity": 5.0, "acceleration": 30.0}
    rises = SineWave(0.1 * 2.0 * math.pi * 0.04, 0.2)
    assert rises.travel == pytest.approx(0.1)
    slow = Capacity(name="slow", **{**base, **capacity})
    if "velocity" in capacity or "jerk" in capacity:
        rises = clip(SineWave(0.1 * 2.0 * math.pi * 0.0025, 0.05), slow).given  # type: ignore[assignment]
        assert rises.travel == pytest.approx(0.1)
    run = Motion(rises, 1.0, capacity=slow)
    approach = part(run, "approach")[0]
    assert approach.end - approach.start == pytest.approx(duration, rel=1e-9)


def test_a_pulse_that_needs_no_room_needs_no_approach() -> None:
    run = Motion(ConstantPulse(0.0, 2.0), 1.0, settle=0.5)
    assert run.phases == (Phase("settle", 0.0, 0.5), Phase("pulse", 0.5, 2.5), Phase("settle", 2.5, 3.0))
    assert run.travel == 0.0
    tiny = Motion(SineWave(1e-6, 10.0), 1.0)
    assert part(tiny, "approach")[0].end - part(tiny, "approach")[0].start == pytest.approx(0.1)


def test_standing_still() -> None:
    still = Motion.standstill(8.0)
    assert (still.duration, still.pulse_start, still.travel, still.peak_acceleration) == (8.0, 0.0, 0.0, 0.0)
    assert still.phases == (Phase("settle", 0.0, 8.0),)
    assert (still.kind, still.family, still.fundamental) == ("standstill", "standstill", None)
    assert still.scaled(0.5) == still
    assert still.shaking.duration == 8.0
    assert still.pieces.tolist() == [[0.0, 8.0, 0.0, 0.0, 0.0, 0.0, 0.0]]


def test_a_scaled_run_is_the_run_of_the_scaled_pulse() -> None:
    run = Motion(SineWave(2.0, 2.0), 1.0, capacity=ST3, settle=0.4, wait=2.0)
    assert run.scaled(0.5) == Motion(SineWave(1.0, 2.0), 1.0, capacity=ST3, settle=0.4, wait=2.0)
    assert run.fundamental == 2.0


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (
            lambda: Motion(ConstantPulse(2.0, 0.3), 1.0),
            "constant pulse ends moving at 0.6 m/s; a brake in m/s2 must be given",
        ),
        (
            lambda: Motion(SineWave(5.0, 1.0 / 0.6), 1.0, capacity=ST3),
            "single sine asks 0.955 m/s of velocity; quanser_st3 has 0.664 m/s",
        ),
        (
            lambda: Motion(ConstantPulse(2.0, 0.3), 1.0, capacity=ST3, brake=12.0),
            "brake asks 12 m/s2; quanser_st3 has 9.81 m/s2",
        ),
        (
            lambda: Motion(CosineWave(1.0, 2.0), 1.0, capacity=ST3.model_copy(update={"jerk": 50.0})),
            "single cosine asks a jump of 1 m/s2; quanser_st3 has ramps of 50 m/s3",
        ),
        (
            lambda: Motion(SineWave(1.0, 2.0), 0.0),
            "positioning_acceleration is 0 m/s2; it must be above 0 m/s2",
        ),
        (lambda: Motion(SineWave(1.0, 2.0), math.nan), "positioning_acceleration is nan; it must be finite"),
        (lambda: Motion(SineWave(1.0, 2.0), 1.0, settle=0.0), "settle is 0 s; it must be at least 0.01 s"),
        (lambda: Motion(SineWave(1.0, 2.0), 1.0, wait=0.0), "wait is 0 s; it must be at least 0.01 s"),
        (lambda: Motion(SineWave(1.0, 2.0), 1.0, coast=-1.0), "coast is -1 s; it must be at least 0 s"),
        (lambda: Motion.standstill(-1.0), "duration is -1 s; it must be at least 0.01 s"),
    ],
)
def test_runs_that_cannot_be_made_are_refused_in_one_sentence(make: object, sentence: str) -> None:
    with pytest.raises(ValueError, match=r".") as caught:
        make()  # type: ignore[operator]
    assert str(caught.value) == sentence


def test_a_standstill_checks_its_brake_and_coast_too() -> None:
    for options in ({"brake": -1.0}, {"coast": math.inf}):
        with pytest.raises(ValueError, match=r"it must be"):
            Motion(None, 1.0, **options)  # type: ignore[arg-type]
