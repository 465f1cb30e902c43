"""The forecast of every cycle: right with perfect knowledge, both branches, its age, its advice, its start."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import qmc

from excitation import ConstantPulse, CosineWave, Motion, Pulse, Record, SineWave
from tests.closed_loop import ClosedLoop
from tests.facts import B6L, LIMIT, P
from tests.twin.forecast.exact import Start, exact_fate, near_a_boundary
from tests.twin.forecast.specimen import DT, follow, slenderer
from twin.forecast.advice import FALLS, HOPELESS, SAFE, SEPARATE, advise
from twin.forecast.ensemble import DIMENSIONS, FUTURES, KNOWN, deviates, square_root
from twin.forecast.forecast import LONGEST_AGE, Forecaster
from twin.forecast.loop import TableLoop
from twin.forecast.observer import Observer, Uncertainty
from twin.forecast.ramp import RampDown
from twin.rocking.response import Outcome
from twin.rocking.run import Run, initial_state, parameters
from twin.rocking.state import PHI, RATE, SIDE
from twin.rocking.track import TrackedBlock
from twin.simulation import simulate

STOP = RampDown(0.5 * LIMIT, reaction=0.0)
ALPHA, ETA = B6L.slenderness, B6L.housner_restitution
NOTHING = np.zeros((4, 4))


class Known:
    """Stands for an observer that knows the state exactly, or with a stated covariance."""

    def __init__(self, time: float, start: Start, covariance: np.ndarray = NOTHING) -> None:
        self.time = time
        self.covariance = covariance
        self.corrected = True
        self.sample = np.zeros(3)
        self._known = np.array(start)

    def estimate(self) -> np.ndarray:
        assert self._known.shape == (KNOWN,)
        return self._known


def state_at(pulse: Pulse, time: float) -> Start:
    """Return the exact state at `time` of a block that stood still as the pulse began."""
    body = parameters(B6L, ETA)
    state = initial_state(body)
    run = Run(body, state, record=False)
    if time > 0.0:
        run.advance(pulse.pieces, time)
        if run.time < time:
            run.advance_free(time)
    return Start(float(state[SIDE]), float(state[PHI]), float(state[RATE]), ALPHA, ETA)


@pytest.mark.parametrize("seed", range(12))
def test_with_perfect_knowledge_it_is_the_simulation_from_the_start(seed: int) -> None:
    """At every instant of a random run: same outcome, same time of overturning, whatever has happened since."""
    rng = np.random.default_rng([7, seed])
    amplitude, hertz = LIMIT * rng.uniform(1.0, 2.5), P * rng.uniform(0.8, 3.0) / math.tau
    waves = (SineWave(amplitude, hertz), CosineWave(amplitude, hertz), SineWave(0.8 * amplitude, hertz, 3.0))
    pulse = (*waves, ConstantPulse(amplitude, rng.uniform(0.05, 0.3)))[seed % 4]
    response = simulate(B6L, pulse)
    falls = response.outcome is Outcome.OVERTURNED
    end = response.overturning_time if falls else pulse.duration + 0.5
    forecaster = Forecaster(B6L, pulse.pieces, STOP)
    for time in np.linspace(0.0, 0.99 * end, 25):
        forecast = forecaster.update(Known(time, state_at(pulse, time)))
        assert forecast.age == 0.0
        assert (forecast.going_on.outcome is Outcome.OVERTURNED) == falls
        assert forecast.going_on.outcome is not Outcome.UNDECIDED
        assert forecast.going_on.probability == float(falls)
        if falls:
            assert time + forecast.going_on.overturning == pytest.approx(response.overturning_time, abs=2e-3)
        else:
            assert math.isnan(forecast.going_on.overturning)


@pytest.mark.parametrize("seed", range(6))
def test_stopping_is_the_simulation_of_the_ramp(seed: int) -> None:
    """The other branch, from any instant: the plan until the ramp acts, then the ramp, by the exact solver."""
    rng = np.random.default_rng([8, seed])
    pulse = SineWave(LIMIT * rng.uniform(1.1, 2.2), P * rng.uniform(0.8, 2.0) / math.tau)
    stop = RampDown(0.5 * LIMIT, reaction=3e-3)
    forecaster = Forecaster(B6L, pulse.pieces, stop)
    checked = 0
    for time in np.linspace(0.0, 0.95 * pulse.duration, 16):
        start, act = state_at(pulse, time), time + stop.reaction
        speed = pulse.velocity(act)
        rows = [[*pulse.pieces[0]]]
        rows[0][1] = act
        rows.append([act, act + abs(speed) / stop.deceleration, -math.copysign(stop.deceleration, speed), 0, 0, 0, 0])
        exact = exact_fate(B6L, start, time, np.array(rows))
        if not near_a_boundary(B6L, start, time, np.array(rows)):
            stopping = forecaster.update(Known(time, start)).stopping
            assert (stopping.margin < 0.0) == (exact.margin < 0.0)
            assert stopping.margin == pytest.approx(exact.margin, abs=2e-3)
            checked += 1
    assert checked >= 14


def test_the_last_instant_to_stop() -> None:
    """Of a run that overturns: stopping saves it until some instant and never after; `no_return` says which."""
    pulse = ConstantPulse(2.0 * LIMIT, 0.12)
    motion = Motion(pulse, STOP.deceleration, brake=STOP.deceleration).shaking
    assert simulate(B6L, motion).outcome is Outcome.OVERTURNED
    forecaster = Forecaster(B6L, motion.pieces, STOP)
    passed = [forecaster.update(Known(t, state_at(motion, t))).no_return for t in np.arange(0.0, 0.3, 2e-3)]
    assert not passed[0]
    assert passed[-1]
    assert sorted(passed) == passed
    first = passed.index(True)
    assert 0.01 < 2e-3 * first < 0.12


def test_a_state_either_side_of_the_barrier() -> None:
    """On a still base: the margin is zero where the estimate is on the barrier, and half the futures go each way."""
    forecaster = Forecaster(B6L, np.zeros((0, 7)), STOP)
    barrier = 2.0 * math.sin(0.5 * (ALPHA - 0.1))
    sigma = 0.02
    unsure = np.diag([0.0, sigma**2, 0.0, 0.0])
    shares: list[float] = []
    for beyond in (-4.0, -1.0, 0.0, 1.0, 4.0):
        start = Start(1.0, 0.1, barrier + beyond * sigma, ALPHA, ETA)
        branch = forecaster.update(Known(0.0, start, unsure)).going_on
        shares.append(branch.probability)
        assert (branch.margin > 0.0) == (beyond < 0.0) or beyond == 0.0
        if beyond == 0.0:
            assert branch.outcome is Outcome.UNDECIDED
    normal = [0.5 * (1.0 + math.erf(x / math.sqrt(2.0))) for x in (-4.0, -1.0, 0.0, 1.0, 4.0)]
    assert shares == pytest.approx(normal, abs=2.0 / FUTURES)


def test_deviates_have_no_mean_and_unit_covariance() -> None:
    z = deviates(3)
    assert z.shape == (FUTURES, DIMENSIONS)
    assert not z[0].any()
    assert np.abs(z.mean(axis=0)).max() < 1e-12
    assert z.T @ z / FUTURES == pytest.approx(np.eye(DIMENSIONS), abs=1e-12)
    assert not np.array_equal(z, deviates(4))
    assert np.array_equal(z, deviates(3))


def test_deviates_lie_where_scipy_lays_them() -> None:
    shift = np.random.default_rng(3).random(DIMENSIONS)
    shares = (qmc.Sobol(DIMENSIONS, scramble=False).random(FUTURES) + shift) % 1.0
    # The deviates are these, turned and stretched a little: the order within a dimension stays that of the shares.
    plain = ndtri(shares)
    plain = plain[np.argsort(np.sum(plain * plain, axis=1), kind="stable")]
    assert np.corrcoef(deviates(3)[1:, 0], plain[1:, 0])[0, 1] > 0.999


def test_the_root_of_a_covariance_that_knows_some_of_it_exactly() -> None:
    rng = np.random.default_rng(1)
    a = rng.standard_normal((4, 4))
    a[1] = 0.0
    covariance, root = a @ a.T, np.zeros((4, 4))
    square_root(covariance, root)
    assert root @ root.T == pytest.approx(covariance, abs=1e-12)


@pytest.mark.parametrize(
    ("going_on", "stopping", "advice"),
    [
        (0.0, 0.0, "continue"),
        (SAFE, 0.0, "continue"),
        (FALLS, FALLS - SEPARATE, "stopping helps"),
        (1.0, 0.75, "stopping helps"),
        (1.0, HOPELESS, "too late"),
        (0.0, FALLS, "stopping would topple it"),
        (0.3, 0.2, "undecided"),
        (FALLS, FALLS, "undecided"),
    ],
)
def test_advice(going_on: float, stopping: float, advice: str) -> None:
    assert advise(going_on, stopping) == advice


def test_a_long_record_is_spread_and_says_how_old_it_is() -> None:
    """No cycle does more than its share; the age grows to at most 20 cycles; the whole record is looked at."""
    noise = np.convolve(np.random.default_rng(5).standard_normal(4096), np.hanning(11), "same")
    record = Record(noise / np.max(np.abs(noise)) * 1.3 * LIMIT, 0.01)
    forecaster = Forecaster(B6L, record.pieces, STOP, loop=TableLoop(frequency=31.9, damping=0.78))
    observer = Observer(B6L)
    ages: list[float | None] = []
    for k in range(60):
        observer.update(k * DT, 0.0, 0.0)
        forecast = forecaster.update(observer)
        ages.append(None if forecast is None else forecast.age)
    assert ages[0] is None
    known = [age for age in ages if age is not None]
    assert len(known) >= 40
    assert max(known) <= 2.0 * LONGEST_AGE * DT
    assert forecast.seen == pytest.approx(record.duration, abs=0.1)
    assert forecast.going_on.outcome is simulate(B6L, record).outcome


def test_a_pulse_is_forecast_within_its_cycle() -> None:
    motion = Motion(SineWave(1.35 * LIMIT, 4.0), 1.0)
    forecaster = Forecaster(B6L, motion.pieces, STOP, loop=TableLoop(frequency=31.9, damping=0.78))
    for seen in follow(TrackedBlock(B6L), Observer(B6L), 0.2, noise=1e-4):
        forecast = forecaster.update(seen.observer)
        assert forecast.age == 0.0
        assert forecast.time == seen.time


def test_equal_calls_give_equal_forecasts() -> None:
    def run() -> list[object]:
        forecaster = Forecaster(B6L, SineWave(1.4 * LIMIT, 4.0).pieces, STOP)
        block = TrackedBlock(slenderer(B6L, 0.01), 0.9, math.radians(0.2))
        return [
            repr(forecaster.update(seen.observer))
            for seen in follow(block, Observer(B6L), 0.4, SineWave(1.4 * LIMIT, 4.0))
        ]

    assert run() == run()


def test_before_the_first_sample_there_is_none() -> None:
    assert Forecaster(B6L, np.zeros((0, 7)), STOP).update(Observer(B6L)) is None


def test_after_the_plan_the_rule_decides() -> None:
    """A block rocking long after the motion ended: no stepping, and the right time to the end of a fall."""
    pulse = SineWave(0.5 * LIMIT, 4.0)
    forecaster = Forecaster(B6L, pulse.pieces, STOP)
    falling = Start(-1.0, ALPHA + 0.01, 0.0, ALPHA, ETA)
    forecast = forecaster.update(Known(5.0, falling))
    exact = simulate(B6L, initial_rotation=-(ALPHA + 0.01))
    assert forecast.going_on.overturning == pytest.approx(exact.overturning_time, rel=1e-9)
    assert forecast.going_on.margin < 0.0
    # There is nothing to stop; the ramp's reaction is time all the same.
    slow = Forecaster(B6L, pulse.pieces, RampDown(0.5 * LIMIT, reaction=0.05)).update(Known(5.0, falling))
    assert slow.stopping.overturning == pytest.approx(exact.overturning_time, rel=1e-6)
    lying = Start(1.0, 0.5 * math.pi, 0.0, ALPHA, ETA)
    branch = forecaster.update(Known(5.0, lying)).going_on
    assert branch.outcome is Outcome.OVERTURNED
    assert branch.probability == 1.0
    assert branch.overturning == pytest.approx(0.0, abs=1e-9)


def test_once_ramping_down_going_on_is_the_ramp() -> None:
    pulse = SineWave(2.0 * LIMIT, 3.0)
    forecaster = Forecaster(B6L, pulse.pieces, STOP, loop=TableLoop(frequency=31.9, damping=0.78))
    time = 0.1
    stopping = forecaster.update(Known(time, state_at(pulse, time))).stopping
    forecaster.ramp_down(time)
    after = forecaster.update(Known(time, state_at(pulse, time)))
    assert after.going_on.margin == pytest.approx(stopping.margin, abs=1e-9)
    assert after.going_on.outcome is stopping.outcome


def test_the_plan_may_begin_at_any_time_of_the_clock() -> None:
    pulse = SineWave(1.6 * LIMIT, 3.0)
    early, late = Forecaster(B6L, pulse.pieces, STOP), Forecaster(B6L, pulse.pieces, STOP, begins=100.0)
    for t in (0.0, 0.05, 0.2, 0.5):
        one = early.update(Known(t, state_at(pulse, t)))
        other = late.update(Known(100.0 + t, state_at(pulse, t)))
        assert other.going_on.margin == pytest.approx(one.going_on.margin, abs=1e-6)
        assert other.seen == pytest.approx(one.seen + 100.0)


def test_without_readings_the_futures_go_on_by_themselves() -> None:
    """Blind from the start, a block that only rocks does not become uncertain without a bound, and rests in the end."""
    observer = Observer(B6L, initial_rotation=0.1)
    forecaster = Forecaster(B6L, np.zeros((0, 7)), STOP)
    for k in range(5000):
        observer.update(k * DT, 0.0)
        forecast = forecaster.update(observer)
        assert forecast.going_on.probability == 0.0
    _, rotations = forecaster.fan(observer, 0.5)
    assert np.abs(rotations).max() < 1e-2


def test_a_fan_starts_at_the_estimate_and_follows_the_exact_motion() -> None:
    pulse = SineWave(1.35 * LIMIT, 4.0)
    exact = simulate(B6L, pulse)
    forecaster = Forecaster(B6L, pulse.pieces, STOP)
    known = Known(0.1, state_at(pulse, 0.1), np.diag([1e-3, 1e-2, 1e-3, 1e-2]) ** 2)
    forecast = forecaster.update(known)
    times, rotations = forecaster.fan(known, 1.0)
    assert rotations.shape == (FUTURES, len(times))
    assert times[0] > 0.1
    assert times[-1] >= 1.1
    assert np.diff(times).max() <= 0.3 / P + 1e-9
    assert rotations[0] == pytest.approx(exact.rotation(times), abs=2e-5)
    assert np.ptp(rotations, axis=0).max() > 1e-2
    # Only a picture: the next forecast does not know of it.
    assert repr(forecaster.update(known)) == repr(forecast)


def test_the_table_s_loop_makes_the_difference() -> None:
    """A blow that the table rounds off: with the loop the forecast stays the same through the blow."""
    pulse = ConstantPulse(4.0 * LIMIT, 0.035)
    motion = Motion(pulse, STOP.deceleration, brake=STOP.deceleration).shaking
    loop = TableLoop(frequency=31.9, damping=0.78)
    margins: dict[str, list[float]] = {"loop": [], "delay": []}
    forecasters = {
        "loop": Forecaster(B6L, motion.pieces, STOP, loop=loop),
        "delay": Forecaster(B6L, motion.pieces, STOP, loop=TableLoop(delay=loop.total_delay)),
    }
    observer = Observer(B6L, uncertainty=Uncertainty(initial_tilt=0.0))
    table = ClosedLoop(loop.angular_frequency, loop.damping, DT, 0.0)
    for k in range(60):
        if k:
            table.advance(motion.displacement(k * DT))
        observer.update(k * DT, table.acceleration)
        for name, forecaster in forecasters.items():
            margins[name].append(forecaster.update(observer).going_on.margin)
    assert np.ptp(margins["loop"]) < 0.01
    assert np.ptp(margins["loop"]) < 0.1 * np.ptp(margins["delay"])
