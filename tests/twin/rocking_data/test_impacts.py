"""Impacts found in noisy rotations against those of the exact solution: none missed, none invented, errors honest."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from excitation import SineWave
from tests.facts import B6L
from twin.rocking.response import Response
from twin.rocking_data.flights import median_of_three
from twin.rocking_data.impacts import Impacts, find_impacts
from twin.rocking_data.noise import noise_level, rest_offset
from twin.simulation import simulate

FREE = simulate(B6L, initial_rotation=0.15)
SINE = simulate(B6L, SineWave(2.943, 4.0))
CASES = {"free": FREE, "sine": SINE}
END = 6.0
SEEDS = 12


def sampled(response: Response, rate: float, noise: float, seed: int = 0) -> tuple[np.ndarray, np.ndarray]:
    time = np.arange(0.0, END, 1.0 / rate)
    return time, response.rotation(time) + noise * np.random.default_rng(seed).standard_normal(time.size)


def flight_peaks(response: Response) -> np.ndarray:
    """Largest rotation of the flight before and after each impact, the smaller of the two, rad."""
    ends = np.concatenate(([0.0], response.impact_times, [response.rest_time or END]))
    peaks = [np.max(np.abs(response.rotation(np.linspace(a, b, 200)))) for a, b in pairwise(ends)]
    return np.minimum(peaks[:-1], peaks[1:])


def nearest(found: Impacts, response: Response) -> np.ndarray:
    return np.argmin(np.abs(response.impact_times[None] - found.time[:, None]), axis=1)


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_none_missed_and_none_invented(name: str, rate: float, noise: float) -> None:
    response = CASES[name]
    # Between flights of twice the band, which last five samples, an impact can be seen.
    ends = np.concatenate(([0.0], response.impact_times))
    lasting = np.minimum(np.diff(ends), np.append(np.diff(response.impact_times), 0.0)) > 5.0 / rate
    visible = response.impact_times[(flight_peaks(response) > 10.0 * noise) & lasting]
    assert visible.size >= 4
    for seed in range(SEEDS):
        found = find_impacts(*sampled(response, rate, noise, seed))
        for time in visible:
            assert np.min(np.abs(found.time - time)) < 5e-3, (seed, time)
        true = response.impact_times[nearest(found, response)]
        # At the end of a decay, where flights are hardly higher than the band, times are less certain than they say.
        faint = ~np.isin(true, visible)
        allowed = np.maximum(8.0 * np.nan_to_num(found.time_error), 1.0 / rate) + 0.05 * (found.landing | faint)
        assert np.all(np.abs(found.time - true) < allowed), seed
        strong = true[~faint]
        assert np.unique(strong).size == strong.size, "an impact was found twice"


@pytest.mark.parametrize("name", CASES)
@pytest.mark.parametrize("rate", [100.0, 250.0, 1000.0])
@pytest.mark.parametrize("noise", [1e-4, 1e-3])
def test_times_and_restitution_are_unbiased_and_their_errors_honest(name: str, rate: float, noise: float) -> None:
    response = CASES[name]
    times: list[float] = []
    ratios: list[float] = []
    for seed in range(SEEDS):
        found = find_impacts(*sampled(response, rate, noise, seed))
        near = nearest(found, response)
        strong = (np.abs(response.impact_rates[near]) > 0.3) & ~found.landing
        strong &= np.isfinite(found.restitution)
        times += ((found.time - response.impact_times[near]) / found.time_error)[strong].tolist()
        ratios += ((found.restitution - B6L.housner_restitution) / found.restitution_error)[strong].tolist()
    assert len(times) >= 60
    # In units of their own standard errors: centred on 0, of about one deviation.
    for pulls in (np.array(times), np.array(ratios)):
        assert abs(np.mean(pulls)) < 4.0 / math.sqrt(pulls.size) + 0.05
        assert 0.7 < np.std(pulls) < 1.35
        assert np.mean(np.abs(pulls) > 3.0) < 0.04


@pytest.mark.parametrize("name", CASES)
def test_without_noise_it_is_exact(name: str) -> None:
    found = find_impacts(*sampled(CASES[name], 1000.0, 0.0))
    near = nearest(found, CASES[name])
    strong = (np.abs(CASES[name].impact_rates[near]) > 0.5) & ~found.landing
    assert np.count_nonzero(strong) > 8
    np.testing.assert_allclose(found.time[strong], CASES[name].impact_times[near][strong], atol=1e-6)
    np.testing.assert_allclose(found.rate_before[strong], CASES[name].impact_rates[near][strong], rtol=1e-3)
    np.testing.assert_allclose(found.restitution[strong], B6L.housner_restitution, atol=1e-3)


def test_a_gap_hides_an_impact_and_says_so() -> None:
    time, rotation = sampled(FREE, 1000.0, 1e-4)
    first, second, third = FREE.impact_times[:3]
    # Out of a long flight an impact is missing, with as much of the flights beside it as can still be bridged.
    short = (time > first - 0.03) & (time < first + 0.03)
    found = find_impacts(time[~short], rotation[~short])
    assert abs(found.time[0] - first) < 1e-3
    assert len(found.hidden) == 0
    # Over several flights nobody knows how many there were.
    long = (time > second - 0.1) & (time < third + 0.2)
    found = find_impacts(time[~long], rotation[~long])
    assert np.min(np.abs(found.time - second)) > 0.05
    assert np.min(np.abs(found.time - third)) > 0.05
    np.testing.assert_allclose(found.hidden, [[second - 0.1, third + 0.2]], atol=2e-3)


def test_a_cycle_missed_at_rest_hides_nothing() -> None:
    time, rotation = sampled(SINE, 1000.0, 1e-4)
    resting = np.ones(time.size, dtype=bool)
    resting[[20, 4000, 4001, 5000]] = False
    assert len(find_impacts(time[resting], rotation[resting]).hidden) == 0
    # A second without samples is another matter, even at rest.
    resting[4500:5500] = False
    assert len(find_impacts(time[resting], rotation[resting]).hidden) == 1


def test_a_wild_sample_is_no_impact() -> None:
    time, rotation = sampled(FREE, 1000.0, 1e-4)
    calm = find_impacts(time, rotation)
    for at in (0.1, 0.4, 0.8, 3.0):
        rotation[int(at * 1000)] *= -3.0
    found = find_impacts(time, rotation)
    assert len(found) == len(calm)
    # Inside a half flight it still pulls the fit; the error says so.
    assert np.all(np.abs(found.time - calm.time) < 5.0 * np.hypot(found.time_error, calm.time_error))


def test_an_offset_is_taken_out() -> None:
    time, rotation = sampled(SINE, 1000.0, 1e-4)
    offset = rest_offset(rotation + 0.003, noise_level(time, rotation))
    assert offset == pytest.approx(0.003, abs=1e-5)
    shifted = find_impacts(time, rotation + 0.003, offset=offset)
    np.testing.assert_allclose(shifted.time, find_impacts(time, rotation).time, atol=2e-3)


def test_a_tilted_or_fallen_block_has_no_offset() -> None:
    still = 1e-4 * np.random.default_rng(0).standard_normal(500)
    assert rest_offset(still + 0.1, 1e-4) is None
    assert rest_offset(np.concatenate((still + 0.1, np.linspace(0.1, 1.5, 100), still + 1.57)), 1e-4) is None


def test_the_last_impact_before_rest_is_a_landing() -> None:
    # A block that loses all: it lands once, and stays.
    response = simulate(B6L, initial_rotation=0.1, restitution=0.0)
    found = find_impacts(*sampled(response, 500.0, 1e-4))
    assert found.landing.tolist() == [True]
    assert found.time[0] == pytest.approx(response.impact_times[0], abs=2e-3)
    assert found.rate_before[0] == pytest.approx(response.impact_rates[0], rel=0.05)
    assert math.isnan(found.restitution[0])


def test_it_ends_where_the_block_lies() -> None:
    response = simulate(B6L, SineWave(4.5, 3.0))
    assert response.overturning_time is not None
    time = np.arange(0.0, 3.0, 1e-3)
    found = find_impacts(time, response.rotation(time))
    assert found.time.size == np.count_nonzero(response.impact_times < response.overturning_time)


@pytest.mark.parametrize("values", [[], [0.1], [0.0] * 50, [math.nan] * 20, [0.2] * 30])
def test_nothing_to_find_is_nothing(values: list[float]) -> None:
    found = find_impacts(np.arange(len(values)) * 1e-3, np.array(values))
    assert len(found) == 0
    assert found.hidden.shape == (0, 2)


def test_misuse_is_refused() -> None:
    with pytest.raises(ValueError, match="must be finite and increase"):
        find_impacts(np.array([0.0, 0.2, 0.1]), np.zeros(3))
    with pytest.raises(ValueError, match="must be equal rows"):
        find_impacts(np.zeros(3), np.zeros(4))


@example(values=[1.25, -1.0, -1.0, 1.0, 1.5, 0.0], seed=0)
@given(st.lists(st.floats(-2.0, 2.0), max_size=60), st.integers(0, 2**32 - 1))
def test_whatever_comes_the_answer_is_in_order_and_inside(values: list[float], seed: int) -> None:
    time = np.cumsum(np.random.default_rng(seed).uniform(1e-3, 0.1, len(values)))
    found = find_impacts(time, np.array(values))
    assert np.all(np.isfinite(found.time))
    assert np.all((found.time >= time[0]) & (found.time <= time[-1])) if len(found) else True


def test_noise_is_estimated_from_the_samples_alone() -> None:
    for noise in (1e-5, 1e-4, 1e-3):
        assert noise_level(*sampled(FREE, 1000.0, noise)) == pytest.approx(noise, rel=0.1)
    time, rotation = sampled(FREE, 1000.0, 0.0)
    rounded = np.round(rotation / 1e-4) * 1e-4
    # At rest a rounded signal does not change at all: its step is its noise.
    assert noise_level(time[3000:], rounded[3000:]) == pytest.approx(1e-4 / math.sqrt(12.0), rel=1e-6)


def test_median_of_three_is_numpys() -> None:
    values = np.random.default_rng(1).standard_normal(200)
    windows = np.lib.stride_tricks.sliding_window_view(values, 3)
    np.testing.assert_array_equal(median_of_three(values)[1:-1], np.median(windows, axis=1))
