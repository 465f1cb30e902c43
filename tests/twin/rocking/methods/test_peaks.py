"""The peak is the largest rotation of the motion given, whatever found it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.facts import B6L, sine
from twin import simulate
from twin.rocking.polynomial import maximum

coefficients = st.lists(st.floats(-1.0, 1.0), min_size=25, max_size=25)


@given(coefficients, st.floats(0.01, 0.9))
@settings(max_examples=200, deadline=None)
def test_maximum_of_a_polynomial(values: list[float], end: float) -> None:
    c = np.array([abs(values[0]), *values[1:]])  # a rotation is never negative, and the search relies on it
    sampled = max(0.0, float(np.max(np.polynomial.polynomial.polyval(np.linspace(0.0, end, 4001), c))))
    found = maximum(c, 24, end, 0.0)
    assert found >= sampled - 1e-14
    assert found <= sampled + 1e-4 * (1.0 + abs(sampled))


def test_maximum_inside_is_exact() -> None:
    c = np.zeros(25)
    c[:3] = [0.1, 0.3, -0.5]
    assert maximum(c, 24, 0.9, 0.0) == pytest.approx(0.145, abs=1e-16)
    assert maximum(c, 24, 0.9, 0.2) == 0.2


@pytest.mark.parametrize(
    ("method", "model"),
    [
        ("taylor", "nonlinear"),
        ("dop853", "nonlinear"),
        ("rk4", "nonlinear"),
        ("newmark", "nonlinear"),
        ("closed-form", "linearised"),
        ("dop853", "quasi-linear"),
    ],
)
def test_peak_of_the_motion(method: str, model: str) -> None:
    response = simulate(B6L, sine(1.3, 2.5, cycles=1.5), method=method, model=model, duration=1.2)
    around = np.linspace(0.0, 1.2, 20001)
    largest = float(np.max(np.abs(response.rotation(around))))
    assert response.peak_rotation >= largest - 1e-12
    assert response.peak_rotation == pytest.approx(largest, abs=1e-7)
