"""Shaped changes of speed and sliding with friction, against quadrature and an integrator."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError
from scipy.integrate import quad, solve_ivp

from excitation.pieces import PieceTable, assemble
from excitation.shaper import PEAK_OVER_MEAN, EndStop, PulseShaper, slide

shapes = st.sampled_from(sorted(PEAK_OVER_MEAN))


@given(shapes, st.floats(1e-3, 1.0), st.floats(0.01, 3.0) | st.floats(-3.0, -0.01))
def test_a_shape_changes_the_speed_by_what_it_should_in_its_time_and_way(shape, duration, change) -> None:
    shaper = PulseShaper(duration=duration, shape=shape)
    table = PieceTable(assemble(shaper.change(change)))
    time, velocity, travel = table.end
    assert time == pytest.approx(duration, rel=1e-12)
    assert velocity == pytest.approx(change, rel=1e-12)
    assert travel == pytest.approx(shaper.travel(0.0, change), rel=1e-12)
    middle = table.acceleration(0.5 * duration)
    assert float(middle) == pytest.approx(shaper.peak(change), rel=1e-9)


@pytest.mark.parametrize(
    ("shape", "waveform"),
    [
        ("half sine", lambda u: math.sin(math.pi * u)),
        ("rectangular", lambda _: 1.0),
        ("triangular", lambda u: 1.0 - abs(2.0 * u - 1.0)),
    ],
)
def test_each_shape_is_the_one_it_is_called(shape, waveform) -> None:
    shaper = PulseShaper(duration=0.02, shape=shape)
    table = PieceTable(assemble(shaper.change(0.4)))
    mean, _ = quad(waveform, 0.0, 1.0)
    for u in (0.0, 0.1, 0.3, 0.5, 0.77, 0.99):
        assert float(table.acceleration(0.02 * u)) == pytest.approx(0.4 / 0.02 * waveform(u) / mean, abs=1e-9)


@given(st.floats(0.0, 1.0), st.floats(-2.0, 2.0))
def test_an_end_stop_turns_the_speed_back(rebound, velocity) -> None:
    spans = EndStop(duration=0.01, rebound=rebound).stop(velocity)
    after = velocity + PieceTable(assemble(spans)).end[1]
    assert after == pytest.approx(-rebound * velocity, abs=1e-12)


@given(st.floats(0.01, 3.0), st.floats(1e-3, 5.0), st.floats(0.0, 5.0))
def test_sliding_against_an_integrator(velocity, friction, distance) -> None:
    duration, after = slide(velocity, friction, distance)
    assert 0.0 <= after <= velocity
    way = velocity * duration - 0.5 * friction * duration**2
    if after > 0.0:
        assert way == pytest.approx(distance, rel=1e-9, abs=1e-12)
    else:
        assert way <= distance * (1.0 + 1e-12)
        assert duration == pytest.approx(velocity / friction, rel=1e-12)
    arrived = solve_ivp(lambda _, z: [z[1], -friction], (0.0, duration or 1e-9), [0.0, velocity], "DOP853", rtol=1e-12)
    assert arrived.y[1, -1] == pytest.approx(after, abs=1e-8)


def test_nothing_in_the_way_and_nothing_to_slide() -> None:
    assert slide(2.0, 0.5, math.inf) == (4.0, 0.0)
    assert slide(2.0, 0.5, 0.0) == (0.0, 2.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"duration": 0.0},
        {"duration": math.nan},
        {"duration": 0.01, "shape": "square"},
        {"duration": 0.01, "rebound": 1.1},
        {"duration": 0.01, "rebound": -0.1},
        {"duration": 0.01, "colour": 1},
    ],
)
def test_numbers_are_bounded(wrong) -> None:
    with pytest.raises(ValidationError):
        EndStop(**wrong)
