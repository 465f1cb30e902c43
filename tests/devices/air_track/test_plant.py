"""The emulated cart against an integrator, the plan's closed forms, and what an operator can do to it in mid run."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from devices.air_track.capacity import CAPACITY
from devices.air_track.plant import AirTrackPlant
from devices.air_track.settings import AirTrackMachine, AirTrackSettings
from devices.released_parameters import MeasuringParameters
from excitation import ConstantPulse, ReleasedRun, clip
from tests.devices.released_rate import Stretch, Trajectory, shape_of

H = 1e-3
PURE = MeasuringParameters(release_delay=0.0, encoder_step=0.0, accelerometer_noise=0.0, accelerometer_bias=0.0)
TRACK = CAPACITY.machine
assert isinstance(TRACK, AirTrackMachine)
BLOCK = 2.5692


def track(rebound: float = 0.0, shape: str = "half sine", **changes: object) -> AirTrackMachine:
    stop = TRACK.end_stop.model_copy(update={"rebound": rebound, "shape": shape})
    return TRACK.model_copy(update={"end_stop": stop, **changes})


def plant_of(machine: AirTrackMachine, asked: AirTrackSettings, parameters=PURE, seed=1, **arguments) -> AirTrackPlant:
    return AirTrackPlant(machine, asked, BLOCK, parameters, H, np.random.default_rng(seed), **arguments)


def set_for(pulse: ConstantPulse, coast: float, machine: AirTrackMachine = TRACK) -> AirTrackSettings:
    return machine.settings_for(pulse, CAPACITY, payload=BLOCK, coast=coast)


@pytest.mark.parametrize("shape", ["half sine", "rectangular", "triangular"])
@pytest.mark.parametrize(("a0", "ta", "coast", "rebound"), [(2.55, 0.12, 1.3, 0.0), (5.0, 0.15, 0.4, 0.5)])
def test_against_an_integrator(shape, a0, ta, coast, rebound) -> None:
    machine = track(rebound, shape)
    asked = set_for(ConstantPulse(a0, ta), coast, machine)
    moved, m, f = machine.cart + BLOCK, asked.mass, machine.friction
    stop, form = machine.end_stop, shape_of(shape)

    def bumper(v: float) -> Stretch:
        mean = -(1.0 + rebound) * v / stop.duration
        return Stretch(lambda t: mean * form(t / stop.duration), stop.duration)

    truth = Trajectory(
        [
            lambda _: Stretch(lambda _: (m * 9.81 - moved * f) / (moved + m), 9.0, until_position=asked.drop),
            lambda _: Stretch(lambda _: -f, 99.0, until_position=asked.start),
            bumper,
            lambda v: Stretch(lambda _: f, -v / f) if rebound else None,
        ]
    )
    plant = plant_of(machine, asked)
    plant.release()
    cycle = 0
    while not plant.at_rest:
        plant.advance()
        cycle += 1
        assert (plant.position, plant.velocity) == pytest.approx(truth(cycle * H), abs=2e-10)
    assert cycle * H == pytest.approx(truth.end[0], abs=H)
    assert plant.velocity == 0.0


@given(st.floats(0.5, 5.5), st.floats(0.03, 0.15), st.floats(0.0, 2.0), st.floats(0.0, 0.9))
@settings(max_examples=30)
def test_the_cart_does_what_was_planned(a0, ta, coast, rebound) -> None:
    machine = track(rebound)
    assume(clip(ConstantPulse(a0, ta), CAPACITY, coast=coast, payload=BLOCK).feasible)
    asked = set_for(ConstantPulse(a0, ta), coast, machine)
    run = ReleasedRun(machine, asked.pulse, wait=0.05, coast=coast, rest=0.05)
    plant = plant_of(machine, asked)
    positions, velocities = [], []
    for k in range(int(run.duration / H)):
        if k == 50:
            plant.release()
        positions.append(plant.position)
        velocities.append(plant.velocity)
        plant.advance()
    t = np.arange(len(positions)) * H
    assert np.abs(np.array(positions) - run.displacement(t)).max() < 1e-11
    assert np.abs(np.array(velocities) - run.velocity(t)).max() < 1e-10
    assert run.end_stop_position == pytest.approx(asked.start, rel=1e-12)


def test_a_held_cart_stays_until_the_latch_has_opened() -> None:
    asked = set_for(ConstantPulse(2.55, 0.12), 1.0)
    plant = plant_of(TRACK, asked, PURE.model_copy(update={"release_delay": 2.5 * H}))
    for _ in range(100):
        plant.advance()
    assert (plant.held, plant.at_rest, plant.position) == (True, True, 0.0)
    plant.release()
    plant.release()
    assert not plant.held
    for _ in range(2):
        plant.advance()
    assert plant.position == 0.0
    plant.advance()
    # Half a cycle of a0.
    assert plant.position == pytest.approx(0.5 * asked.pulse.amplitude * (0.5 * H) ** 2, rel=1e-9)
    assert plant.leg == "pulse"


def test_without_air_the_cart_brakes_by_friction_where_it_is() -> None:
    asked = set_for(ConstantPulse(2.55, 0.12), 2.0)
    plant = plant_of(TRACK, asked)
    plant.release()
    for _ in range(500):
        plant.advance()
    x, v = plant.position, plant.velocity
    assert plant.leg == "coast"
    plant.air = False
    while not plant.at_rest:
        plant.advance()
    assert plant.position - x == pytest.approx(v * v / (2.0 * 1.5), rel=1e-9)
    assert not plant.air


def test_without_air_while_the_mass_falls_it_goes_on_pulling_with_less() -> None:
    asked = set_for(ConstantPulse(2.55, 0.12), 2.0)
    plant = plant_of(TRACK, asked)
    plant.release()
    for _ in range(60):
        plant.advance()
    plant.air = False
    moved, m = TRACK.cart + BLOCK, asked.mass
    v = plant.velocity
    plant.advance()
    assert plant.velocity - v == pytest.approx((m * 9.81 - moved * 1.5) / (moved + m) * H, rel=1e-9)
    plant.air = True
    v = plant.velocity
    plant.advance()
    assert plant.velocity - v == pytest.approx(asked.pulse.amplitude * H, rel=1e-9)


def test_friction_without_air_holds_a_light_weight_up() -> None:
    asked = set_for(ConstantPulse(0.3, 0.5), 1.0)
    plant = plant_of(TRACK, asked)
    plant.release()
    for _ in range(200):
        plant.advance()
    plant.air = False
    x, v = plant.position, plant.velocity
    a = (asked.mass * 9.81 - 1.5 * 12.5692) / (12.5692 + asked.mass)
    assert a < 0.0
    while not plant.at_rest:
        plant.advance()
        assert plant.leg in ("pulse", "rest")
    assert plant.position < asked.drop
    assert plant.position == pytest.approx(x + v * v / (-2.0 * a), rel=1e-9)
    assert plant.velocity == 0.0


def test_the_specimen_feels_all_of_the_true_acceleration() -> None:
    calls: list[tuple[float, float, float]] = []

    def specimen(duration: float, start: float, end: float) -> float:
        calls.append((duration, start, end))
        return 0.25

    asked = set_for(ConstantPulse(2.55, 0.12), 0.2)
    plant = plant_of(TRACK, asked, specimen=specimen, rotation=0.1)
    plant.released = False
    plant.advance()
    assert plant.rotation == 0.1
    assert not calls
    plant.released = True
    plant.release()
    cycles = 0
    while not plant.at_rest:
        plant.advance()
        cycles += 1
    assert plant.rotation == 0.25
    assert math.fsum(d for d, _, _ in calls) == pytest.approx(cycles * H, rel=1e-12)
    # Speed gained and lost, by the trapezoids the specimen was given.
    gained = math.fsum(0.5 * d * (a + b) for d, a, b in calls)
    assert gained == pytest.approx(0.0, abs=2e-4)
    assert max(b for _, _, b in calls) == pytest.approx(asked.pulse.amplitude)


def test_what_the_sensors_say() -> None:
    asked = set_for(ConstantPulse(2.55, 0.12), 0.2)
    exact = plant_of(TRACK, asked)
    noisy = plant_of(TRACK, asked, MeasuringParameters(release_delay=0.0), seed=3)
    exact.release()
    noisy.release()
    mean, last = [], 0.0
    for _ in range(900):
        exact.advance()
        noisy.advance()
        assert exact.measure_position() == exact.position
        assert exact.measure_acceleration() == pytest.approx((exact.velocity - last) / H, abs=1e-9)
        last = exact.velocity
        assert abs(noisy.measure_position() - noisy.position) <= 0.5e-6 + 1e-12
        mean.append(noisy.measure_acceleration() - exact.measure_acceleration())
    assert np.mean(mean) == pytest.approx(2e-3 * 9.81, abs=6e-3)
    assert np.std(mean) == pytest.approx(5e-3 * 9.81, rel=0.1)


def test_set_up_puts_the_cart_back() -> None:
    asked = set_for(ConstantPulse(2.55, 0.12), 0.2)
    plant = plant_of(TRACK, asked)
    plant.release()
    for _ in range(400):
        plant.advance()
    plant.air = False
    plant.set_up()
    assert (plant.position, plant.velocity, plant.held, plant.air) == (0.0, 0.0, True, True)
    assert plant.measure_acceleration() == 0.0
