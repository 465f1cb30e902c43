"""What is free rocking of a recording in which the base moved."""

from __future__ import annotations

import numpy as np
import pytest

from tests.facts import B6L
from tests.twin.calibration.rockings import rocking
from twin.calibration.calibrate import RESTITUTION, calibrate
from twin.calibration.free_part import free_part
from twin.errors import InputError

G = 9.81


def noisy(acceleration: np.ndarray, seed: int = 0) -> np.ndarray:
    return acceleration + 0.02 + 0.05 * np.random.default_rng(seed).standard_normal(acceleration.size)


def test_a_still_base_leaves_all_of_it() -> None:
    recording = rocking(B6L, 0.15, 0.92)
    part = free_part(recording.time, recording.rotation, noisy(np.zeros(recording.time.size)), G)
    assert (part.begin, part.end, part.shaken) == (recording.time[0], recording.time[-1], False)
    unknown = np.full(recording.time.size, np.nan)
    assert not free_part(recording.time, recording.rotation, unknown, G).shaken


def test_what_follows_the_shaking_is_taken() -> None:
    recording = rocking(B6L, 0.15, 0.92, held=1.0)
    base = np.where(recording.time < 0.1, 2.0 * np.sin(30.0 * recording.time), 0.0)
    base += np.where(recording.time > 2.2, 0.5, 0.0)
    part = free_part(recording.time, recording.rotation, noisy(base), G)
    assert part.shaken
    assert part.begin == pytest.approx(0.15, abs=0.06)
    assert part.end == pytest.approx(2.15, abs=0.06)
    inside = (recording.time >= part.begin) & (recording.time <= part.end)
    eta = calibrate(recording.time[inside], recording.rotation[inside]).estimates[RESTITUTION]
    assert abs(eta.value - 0.92) < 4.0 * eta.error


def test_knocks_of_the_block_are_no_shaking() -> None:
    recording = rocking(B6L, 0.15, 0.92)
    knocks = np.zeros(recording.time.size)
    for impact in recording.impacts[:-1]:
        first = int(np.searchsorted(recording.time, impact))
        knocks[first : first + 2] = (1.0, -1.0)
    assert not free_part(recording.time, recording.rotation, noisy(knocks), G).shaken


def test_rocking_only_while_the_base_moves_is_refused() -> None:
    recording = rocking(B6L, 0.15, 0.92)
    with pytest.raises(InputError, match="the base moves until 2"):
        free_part(recording.time, recording.rotation, np.sin(20.0 * recording.time), G)
