"""Numerics tested by theory: energy, symmetry, an independent integrator, the sample-by-sample solver."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import CosineWave, SineWave
from tests.facts import B6L, LIMIT, P, scipy_reference, sine
from twin import Block, Outcome, simulate
from twin.rocking.track import TrackedBlock

blocks = st.builds(Block, width=st.floats(0.03, 0.3), height=st.floats(0.2, 1.0))
amplitudes = st.floats(0.2, 6.0)
frequencies = st.floats(0.3, 8.0)


def wave(block: Block, amplitude: float, frequency: float, *, cosine: bool = False) -> SineWave | CosineWave:
    kind = CosineWave if cosine else SineWave
    return kind(amplitude * block.uplift_acceleration, frequency * block.frequency_parameter / (2 * math.pi))


@given(st.floats(0.01, 0.99), st.floats(0.3, 0.99), blocks)
@settings(max_examples=40, deadline=None)
def test_energy_is_kept_between_impacts_and_scaled_by_eta_squared_at_one(
    fraction: float, eta: float, block: Block
) -> None:
    alpha, p = block.slenderness, block.frequency_parameter
    start = fraction * alpha
    response = simulate(block, initial_rotation=start, restitution=eta)
    n = np.arange(response.impact_rates.size)
    # Rate at the base from the height fallen: (theta'/p)^2 = 2 (cos(alpha - theta0) - cos(alpha)).
    first = p * math.sqrt(max(0.0, 4.0 * math.sin(alpha - start / 2) * math.sin(start / 2)))
    assert np.abs(response.impact_rates) == pytest.approx(first * eta**n, rel=1e-9)
    assert response.rest_time is not None
    assert np.all(np.diff(response.impact_times) > 0.0)
    assert response.rest_time >= response.impact_times[-1]


@given(amplitudes, frequencies, st.booleans(), blocks)
@settings(max_examples=40, deadline=None)
def test_mirror(amplitude: float, frequency: float, cosine: bool, block: Block) -> None:
    one = simulate(block, wave(block, amplitude, frequency, cosine=cosine))
    other = simulate(block, wave(block, -amplitude, frequency, cosine=cosine))
    assert one.outcome is other.outcome
    assert np.array_equal(one.impact_times, other.impact_times)
    assert np.array_equal(one.impact_rates, -other.impact_rates)
    t = np.linspace(0.0, min(one.end_time, 3.0), 50)
    assert np.array_equal(one.rotation(t), -np.asarray(other.rotation(t)))


@given(amplitudes, frequencies, st.booleans(), st.floats(0.3, 1.0), blocks)
@settings(max_examples=25, deadline=None)
def test_against_an_independent_integrator(
    amplitude: float, frequency: float, cosine: bool, eta: float, block: Block
) -> None:
    pulse = wave(block, amplitude, frequency, cosine=cosine)
    response = simulate(block, pulse, restitution=eta)
    if response.uplift_time is None or response.outcome is Outcome.UNDECIDED:
        assert abs(amplitude) <= 1.0 + 1e-12 or response.outcome is Outcome.UNDECIDED
        return
    # Start the reference just after the uplift, from this solution: what follows is independent.
    if response.outcome is Outcome.OVERTURNED and response.overturning_time is not None:
        end = response.overturning_time
    else:
        end = min(pulse.duration + 1.0, response.rest_time or math.inf)
    start = response.uplift_time + 0.02 / block.frequency_parameter
    if any(t <= start for t in response.impact_times) or end <= start:
        return
    shifted = _Shifted(pulse, start)
    state = (float(response.rotation(start)), float(response.angular_velocity(start)))
    # The reference does not follow impacts that come faster than its grid: compare up to the first weak one.
    weak = np.nonzero(eta * np.abs(response.impact_rates) < 0.02 * block.frequency_parameter)[0]
    count = int(weak[0]) if weak.size else len(response.impact_times)
    last = 0.5 * (response.impact_times[count - 1] + response.impact_times[count]) if weak.size and count else end
    if weak.size and not count:
        return
    stop = min(last, end)
    impacts, rotation = scipy_reference(block, eta, shifted, state, stop - start)  # pyright: ignore[reportArgumentType]
    growth = 1.0 + math.exp(min(block.frequency_parameter * (stop - start), 12.0))
    expected = [t for t in response.impact_times if t <= stop]
    assert len(impacts) == len(expected)
    assert np.array(impacts) + start == pytest.approx(np.array(expected), abs=1e-10 * growth)
    assert rotation == pytest.approx(response.rotation(stop), abs=1e-10 * growth)


class _Shifted:
    """A pulse seen from a later start."""

    def __init__(self, pulse: SineWave | CosineWave, start: float) -> None:
        self._pulse, self._start = pulse, start

    def acceleration(self, t: float) -> float:
        return float(self._pulse.acceleration(t + self._start))

    @property
    def breakpoints(self) -> np.ndarray:
        return np.asarray(self._pulse.breakpoints) - self._start


@given(amplitudes, frequencies)
@settings(max_examples=20, deadline=None)
def test_the_error_estimate_covers_a_finer_run(amplitude: float, frequency: float) -> None:
    coarse = simulate(B6L, sine(amplitude, frequency), tolerance=1e-6, duration=2.0)
    fine = simulate(B6L, sine(amplitude, frequency), tolerance=1e-10, duration=2.0)
    if coarse.outcome is Outcome.UNDECIDED or fine.outcome is Outcome.UNDECIDED:
        return
    assert coarse.outcome is fine.outcome
    t = np.linspace(0.0, 2.0, 200)
    assert coarse.rotation(t) == pytest.approx(fine.rotation(t), abs=1e-6)


@given(amplitudes, st.floats(0.5, 4.0), st.floats(-0.2, 0.2))
@settings(max_examples=15, deadline=None)
def test_sample_by_sample_is_the_same_run(amplitude: float, frequency: float, rotation: float) -> None:
    """Fed the same piecewise-linear acceleration, the tracked block and `simulate` agree."""
    from excitation import Record

    pulse = sine(amplitude, frequency)
    dt = 1e-3
    samples = np.asarray(pulse.acceleration(np.arange(0.0, pulse.duration + dt, dt)))
    record = Record(samples, dt)
    whole = simulate(B6L, record, initial_rotation=rotation, duration=record.duration)
    if whole.rotation_error > 1e-10:
        return
    tracked = TrackedBlock(B6L, initial_rotation=rotation)
    impacts = []
    for before, after in itertools.pairwise(samples.tolist()):
        tracked.advance(dt, before, after)
        impacts += [event.time for event in tracked.events if event.name == "impact"]
    if not tracked.overturned:
        assert tracked.rotation == pytest.approx(whole.rotation(record.duration), abs=1e-9)
    first = min(len(impacts), 3)
    assert impacts[:first] == pytest.approx(whole.impact_times[:first], abs=1e-8)


def test_a_million_impacts() -> None:
    """Every flight takes time, none takes for ever, and the rate never grows."""
    tracked = TrackedBlock(B6L, restitution=0.9999999, initial_rotation=1e-4)
    impacts = 0
    latest, rate = 0.0, math.inf
    while impacts < 1_000_000:
        tracked.advance(20.0, 0.0, 0.0)
        assert tracked.events
        for time, name, speed in tracked.events:
            assert name == "impact"
            assert 0.0 < time - latest < math.inf
            assert abs(speed) < rate * (1.0 + 1e-13)
            latest, rate = time, abs(speed)
        impacts += len(tracked.events)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"restitution": 1.01}, "restitution"),
        ({"restitution": math.nan}, "restitution"),
        ({"initial_rotation": 1.6}, "initial rotation"),
        ({"initial_rotation": math.nan}, "initial rotation"),
        ({"initial_angular_velocity": math.inf}, "angular velocity"),
        ({"duration": 0.0}, "duration"),
        ({"duration": math.inf}, "duration"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, float], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        simulate(B6L, **arguments)


@pytest.mark.parametrize("size", [0.0, -1.0, math.nan, math.inf])
def test_a_block_has_a_size(size: float) -> None:
    with pytest.raises(ValueError, match="width"):
        Block(size, 0.27)
    with pytest.raises(ValueError, match="height"):
        Block(0.06, size)


def test_times_are_evaluated_alike_alone_and_together() -> None:
    response = simulate(B6L, sine(3, 3))
    t = np.linspace(0.0, 1.0, 101).reshape(-1, 1)
    together = np.asarray(response.rotation(t))
    assert together.shape == t.shape
    assert [response.rotation(float(x)) for x in t.ravel()] == list(together.ravel())
    assert response.rotation(5.0) == math.pi / 2
    assert response.angular_velocity(5.0) == 0.0
    with pytest.raises(ValueError, match="motion is known from"):
        response.rotation(-0.1)


def test_the_rate_is_the_slope_of_the_rotation() -> None:
    response = simulate(B6L, sine(1.25, 2))
    t = np.linspace(0.2, 1.0, 37)
    h = 1e-6
    slope = (np.asarray(response.rotation(t + h)) - np.asarray(response.rotation(t - h))) / (2 * h)
    assert response.angular_velocity(t) == pytest.approx(slope, abs=1e-5)


def test_a_duration_ends_the_run_and_a_longer_pulse() -> None:
    cut = simulate(B6L, sine(3, 3), duration=0.05)
    assert cut.end_time == 0.05
    with pytest.raises(ValueError, match="motion is known"):
        cut.rotation(0.2)
    # Over after 50 ms, the pulse has lifted the block, but not enough; over after 100 ms, it has.
    assert cut.outcome is Outcome.ROCKED
    longer = simulate(B6L, sine(3, 3), duration=0.1)
    assert longer.outcome is Outcome.OVERTURNED
    assert longer.overturning_time is None


def test_no_rest_without_loss() -> None:
    response = simulate(B6L, initial_rotation=0.1, restitution=1.0)
    assert response.outcome is Outcome.ROCKED
    assert response.rest_time is None
    assert math.isfinite(response.end_time)


def test_a_bulky_block_stops_at_its_first_impact() -> None:
    bulky = Block(1.0, 0.5)
    assert bulky.housner_restitution == 0.0
    response = simulate(bulky, initial_rotation=0.2)
    assert len(response.impact_times) == 1
    assert response.rest_time == response.impact_times[0]


def test_standing_still() -> None:
    response = simulate(B6L)
    assert response.outcome is Outcome.STAYED
    assert response.uplift_time is None
    assert response.rest_time is None
    assert response.peak_rotation == 0.0
    assert response.rotation([0.0, 1e6]) == pytest.approx([0.0, 0.0])
    assert LIMIT / P > 0.0
