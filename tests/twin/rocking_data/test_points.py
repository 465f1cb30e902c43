"""Rotation from points, and acceleration from displacement, against what they were made from."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from twin.rocking_data.differentiation import LEAST_WINDOW, second_derivative
from twin.rocking_data.rigid import rigid_motion

POINTS = np.array([[-0.02, 0.05], [0.02, 0.12], [0.0, 0.26]])


def turned(angle: float, shift: tuple[float, float] = (0.0, 0.0)) -> np.ndarray:
    """A lean to +x by `angle`: right-handed about +y, with z up."""
    c, s = math.cos(angle), math.sin(angle)
    return POINTS @ np.array([[c, -s], [s, c]]) + shift


@given(st.floats(-1.5, 1.5), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_rigid_motion_is_found_again(angle: float, x: float, z: float) -> None:
    motion = rigid_motion(POINTS, turned(angle, (x, z))[None])
    assert motion.rotation[0] == pytest.approx(angle, abs=1e-12)
    assert motion.residual[0] == pytest.approx(0.0, abs=1e-12)
    centre = POINTS.mean(axis=0)
    moved = turned(angle, (x, z)).mean(axis=0) - centre
    np.testing.assert_allclose(motion.translation[0], moved, atol=1e-12)


def test_a_top_that_moves_to_positive_x_is_positive() -> None:
    lean = np.array([[[0.0, 0.1], [0.03, 0.3]]])
    assert rigid_motion(np.array([[0.0, 0.1], [0.0, 0.3]]), lean).rotation[0] > 0.0


def test_points_out_of_sight() -> None:
    path = np.stack([turned(0.1), turned(0.2), turned(0.3)])
    path[1, 0] = np.nan
    path[2, :2] = np.nan
    motion = rigid_motion(POINTS, path)
    np.testing.assert_allclose(motion.rotation[:2], [0.1, 0.2], atol=1e-12)
    assert math.isnan(motion.rotation[2])


def test_the_noise_is_that_of_least_squares() -> None:
    """Var(theta) = sigma^2 / sum of squared distances from the centre."""
    rng = np.random.default_rng(0)
    sigma = 1e-5
    path = turned(0.05)[None] + sigma * rng.standard_normal((4000, 3, 2))
    motion = rigid_motion(POINTS, path)
    expected = sigma / math.sqrt(float(np.sum((POINTS - POINTS.mean(axis=0)) ** 2)))
    assert np.std(motion.rotation) == pytest.approx(expected, rel=0.05)
    # Of 6 coordinates 3 are spent on the motion.
    assert np.sqrt(np.mean(motion.residual**2)) == pytest.approx(sigma * math.sqrt(3.0 / 3.0), rel=0.05)


@pytest.mark.parametrize("points", [POINTS[:1], np.tile(POINTS[:1], (3, 1))])
def test_what_has_no_rotation_is_refused(points: np.ndarray) -> None:
    with pytest.raises(ValueError, match="point"):
        rigid_motion(points, points[None])


@pytest.mark.parametrize("rate", [250.0, 1000.0])
def test_the_second_derivative_of_a_cubic_is_exact(rate: float) -> None:
    time = np.arange(0.0, 1.0, 1.0 / rate)
    found = second_derivative(2.0 - time + 3.0 * time**2 - 0.7 * time**3, 1.0 / rate, 20.0)
    np.testing.assert_allclose(found.values, 6.0 - 4.2 * time, atol=1e-6)


@pytest.mark.parametrize(("rate", "bandwidth"), [(1000.0, 20.0), (1000.0, 50.0), (400.0, 30.0)])
def test_the_bandwidth_is_where_it_says(rate: float, bandwidth: float) -> None:
    time = np.arange(0.0, 4.0, 1.0 / rate)

    def gain(frequency: float) -> float:
        omega = 2.0 * math.pi * frequency
        inside = second_derivative(np.sin(omega * time), 1.0 / rate, bandwidth).values[400:-400]
        waves = np.stack((np.sin(omega * time), np.cos(omega * time)), axis=1)[400:-400]
        return float(np.linalg.norm(np.linalg.lstsq(waves, inside, rcond=None)[0])) / omega**2

    reached = second_derivative(np.sin(time), 1.0 / rate, bandwidth).bandwidth
    assert reached >= bandwidth
    assert gain(reached) == pytest.approx(math.sqrt(0.5), abs=0.01)
    assert gain(0.1 * reached) == pytest.approx(1.0, abs=0.01)


def test_the_noise_it_says_is_the_noise_it_makes() -> None:
    time, sigma = np.arange(0.0, 20.0, 1e-3), 1e-5
    noisy = 0.01 * np.sin(8.0 * np.pi * time) + sigma * np.random.default_rng(1).standard_normal(time.size)
    found = second_derivative(noisy, 1e-3, 30.0)
    clean = second_derivative(0.01 * np.sin(8.0 * np.pi * time), 1e-3, 30.0)
    assert found.signal_noise == pytest.approx(sigma, rel=0.1)
    assert np.std(found.values - clean.values) == pytest.approx(found.noise, rel=0.1)


def test_too_few_samples() -> None:
    with pytest.raises(ValueError, match="4 samples have no second derivative"):
        second_derivative(np.zeros(LEAST_WINDOW - 1), 1e-3, 20.0)
    assert second_derivative(np.zeros(LEAST_WINDOW), 1e-3, 20.0).values.tolist() == [0.0] * LEAST_WINDOW
