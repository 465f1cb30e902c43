"""Runs of released machines: what a table's run must be, and what clip makes of a machine's own end."""

from __future__ import annotations

import pickle
from dataclasses import replace
from typing import ClassVar

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from excitation import Capacity, ConstantPulse, Limit, ReleasedMachine, ReleasedRun, SineWave, clip
from excitation.pieces import as_spans
from excitation.shaper import EndStop


class Sled(ReleasedMachine):
    """The least there is of a machine: pushed by any constant pulse, stopped by a buffer, heavier than 0.1 m/s2."""

    slide_name: ClassVar[str] = "glide"
    stop_name: ClassVar[str] = "buffer"
    coasts: ClassVar[bool] = True

    @property
    def stopping(self) -> str:
        return "nothing stops it"

    def refusals(self, pulse, name, payload=None):
        if pulse.peak_acceleration >= 0.1:
            return []
        return [Limit("acceleration", pulse.peak_acceleration, 0.1, "m/s2", f"{name} does not move under 0.1 m/s2")]

    def settings_for(self, pulse, capacity, *, payload, coast):
        raise NotImplementedError

    def push(self, pulse):
        return as_spans(pulse.pieces)

    def slide_distance(self, pulse, coast):
        time = min(coast, abs(pulse.final_velocity) / self.friction)
        return time * (abs(pulse.final_velocity) - 0.5 * self.friction * time)


def sled(rebound: float = 0.3, friction: float = 0.5) -> Sled:
    return Sled(friction=friction, end_stop=EndStop(duration=0.05, rebound=rebound))


amplitudes = st.floats(0.2, 20.0) | st.floats(-20.0, -0.2)


@given(amplitudes, st.floats(0.02, 0.5), st.floats(0.0, 3.0), st.floats(0.0, 1.0), st.floats(0.05, 3.0))
def test_a_run_waits_moves_and_rests_without_a_gap(amplitude, duration, coast, rebound, friction) -> None:
    run = ReleasedRun(sled(rebound, friction), ConstantPulse(amplitude, duration), wait=0.4, coast=coast, rest=0.2)
    assert [phase.start for phase in run.phases] == [0.0, *(phase.end for phase in run.phases[:-1])]
    assert run.phases[-1].end == run.duration
    names = [phase.name for phase in run.phases]
    assert names[:2] == ["wait", "pulse"]
    assert names[-1] == "rest"
    order = ["wait", "pulse", "glide", "buffer", "glide back", "rest"]
    assert names == [name for name in order if name in names]
    assert run.pulse_start == 0.4
    assert run.displacement(0.4) == 0.0
    # At rest at both ends, whatever rounding did in between.
    size = run.peak_velocity
    assert abs(run.velocity(run.duration)) <= 1e-12 * max(size, 1.0)
    assert abs(run.velocity(run.shaking_end)) <= 1e-9 * max(size, 1.0)
    t = run.pulse_start + np.linspace(0.0, duration, 9)[:-1]
    assert run.velocity(t) == pytest.approx(amplitude * (t - 0.4), rel=1e-9, abs=1e-12)
    # Sliding and rebounding only lose energy, and the base never comes back faster.
    assert size == pytest.approx(abs(amplitude) * duration, rel=1e-9)


def test_the_buffer_is_met_where_it_is_said_to_stand() -> None:
    run = ReleasedRun(sled(), ConstantPulse(2.0, 0.5), wait=0.1, coast=0.8)
    buffer = next(phase for phase in run.phases if phase.name == "buffer")
    assert run.displacement(buffer.start) == pytest.approx(run.end_stop_position, rel=1e-12)
    assert buffer.start - run.pulse_start == pytest.approx(0.5 + 0.8, rel=1e-12)
    before, after = run.velocity(buffer.start), run.velocity(buffer.end)
    assert after == pytest.approx(-0.3 * before, rel=1e-12)


def test_friction_stops_it_before_the_buffer() -> None:
    run = ReleasedRun(sled(), ConstantPulse(2.0, 0.1), coast=10.0)
    assert [phase.name for phase in run.phases] == ["wait", "pulse", "glide", "rest"]
    # v = 0.2 m/s, f = 0.5 m/s2
    glide = run.phases[2]
    assert glide.end - glide.start == pytest.approx(0.4, rel=1e-12)
    assert run.end_stop_position == pytest.approx(0.01 + 0.04, rel=1e-12)


def test_a_push_to_the_left_is_the_mirror_image() -> None:
    right = ReleasedRun(sled(), ConstantPulse(2.0, 0.5), coast=0.5)
    left = ReleasedRun(sled(), ConstantPulse(-2.0, 0.5), coast=0.5)
    t = np.linspace(0.0, right.duration, 200)
    assert left.displacement(t) == pytest.approx(-right.displacement(t), abs=1e-15)
    assert left.end_stop_position == -right.end_stop_position


def test_shaking_is_all_from_the_release_to_rest() -> None:
    run = ReleasedRun(sled(), ConstantPulse(2.0, 0.5), coast=0.5)
    shaking = run.shaking
    assert shaking.duration == pytest.approx(run.shaking_end - run.pulse_start, rel=1e-12)
    t = np.linspace(0.0, shaking.duration, 300)[:-1]
    assert shaking.velocity(t) == pytest.approx(run.velocity(run.pulse_start + t), abs=1e-9)
    assert shaking.family == "constant"
    doubled = shaking.scaled(2.0)
    assert doubled.peak_velocity == pytest.approx(2.0, rel=1e-9)


def test_peaks_of_the_phases() -> None:
    run = ReleasedRun(sled(rebound=0.0), ConstantPulse(2.0, 0.5), coast=0.4)
    peaks = {phase.name: run.peak_in(phase) for phase in run.phases}
    assert peaks["pulse"] == 2.0
    assert peaks["glide"] == pytest.approx(0.5)
    # 0.8 m/s in 0.05 s as a half sine: pi v / (2 T).
    assert peaks["buffer"] == pytest.approx(0.5 * np.pi * 0.8 / 0.05)
    assert peaks["rest"] < 1e-12


def test_scaled_pickled_and_compared() -> None:
    run = ReleasedRun(sled(), ConstantPulse(2.0, 0.5), coast=0.5, wait=0.7, rest=0.3)
    assert run.scaled(0.5) == replace(run, pulse=ConstantPulse(1.0, 0.5))
    again = pickle.loads(pickle.dumps(run))  # noqa: S301 - our own bytes
    assert again == run
    assert np.array_equal(again.pieces, run.pieces)


def capacity(**changes) -> Capacity:
    numbers = {"name": "sled", "stroke": 2.0, "velocity": 1.0, "acceleration": 6.0, "kinds": ("constant",)}
    return Capacity(**{**numbers, "machine": sled(), **changes})


@given(st.floats(0.2, 30.0), st.floats(0.02, 1.0), st.floats(0.0, 2.0))
def test_clip_counts_the_machines_own_end(amplitude, duration, coast) -> None:
    table = capacity()
    clipped = clip(ConstantPulse(amplitude, duration), table, coast=coast)
    if clipped.given is None:
        assert clipped.limits
        return
    run = ReleasedRun(table.machine, clipped.given, coast=coast)
    assert run.travel <= 2.0 * (1.0 + 1e-9)
    assert run.peak_velocity <= 1.0 * (1.0 + 1e-9)
    assert clipped.usage["stroke"] == pytest.approx(run.travel / 2.0, rel=1e-9)
    # How far it goes after the pulse is the machine's business: no brake is asked for.
    assert clipped.stopping_distance == pytest.approx(run.net_displacement - clipped.given.net_displacement, abs=1e-9)


def test_what_the_reduced_pulse_cannot_be_set_to_is_refused() -> None:
    clipped = clip(ConstantPulse(1.0, 20.0), capacity())
    assert clipped.given is None
    assert clipped.limits[0].sentence == "sled does not move under 0.1 m/s2"
    assert {limit.name for limit in clipped.limits[1:]} == {"velocity", "stroke"}


def test_a_sine_is_refused_with_the_nearest_constant_pulse() -> None:
    clipped = clip(SineWave(2.0, 1.0), capacity())
    assert clipped.given is None
    assert clipped.limits[0].sentence == "sled makes pulses of kind constant only, no single sine"
    assert isinstance(clipped.suggestion, ConstantPulse)


def test_a_capacity_holds_its_machine() -> None:
    table = capacity(
        provenance={"stroke": "tape"},
        machine=Sled(friction=0.5, end_stop=EndStop(duration=0.1), provenance={"friction_m_s2": "scale"}),
    )
    assert table.sources == {
        "stroke": "tape",
        "machine.friction_m_s2": "scale",
        "machine.end_stop": "no source given",
    }
    assert table.model_dump(mode="json")["machine"]["end_stop"]["duration"] == 0.1
    assert table.machine_for(ConstantPulse(1.0, 1.0)) is table.machine
    assert table.machine_for(SineWave(1.0, 1.0)) is None
    with pytest.raises(ValidationError, match="provenance names 'colour'"):
        Sled(friction=0.5, end_stop=EndStop(duration=0.1), provenance={"colour": "red"})


@pytest.mark.parametrize(("name", "value"), [("wait", 0.0), ("rest", 0.001), ("coast", -1.0), ("wait", float("nan"))])
def test_times_are_bounded(name, value) -> None:
    with pytest.raises(ValueError, match=f"{name} is"):
        ReleasedRun(sled(), ConstantPulse(1.0, 1.0), **{name: value})


@given(st.floats(0.05, 1.0), st.floats(0.01, 3.0), st.floats(0.0, 1.0), st.floats(0.0, 2.0))
def test_no_run_outlasts_the_longest_stop_after_its_push(velocity, friction, rebound, coast) -> None:
    machine = sled(rebound, friction)
    run = ReleasedRun(machine, ConstantPulse(velocity / 0.1, 0.1), coast=coast)
    lowest, highest = run.displacement_range
    pulse = next(phase for phase in run.phases if phase.name == "pulse")
    assert run.shaking_end - pulse.end <= machine.longest_stop(velocity, highest - lowest) * (1.0 + 1e-9)
