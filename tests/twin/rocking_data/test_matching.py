"""Two runs aligned by their impacts, whatever is missing, and however their restitution differs."""

from __future__ import annotations

import numpy as np
import pytest

from excitation import SineWave
from tests.facts import B6L
from twin.rocking.response import Response
from twin.rocking_data.matching import Rocking, estimate_shift, match
from twin.simulation import simulate

CLOCK = np.arange(0.0, 5.0, 1e-3)
FREE = simulate(B6L, initial_rotation=0.15)


def rocking(response: Response, later: float = 0.0, keep: np.ndarray | None = None, count: int = 40) -> Rocking:
    chosen = np.arange(min(count, response.impact_times.size)) if keep is None else keep
    times, rates = response.impact_times[chosen], response.impact_rates[chosen]
    return Rocking(CLOCK + later, response.rotation(CLOCK), times + later, np.sign(rates).astype(int), np.abs(rates))


@pytest.mark.parametrize("later", [-3.21, 0.0, 0.0137, 12.34])
def test_the_shift_of_equal_runs_is_exact(later: float) -> None:
    found = estimate_shift(rocking(FREE), rocking(FREE, later))
    assert found.seconds == pytest.approx(later, abs=1e-9)
    assert found.likeness == pytest.approx(1.0, abs=1e-2)
    assert found.rival is None
    assert np.array_equal(found.matches.first, found.matches.second)


@pytest.mark.parametrize("seed", range(10))
def test_impacts_missing_and_impacts_too_many(seed: int) -> None:
    """A third of each run's impacts is missing, and the second has some that are none."""
    rng = np.random.default_rng(seed)
    keep_one, keep_two = (np.sort(rng.choice(30, 20, replace=False)) for _ in range(2))
    one, two = rocking(FREE, 0.0, keep_one), rocking(FREE, 7.7, keep_two)
    false = rng.uniform(7.7, 11.0, 3)
    order = np.argsort(np.concatenate((two.time, false)))
    two = two._replace(
        time=np.concatenate((two.time, false))[order],
        direction=np.concatenate((two.direction, rng.choice([-1, 1], 3)))[order],
        rate=np.concatenate((two.rate, rng.uniform(0.05, 1.0, 3)))[order],
    )
    found = estimate_shift(one, two)
    assert found.seconds == pytest.approx(7.7, abs=5e-3)
    true = {(i, int(np.searchsorted(two.time, FREE.impact_times[k] + 7.7 - 1e-9))) for i, k in enumerate(keep_one)}
    pairs = set(zip(found.matches.first.tolist(), found.matches.second.tolist(), strict=True))
    common = np.intersect1d(keep_one, keep_two).size
    # Tiny flights at the end may go wrong by a false impact; the fast ones do not.
    assert len(pairs & true) >= common - 3
    assert len(pairs - true) <= 3


def test_runs_that_drift_apart_are_followed() -> None:
    """Two percent of restitution: the twentieth impacts lie a whole flight apart, and are the twentieth still."""
    other = simulate(B6L, initial_rotation=0.15, restitution=0.98 * B6L.housner_restitution)
    found = estimate_shift(rocking(FREE), rocking(other, 12.34))
    assert found.seconds == pytest.approx(12.34, abs=0.02)
    assert np.array_equal(found.matches.first[:30], np.arange(30))
    assert np.array_equal(found.matches.second[:30], np.arange(30))


def test_a_periodic_motion_says_that_it_is_ambiguous() -> None:
    clock = np.arange(0.0, 25.0, 2e-3)
    time = np.arange(1, 100) * 0.125
    one = Rocking(clock, np.sin(8.0 * np.pi * clock), time, np.where(np.arange(99) % 2, 1, -1), np.ones(99))
    two = one._replace(clock=clock + 0.01, time=time + 0.01)
    found = estimate_shift(one, two)
    assert found.seconds == pytest.approx(0.01, abs=1e-9)
    assert found.rival == pytest.approx(0.26, abs=1e-6) or found.rival == pytest.approx(-0.24, abs=1e-6)


def test_unmatched_are_listed() -> None:
    one, two = rocking(FREE, 0.0, np.array([0, 1, 2, 3, 4])), rocking(FREE, 0.0, np.array([0, 2, 3, 5]))
    pairs = match(one, two, 0.0)
    assert pairs.first.tolist() == [0, 2, 3]
    assert pairs.second.tolist() == [0, 1, 2]
    assert pairs.only_first.tolist() == [1, 4]
    assert pairs.only_second.tolist() == [3]


def test_directions_never_mix() -> None:
    one = rocking(FREE, 0.0, np.array([0, 1, 2]))
    pairs = match(one, one._replace(direction=-one.direction), 0.0)
    assert pairs.first.size == 0


def test_without_impacts_there_is_no_shift() -> None:
    still = simulate(B6L, SineWave(1.0, 4.0))
    none = np.zeros(0)
    one = Rocking(CLOCK, still.rotation(CLOCK), none, none.astype(int), none)
    for first, second in ((one, one), (one, rocking(FREE)), (rocking(FREE), one)):
        found = estimate_shift(first, second)
        assert (found.seconds, found.likeness, found.rival) == (0.0, 0.0, None)
        assert found.matches.first.size == 0
