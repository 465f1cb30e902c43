"""One flight in closed form against the solver, and its derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.facts import B6L
from twin.calibration.course import OTHERS, Flights, course, places, sorted_out
from twin.calibration.flight import half_duration, lean, shape_of
from twin.simulation import simulate

ALPHA, P = B6L.slenderness, B6L.frequency_parameter


@given(st.floats(0.05, 0.6), st.floats(0.01, 0.999))
def test_a_flight_is_found_from_its_duration(alpha: float, part: float) -> None:
    peak = part * alpha
    shape = shape_of(half_duration(np.array([peak]), alpha), alpha)
    assert alpha - shape.valley[0] == pytest.approx(peak, rel=1e-9)
    # Near the contact the speed is that of a fall from the peak.
    assert shape.speed[0] ** 2 == pytest.approx(2.0 * (np.cos(alpha - peak) - np.cos(alpha)), rel=1e-9, abs=1e-15)


def test_the_course_is_the_solvers() -> None:
    response = simulate(B6L, initial_rotation=0.2, restitution=0.9)
    x, flights = _laid_out(response.impact_times[:10])
    assert np.max(np.abs(course(flights, x).rotation - response.rotation(flights.time))) < 1e-13


def test_derivatives_are_those_of_differences() -> None:
    x, flights = _laid_out(simulate(B6L, initial_rotation=0.15, restitution=0.9).impact_times[:6])
    modelled = course(flights, x)
    place = places(flights)[flights.flight]
    whole = np.zeros((flights.time.size, x.size))
    for k in range(place.shape[1]):
        np.add.at(whole, (np.arange(flights.time.size), place[:, k]), modelled.slope[:, k])
    # Samples beside an impact change their flight, and the first one is let go.
    calm = np.min(np.abs(flights.time[:, None] - x[None, : flights.instants]), axis=1) > 1e-4
    for k in range(x.size):
        step = np.zeros(x.size)
        step[k] = 1e-6
        difference = (course(flights, x + step).rotation - course(flights, x - step).rotation) / 2e-6
        assert np.max(np.abs(difference - whole[:, k])[calm]) < 1e-8


def test_a_slow_fall_from_near_the_unstable_equilibrium() -> None:
    # failures.md 7
    assert half_duration(np.array([0.21864707897935456]), ALPHA)[0] / P == pytest.approx(1.35789784316246, rel=1e-6)
    assert lean(np.array([1e-8]), np.array([5.0]))[0] == pytest.approx(1e-8 * np.cosh(5.0), rel=1e-8)


def test_samples_are_put_into_the_flight_that_the_instants_say() -> None:
    x, flights = _laid_out(simulate(B6L, initial_rotation=0.15, restitution=0.9).impact_times[:4])
    wrong = flights._replace(flight=np.minimum(flights.flight + (np.arange(flights.time.size) % 50 == 0), 3))
    found = sorted_out(wrong, x)
    assert np.array_equal(found.time, flights.time)
    assert np.array_equal(found.flight, flights.flight)


def _laid_out(impacts: np.ndarray) -> tuple[np.ndarray, Flights]:
    time = np.arange(0.0, float(impacts[-1]), 2e-3)
    left = np.arange(impacts.size, dtype=np.int64)
    flights = Flights(
        left=left,
        right=left + 1,
        side=np.where(left % 2 == 0, 1, -1).astype(np.int64),
        entry=True,
        held=True,
        instants=impacts.size + 1,
        flight=np.searchsorted(impacts, time, side="right").astype(np.int64),
        time=time,
        rotation=np.zeros(time.size),
    )
    x = np.concatenate([[0.0], impacts, np.log([ALPHA, P]), [0.0]])
    assert x.size == flights.instants + OTHERS
    return x, flights
