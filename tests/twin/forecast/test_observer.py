"""The state that follows the specimen: it converges, keeps floor and jump, learns, and is not led astray."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import SineWave
from tests.facts import B6L, LIMIT
from tests.twin.forecast.specimen import DT, follow, slenderer
from twin.forecast.observer import Observer, Uncertainty
from twin.rocking.track import TrackedBlock

ETA = B6L.housner_restitution
SINE = SineWave(1.35 * LIMIT, 4.0)
EXACT = Uncertainty(acceleration_noise=0.0, acceleration_drift=0.01, restitution_scatter=0.0)


def swinging(eta: float = ETA, tilt: float = 0.15) -> TrackedBlock:
    return TrackedBlock(B6L, eta, tilt)


@given(seed=st.integers(0, 1000), tilt=st.sampled_from([0.0, 0.15, -0.1, 0.01]))
@settings(max_examples=10)
def test_without_readings_it_is_the_free_prediction_bit_for_bit(seed: int, tilt: float) -> None:
    rng = np.random.default_rng(seed)
    observer, free = Observer(B6L, initial_rotation=tilt), TrackedBlock(B6L, None, tilt)
    pulse = SineWave(LIMIT * rng.uniform(1.0, 2.5), rng.uniform(2.0, 5.0))
    time = before = 0.0
    observer.update(0.0, 0.0)
    for _ in range(800):
        step = DT if rng.random() < 0.98 else 7.0 * DT
        acceleration = float(pulse.acceleration(time + step)) + 0.05 * rng.standard_normal()
        free.advance(time + step - time, before, acceleration)
        time, before = time + step, acceleration
        assert observer.update(time, acceleration, math.nan) == free.rotation
        assert observer.angular_velocity == free.angular_velocity
    assert observer.restitution == ETA
    assert observer.slenderness == B6L.slenderness


def test_equal_calls_give_equal_bits() -> None:
    runs = [
        [seen.observer.rotation for seen in follow(swinging(0.9), Observer(B6L, initial_rotation=0.15), 1.0)]
        for _ in range(2)
    ]
    assert runs[0] == runs[1]


@pytest.mark.parametrize("wrong", [-0.004, -0.002, 0.002, 0.004])
def test_a_wrong_initial_tilt_is_found(wrong: float) -> None:
    """From up to 0.25 degrees off to the noise's tenth in a tenth of a second, and closer than without readings."""
    observer = Observer(B6L, initial_rotation=0.15 + wrong, uncertainty=Uncertainty(initial_tilt=0.003))
    free = TrackedBlock(B6L, None, 0.15 + wrong)
    errors: list[float] = []
    for seen in follow(swinging(), observer, 1.0):
        if seen.time > 0.0:
            free.advance(DT, 0.0, 0.0)
        if seen.time > 0.1:
            errors.append(seen.observer.rotation - seen.block.rotation)
    assert np.sqrt(np.mean(np.square(errors))) < 4e-4
    assert abs(free.rotation - seen.block.rotation) > 5.0 * abs(errors[-1])


def test_an_unseen_lean_is_noticed() -> None:
    """0.2 degrees where the twin expects none, under 1 mrad of noise."""
    observer = Observer(B6L)
    lean = swinging(tilt=math.radians(0.2))
    time = next(seen.time for seen in follow(lean, observer, 0.03) if not observer.resting)
    assert 0.005 <= time <= 0.02
    assert observer.rotation == pytest.approx(lean.rotation, abs=1.5e-3)


def test_its_deviations_are_honest() -> None:
    """The error over its stated deviation, many runs and instants: mean square near 1, for rotation and rate."""
    squares: list[tuple[float, float]] = []
    for seed in range(12):
        rng = np.random.default_rng(seed)
        eta = ETA + 0.01 * rng.standard_normal()
        block = slenderer(B6L, 0.005 * rng.standard_normal())
        tilt = 0.12 + 0.002 * rng.standard_normal()
        unsure = Uncertainty(initial_tilt=0.002, restitution_scatter=0.0)
        observer = Observer(B6L, initial_rotation=0.12, uncertainty=unsure)
        run = follow(TrackedBlock(block, eta, tilt), observer, 1.2, acceleration_noise=0.05, seed=seed)
        for k, seen in enumerate(run):
            if k % 60 == 59:
                squares.append(
                    (
                        ((seen.observer.rotation - seen.block.rotation) / observer.rotation_deviation) ** 2,
                        (
                            (observer.angular_velocity - seen.block.angular_velocity)
                            / observer.angular_velocity_deviation
                        )
                        ** 2,
                    )
                )
    means = np.mean(squares, axis=0)
    # The drift it allows for is not there: it may be too careful, by no more than a factor.
    assert (means < 1.5).all()
    assert (means > 0.1).all()


def test_the_floor_is_never_crossed_between_impacts() -> None:
    """The estimate changes sides only by an impact: with the base's jump of the rate, and near the contact."""
    observer = Observer(B6L, initial_rotation=0.15)
    before, sides = (0.15, 0.0), 0
    for _ in follow(swinging(0.9), observer, 2.5, noise=2e-3):
        now = (observer.rotation, observer.angular_velocity)
        if before[0] * now[0] < 0.0:
            assert now[0] * now[1] > 0.0
            assert min(abs(before[0]), abs(now[0])) < 0.01
            sides += 1
        before = now
    assert sides >= 6
    assert observer.consistent


def test_noise_does_not_lift_a_block_at_rest() -> None:
    for seed in range(4):
        for seen in follow(TrackedBlock(B6L), Observer(B6L), 5.0, seed=seed):
            assert seen.observer.resting
            assert seen.observer.rotation == seen.observer.angular_velocity == 0.0
        assert seen.observer.consistent


def test_it_comes_to_rest_and_stays() -> None:
    observer = Observer(B6L, 0.8, 0.05, uncertainty=Uncertainty())
    rested = [seen.observer.resting for seen in follow(swinging(0.8, 0.05), observer, 3.0)]
    assert not any(rested[:500])
    assert all(rested[2000:])


def test_the_jump_of_an_impact_is_kept() -> None:
    """Within one sample of the specimen's impact the rate falls by the restitution; no smoothing before or after."""
    observer = Observer(B6L, initial_rotation=0.15, uncertainty=EXACT)
    rates = [
        (seen.observer.angular_velocity, seen.block.angular_velocity) for seen in follow(swinging(), observer, 0.3)
    ]
    estimated, true = np.array(rates).T
    drop = int(np.argmax(np.abs(np.diff(estimated))))
    assert abs(drop - int(np.argmax(np.abs(np.diff(true))))) <= 2
    assert estimated[drop + 1] / estimated[drop] == pytest.approx(ETA, abs=0.01)
    quiet = np.delete(np.abs(np.diff(estimated)), drop)
    assert quiet.max() < 0.03


def test_restitution_is_unbiased_and_its_deviation_honest() -> None:
    """Forty specimens drawn from the stated spread: the errors over their deviations have mean 0 and deviation 1."""
    rng = np.random.default_rng(11)
    normal: list[float] = []
    unsure = Uncertainty(
        restitution=0.02, restitution_scatter=0.0, slenderness=0.0, initial_tilt=0.0, acceleration_drift=0.0
    )
    for seed in range(40):
        eta = min(ETA + 0.02 * rng.standard_normal(), 1.0)
        observer = Observer(B6L, initial_rotation=0.15, uncertainty=unsure)
        for _ in follow(swinging(eta), observer, 1.3, acceleration_noise=0.05, seed=seed):
            pass
        assert observer.impacts >= 3
        assert observer.restitution_deviation < 0.5 * 0.02
        normal.append((observer.restitution - eta) / observer.restitution_deviation)
    assert abs(np.mean(normal)) < 3.0 / math.sqrt(40)
    assert 0.6 < np.std(normal) < 1.4


def test_slow_impacts_teach_nothing() -> None:
    observer = Observer(B6L, initial_rotation=0.002)
    for _ in follow(swinging(0.8, 0.002), observer, 0.5):
        pass
    assert observer.impacts == 0
    assert observer.restitution_deviation == pytest.approx(0.01, rel=0.05)


def test_slenderness_is_observed_where_the_block_swings_high() -> None:
    other = slenderer(B6L, 0.02)
    unsure = Uncertainty(slenderness=0.02, acceleration_drift=0.005, acceleration_noise=0.01, restitution_scatter=0.0)
    observer = Observer(B6L, initial_rotation=0.15, uncertainty=unsure)
    for _ in follow(TrackedBlock(other, ETA, 0.15), observer, 2.0):
        pass
    assert observer.slenderness_observed
    assert observer.slenderness == pytest.approx(other.slenderness, abs=3.0 * observer.slenderness_deviation)
    still = Observer(B6L)
    for _ in follow(TrackedBlock(B6L), still, 0.5):
        pass
    assert not still.slenderness_observed


@pytest.mark.parametrize("moment", [0.05, 0.2, 0.4, 0.6])
def test_a_frozen_sensor_does_not_drag_the_state(moment: float) -> None:
    """From `moment` on the reading stays what it is: the estimate goes on as without one, bit for bit, and says so."""
    held: list[float] = []

    def frozen(t: float, reading: float) -> float:
        if t < moment:
            return reading
        held.append(reading)
        return held[0]

    observer, blind = Observer(B6L, initial_rotation=0.15), Observer(B6L, initial_rotation=0.15)
    runs = zip(
        follow(swinging(), observer, 0.9, sensor=frozen),
        follow(swinging(), blind, 0.9, sensor=lambda t, reading: reading if t < moment + DT / 2 else math.nan),
        strict=True,
    )
    for one, other in runs:
        assert one.observer.rotation == other.observer.rotation
    assert not observer.consistent
    assert blind.consistent


@pytest.mark.parametrize("absurd", [0.6, -1.0, 3.0, math.inf])
def test_an_absurd_reading_is_not_believed(absurd: float) -> None:
    rng = np.random.default_rng(3)
    observer = Observer(B6L, initial_rotation=0.15)
    for seen in follow(
        swinging(), observer, 0.8, sensor=lambda t, reading: reading if t < 0.3 else absurd + rng.normal(0.0, 1e-3)
    ):
        assert abs(seen.observer.rotation - seen.block.rotation) < 0.02
    assert not observer.consistent
    assert not observer.corrected
    assert abs(observer.normalised_innovation) > 5.0 or math.isnan(observer.normalised_innovation)


def test_a_single_outlier_costs_nothing() -> None:
    clean, hit = Observer(B6L, initial_rotation=0.15), Observer(B6L, initial_rotation=0.15)
    runs = zip(
        follow(swinging(), clean, 0.6),
        follow(swinging(), hit, 0.6, sensor=lambda t, reading: reading + (0.2 if abs(t - 0.4) < 1e-9 else 0.0)),
        strict=True,
    )
    assert max(abs(a.observer.rotation - b.observer.rotation) for a, b in runs) < 3e-4
    assert hit.consistent


def test_a_sensor_that_comes_back_is_believed_again() -> None:
    observer, block = Observer(B6L, initial_rotation=0.15), swinging(0.91)
    for _ in follow(block, observer, 1.0, sensor=lambda t, reading: math.nan if 0.3 < t < 0.5 else reading):
        pass
    assert observer.corrected
    assert abs(observer.rotation - block.rotation) < 1e-3


def test_it_follows_a_specimen_that_falls() -> None:
    """A specimen that overturns where the free prediction does not."""
    block = slenderer(B6L, -0.02)
    pulse = SineWave(1.45 * LIMIT, 4.0)
    free, observer = TrackedBlock(B6L), Observer(B6L)
    before = 0.0
    tracked = TrackedBlock(block, 1.0, math.radians(-0.2))
    for seen in follow(tracked, observer, 3.0, pulse):
        if seen.time > 0.0:
            free.advance(DT, before, seen.acceleration)
        before = seen.acceleration
        if not tracked.overturned:
            assert abs(observer.rotation - tracked.rotation) < 0.01
    assert tracked.overturned
    assert not free.overturned
    assert observer.overturned
    assert observer.angular_velocity == 0.0


def test_gaps_are_bridged() -> None:
    observer, tracked = Observer(B6L, initial_rotation=0.15), swinging()
    observer.update(0.0, 0.0, 0.15)
    time = 0.0
    for gap in (0.02, 0.1, 0.001, 0.3, 0.05):
        tracked.advance(gap, 0.0, 0.0)
        time += gap
        observer.update(time, 0.0, tracked.rotation)
    assert observer.rotation == pytest.approx(tracked.rotation, abs=1e-5)


def test_a_sample_that_is_not_later_is_left_out() -> None:
    observer = Observer(B6L, initial_rotation=0.15)
    observer.update(0.0, 0.0, 0.15)
    observer.update(0.001, 0.0, 0.15)
    rotation = observer.rotation
    assert observer.update(0.001, 5.0, 0.14) == rotation
    assert observer.update(0.0005, 5.0, 0.14) == rotation
    other = Observer(B6L, initial_rotation=0.15)
    for k in range(3):
        last = other.update(1e-3 * k, 0.0, 0.15)
    assert observer.update(0.002, 0.0, 0.15) == last


def test_the_innovation_is_the_reading_less_the_estimate_before_it() -> None:
    for tilt in (0.0, 0.15):
        observer, free = Observer(B6L, initial_rotation=tilt), TrackedBlock(B6L, None, tilt)
        observer.update(0.0, 0.0, tilt)
        assert math.isnan(observer.innovation)
        free.advance(DT, 0.0, 0.0)
        observer.update(DT, 0.0, tilt + 5e-4)
        assert observer.innovation == tilt + 5e-4 - free.rotation
        observer.update(2.0 * DT, 0.0)
        assert math.isnan(observer.innovation)


def test_bad_uncertainties_are_refused() -> None:
    with pytest.raises(ValueError, match="rotation_noise is 0 rad; it must be above 0 rad"):
        Uncertainty(rotation_noise=0.0)
