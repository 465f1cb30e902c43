"""Blocks found again from their free rocking; refusals; what speaks against rocking."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.facts import B6L
from tests.twin.calibration.rockings import Rocking, rocking
from twin.calibration.calibrate import FREQUENCY, RESTITUTION, SLENDERNESS, TILT, ZERO, Calibration, K, calibrate
from twin.calibration.entry import HELD, LET_GO
from twin.calibration.entry import ROCKING as ALREADY
from twin.calibration.suspicion import BOUNCING, NOT_FREE, SLIDING, UNEVEN
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking.restitution import Improved

TRUTH = {SLENDERNESS: B6L.slenderness, FREQUENCY: B6L.frequency_parameter, RESTITUTION: 0.92, TILT: 0.15}


def found(recording: Rocking, **options: object) -> Calibration:
    return calibrate(recording.time, recording.rotation, **options)  # type: ignore[arg-type]


def near(calibration: Calibration, truth: dict[str, float], deviations: float = 4.0) -> None:
    for name, value in truth.items():
        estimate = calibration.estimates[name]
        assert abs(estimate.value - value) <= deviations * estimate.error, (name, value, estimate)


@pytest.mark.parametrize("tilt", [0.15, -0.15])
@pytest.mark.parametrize(("rate", "noise"), [(100.0, 1e-4), (250.0, 2e-3), (1000.0, 5e-4)])
def test_a_known_block_is_found_again(tilt: float, rate: float, noise: float) -> None:
    calibration = found(rocking(B6L, tilt, 0.92, rate=rate, noise=noise, held=0.3, zero=3e-3))
    near(calibration, {**TRUTH, TILT: tilt, ZERO: 3e-3})
    assert calibration.fit.how == HELD
    assert not calibration.suspicions
    assert calibration.estimates[RESTITUTION].error < 0.02


def test_without_noise_it_is_exact() -> None:
    calibration = found(rocking(B6L, 0.15, 0.92, noise=0.0))
    for name, value in TRUTH.items():
        assert calibration.estimates[name].value == pytest.approx(value, rel=1e-6), name


def test_k_of_the_improved_formula() -> None:
    eta = Improved(0.6).ratio(B6L)
    near(found(rocking(B6L, 0.17, eta)), {K: 0.6, RESTITUTION: eta})


def test_scatter_widens_the_interval_and_is_said() -> None:
    ratios = (0.92 + 0.01 * np.random.default_rng(3).standard_normal(14)).tolist()
    scattered, alike = (
        found(rocking(B6L, 0.2, ratios, noise=1e-4)),
        found(rocking(B6L, 0.2, 0.92, noise=1e-4, impacts=14)),
    )
    assert 0.005 < scattered.overall.scatter < 0.02
    assert scattered.estimates[RESTITUTION].error > 10.0 * alike.estimates[RESTITUTION].error
    near(scattered, {RESTITUTION: 0.92})
    near(alike, {RESTITUTION: 0.92})


def test_a_trend_with_speed_is_said() -> None:
    ratios = [0.90 + 0.003 * n for n in range(12)]
    trend = found(rocking(B6L, 0.2, ratios, noise=1e-4)).overall
    assert trend.trend < -3.0 * trend.trend_error


def test_a_recording_that_begins_while_the_block_rocks() -> None:
    recording = rocking(B6L, 0.15, 0.92, begin=0.1)
    calibration = found(recording)
    near(calibration, {**TRUTH})
    assert calibration.fit.how == LET_GO
    # Beginning in the flight before: as it went up so it comes down.
    late = recording.time > recording.impacts[0] + 0.05
    calibration = found(Rocking(recording.time[late], recording.rotation[late], recording.impacts))
    assert calibration.fit.how == ALREADY
    peak = -float(np.max(-recording.rotation[late]))
    assert calibration.estimates[TILT].value == pytest.approx(peak, abs=1e-3)


def test_lifted_by_hand_held_and_let_go() -> None:
    recording = rocking(B6L, 0.15, 0.92, held=0.5)
    rng = np.random.default_rng(1)
    before = np.arange(-1.5, -0.5, 2e-3)
    lift = 0.15 * np.clip((before + 1.1) / 0.4, 0.0, 1.0) ** 2 + 2e-4 * rng.standard_normal(before.size)
    time, rotation = np.concatenate([before, recording.time]), np.concatenate([lift, recording.rotation])
    calibration = calibrate(time, rotation)
    near(calibration, TRUTH)
    assert calibration.fit.how == HELD
    assert not calibration.suspicions


@pytest.mark.parametrize("part", [0.96, 0.98, 0.99])
def test_let_go_just_before_it_would_fall(part: float) -> None:
    tilt = part * B6L.slenderness
    calibration = found(rocking(B6L, tilt, 0.92, noise=5e-4, held=0.3))
    near(calibration, {**TRUTH, TILT: tilt})
    assert calibration.fit.how == HELD


def test_gaps_with_and_without_impacts_in_them() -> None:
    recording = rocking(B6L, 0.15, 0.92, held=0.2)
    kept = np.ones(recording.time.size, dtype=bool)
    for middle, length in ((0.1, 0.05), (recording.impacts[1], 0.2), (recording.impacts[5] + 0.05, 0.04)):
        kept &= np.abs(recording.time - middle) > 0.5 * length
    kept &= np.random.default_rng(2).random(kept.size) > 0.02
    calibration = calibrate(recording.time[kept], recording.rotation[kept])
    near(calibration, TRUTH)
    assert calibration.restitution.ratio.size >= 9
    assert any("gaps" in words for words in calibration.fit.repairs)


def test_wild_samples_are_left_out() -> None:
    recording = rocking(B6L, 0.15, 0.92)
    recording.rotation[[100, 333, 700, 701]] += [0.05, -0.2, 0.3, 0.3]
    calibration = found(recording)
    near(calibration, TRUTH)
    assert calibration.fit.repairs == ("4 wild samples left out",)
    assert not calibration.suspicions


def test_correlated_noise_widens_the_intervals() -> None:
    recording = rocking(B6L, 0.15, 0.92, noise=0.0, impacts=14)
    white = np.random.default_rng(4).standard_normal(recording.time.size + 20)
    slow = 5e-4 * np.convolve(white, np.full(20, 1.0 / math.sqrt(20.0)), mode="same")[: recording.time.size]
    calibration = calibrate(recording.time, recording.rotation + slow)
    assert calibration.fit.inflation > 4.0
    near(calibration, TRUTH)


def test_small_rotations_do_not_tell_slenderness_from_frequency() -> None:
    recording = rocking(B6L, 0.02, 0.92, noise=1e-4, impacts=8)
    free = found(recording)
    assert free.correlation < -0.99
    assert free.estimates[SLENDERNESS].error > 0.02 * B6L.slenderness
    fixed = found(recording, nominal=B6L, fixed=frozenset({SLENDERNESS}))
    assert fixed.estimates[SLENDERNESS].value == pytest.approx(B6L.slenderness)
    assert fixed.estimates[SLENDERNESS].error == 0.0
    assert fixed.estimates[FREQUENCY].error < 0.2 * free.estimates[FREQUENCY].error
    near(fixed, {FREQUENCY: B6L.frequency_parameter, RESTITUTION: 0.92})
    known = found(recording, nominal=B6L, spread=0.01)
    assert known.estimates[SLENDERNESS].error < 0.0101 * B6L.slenderness
    near(known, {FREQUENCY: B6L.frequency_parameter, SLENDERNESS: B6L.slenderness})


def test_both_fixed_leave_the_restitution() -> None:
    fixed = found(rocking(B6L, 0.1, 0.92), nominal=B6L, fixed=frozenset({SLENDERNESS, "frequency"}))
    assert math.isnan(fixed.correlation)
    near(fixed, {RESTITUTION: 0.92, TILT: 0.1})


def test_a_wrong_nominal_block_does_not_mislead() -> None:
    near(found(rocking(B6L, 0.15, 0.92), nominal=Block(0.3, 0.6)), TRUTH)


def test_bouncing_is_said() -> None:
    bounced = rocking(B6L, 0.15, 0.92, flip=lambda n: 1.0 if n == 3 else -1.0)
    calibration = found(bounced)
    assert BOUNCING in {item.kind for item in calibration.suspicions}
    near(calibration, {RESTITUTION: 0.92})


def test_a_zero_that_drifts_or_jumps_is_said() -> None:
    drifting = rocking(B6L, 0.15, 0.92)
    drifting.rotation[:] += 3e-3 * drifting.time
    assert SLIDING in {item.kind for item in found(drifting).suspicions}
    resting = rocking(B6L, 0.15, 0.8, impacts=26)
    rng = np.random.default_rng(5)
    time = resting.time[-1] + np.arange(1, 300) / 500.0
    rotation = np.concatenate([resting.rotation, 4e-3 + 2e-4 * rng.standard_normal(time.size)])
    moved = calibrate(np.concatenate([resting.time, time]), rotation)
    assert SLIDING in {item.kind for item in moved.suspicions}


def test_uneven_sides_are_said() -> None:
    kinds = {item.kind for item in found(rocking(B6L, 0.15, 0.92, uneven=0.02)).suspicions}
    assert UNEVEN in kinds


def test_motion_in_three_dimensions_is_said() -> None:
    recording = rocking(B6L, 0.15, 0.92)
    rolling = 4e-3 * np.sin(2.0 * np.pi * 9.0 * recording.time)
    kinds = {item.kind for item in calibrate(recording.time, recording.rotation + rolling).suspicions}
    assert NOT_FREE in kinds


@pytest.mark.parametrize(
    ("rotation", "sentence"),
    [
        (np.zeros(5), "5 samples"),
        (np.zeros(500), "no whole flight"),
        (np.full(500, np.nan), "0 samples"),
        (np.linspace(0.2, 1.0, 500) ** 2, "no whole flight"),
        (np.linspace(0.0, 1.6, 500), "falls before it has rocked"),
    ],
)
def test_what_cannot_be_calibrated_is_refused_in_a_sentence(rotation: np.ndarray, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence) as refusal:
        calibrate(np.arange(rotation.size) * 1e-3, rotation)
    assert "\n" not in str(refusal.value)


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["walk", "noise", "sines", "steps"]), st.integers(0, 400))
def test_whatever_the_numbers_are_it_answers_or_refuses(seed: int, kind: str, size: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.choice([1e-3, 2e-3, 0.1], size, p=[0.9, 0.09, 0.01]))
    noise = rng.standard_normal(size)
    rotation = {
        "walk": 0.01 * np.cumsum(noise),
        "noise": 0.1 * noise,
        "sines": 0.2 * np.sin(20.0 * time) * np.exp(-time) + 1e-3 * noise,
        "steps": 0.1 * np.sign(np.sin(30.0 * time)),
    }[kind]
    rotation = np.where(rng.random(size) < 0.02, np.nan, rotation)
    try:
        calibration = calibrate(time, rotation)
    except InputError:
        return
    assert all(math.isfinite(estimate.value) for estimate in calibration.estimates.values())
