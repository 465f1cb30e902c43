"""Acceleration from a measured displacement: smoothing differentiation, with its bandwidth and its noise said."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from twin.rocking_data.noise import FloatArray, noise_level

ORDER = 3
"""Degree of the polynomials."""
LEAST_WINDOW = 5
"""Samples of the shortest window that has a second derivative and something to average."""


class Derivative(NamedTuple):
    """Second derivative of a signal.

    Attributes
    ----------
    values : ndarray, shape (n,)
    window : int
        Samples of the sliding polynomial.
    bandwidth : float
        Frequency at which the amplitude is down to 1/sqrt(2) of the true second derivative's, Hz.
    noise : float
        Standard deviation of a value, inside, that the noise of the samples makes.
    signal_noise : float
        Standard deviation of a sample, as estimated.
    """

    values: FloatArray
    window: int
    bandwidth: float
    noise: float
    signal_noise: float


def second_derivative(values: FloatArray, step: float, bandwidth: float) -> Derivative:
    """Return the second derivative of evenly spaced samples by sliding cubics (Savitzky and Golay, Anal. Chem. 36,
    1964).

    The window is the longest whose bandwidth is not below the one asked for: what it averages away is noise. At the
    ends the outermost polynomials are used off their middle, which is less certain.

    Parameters
    ----------
    values : ndarray, shape (n,)
        Finite, n from `LEAST_WINDOW`.
    step : float
        s.
    bandwidth : float
        Hz, above 0.

    Raises
    ------
    ValueError
        Too few samples.
    """
    if values.size < LEAST_WINDOW:
        raise ValueError(f"{values.size} samples have no second derivative; it takes {LEAST_WINDOW}")
    window = _window(step, bandwidth, values.size)
    weights = _weights(window)
    middle = weights[window // 2]
    half = window // 2
    inside = np.convolve(values, middle[::-1], mode="valid").astype(np.float64)
    start, end = weights[:half] @ values[:window], weights[half + 1 :] @ values[-window:]
    noise = noise_level(np.arange(values.size, dtype=np.float64) * step, values)
    gain = float(np.sqrt(np.sum(middle**2))) / step**2
    result = np.concatenate((start, inside, end)) / step**2
    return Derivative(result, window, _bandwidth(window) / step, noise * gain, noise)


def _weights(window: int) -> FloatArray:
    """Return the rows that give the second derivative at each place of a window, per squared step."""
    half = window // 2
    place = np.arange(-half, half + 1, dtype=np.float64)
    scale = float(max(half, 1))
    powers = np.vander(place / scale, ORDER + 1, increasing=True)
    fit = np.linalg.pinv(powers)
    # d2/dx2 of sum c_k x^k = sum k (k - 1) c_k x^(k - 2)
    second = np.zeros((window, ORDER + 1))
    for k in range(2, ORDER + 1):
        second[:, k] = k * (k - 1) * (place / scale) ** (k - 2)
    return second @ fit / scale**2


def _bandwidth(window: int) -> float:
    """Return the frequency, in units of the sampling frequency, where the response is 1/sqrt(2) of the true one."""
    middle = _weights(window)[window // 2]
    place = np.arange(window) - window // 2
    low, high = 0.0, 0.5
    for _ in range(50):
        frequency = 0.5 * (low + high)
        angle = 2.0 * math.pi * frequency
        response = -float(np.sum(middle * np.cos(angle * place))) / angle**2
        low, high = (frequency, high) if response > math.sqrt(0.5) else (low, frequency)
    return low


def _window(step: float, bandwidth: float, most: int) -> int:
    """Return the longest odd window whose bandwidth is at least the one asked for."""
    low, high = 2, (most - 1) // 2
    # The bandwidth falls as the window grows.
    while low < high:
        half = (low + high + 1) // 2
        if _bandwidth(2 * half + 1) / step >= bandwidth:
            low = half
        else:
            high = half - 1
    return 2 * low + 1
