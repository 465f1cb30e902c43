"""The emulated base against an integrator and against the plan's closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from devices.released_parameters import MeasuringParameters
from devices.roori1.capacity import CAPACITY
from devices.roori1.plant import Roori1Plant
from devices.roori1.settings import Roori1Machine
from excitation import DoublePulse, ReleasedRun
from tests.devices.released_rate import Stretch, Trajectory, shape_of

H = 1e-3
PURE = MeasuringParameters(release_delay=0.0, encoder_step=0.0, accelerometer_noise=0.0, accelerometer_bias=0.0)
shapes = st.sampled_from(["half sine", "rectangular", "triangular"])


def machine_of(struck: str = "half sine", stopped: str = "half sine", rebound: float = 0.0, friction: float = 0.05):
    machine = CAPACITY.machine
    assert isinstance(machine, Roori1Machine)
    return machine.model_copy(
        update={
            "striker": machine.striker.model_copy(update={"shape": struck}),
            "end_stop": machine.end_stop.model_copy(update={"shape": stopped, "rebound": rebound}),
            "friction": friction,
        }
    )


def plant_of(machine: Roori1Machine, velocity: float, gap: float, **arguments) -> Roori1Plant:
    asked = machine.settings_for(DoublePulse(velocity, gap, pulse_acceleration=300.0), CAPACITY, payload=1.0, coast=0.0)
    return Roori1Plant(machine, asked, PURE, H, np.random.default_rng(1), **arguments)


@pytest.mark.parametrize("struck", ["half sine", "rectangular", "triangular"])
@pytest.mark.parametrize("stopped", ["half sine", "triangular"])
@pytest.mark.parametrize(("velocity", "gap", "rebound"), [(0.3, 0.02, 0.0), (0.12, 0.035, 0.4), (0.6, 0.0025, 0.2)])
def test_against_an_integrator(struck, stopped, velocity, gap, rebound) -> None:
    machine = machine_of(struck, stopped, rebound)
    time, f = 0.005, machine.friction
    blow, block = shape_of(struck), shape_of(stopped)

    def stopper(v: float) -> Stretch:
        mean = -(1.0 + rebound) * v / time
        return Stretch(lambda t: mean * block(t / time), time)

    truth = Trajectory(
        [
            lambda _: Stretch(lambda t: velocity / time * blow(t / time), time),
            lambda _: Stretch(lambda _: -f, 99.0, until_position=gap),
            stopper,
            lambda v: Stretch(lambda _: f, -v / f) if rebound else None,
        ]
    )
    plant = plant_of(machine, velocity, gap)
    plant.release()
    cycle = 0
    while not plant.at_rest:
        plant.advance()
        cycle += 1
        assert (plant.position, plant.velocity) == pytest.approx(truth(cycle * H), abs=1e-10)
    assert plant.velocity == 0.0


@given(shapes, shapes, st.floats(0.076, 0.617), st.floats(0.0025, 0.035), st.floats(0.0, 0.8), st.floats(0.01, 0.3))
@settings(max_examples=40)
def test_the_base_does_what_was_planned(struck, stopped, velocity, gap, rebound, friction) -> None:
    machine = machine_of(struck, stopped, rebound, friction)
    pulse = DoublePulse(velocity, gap, pulse_acceleration=300.0)
    assume(machine.impossible(pulse) is None)
    run = ReleasedRun(machine, pulse, wait=0.01, rest=0.01)
    plant = plant_of(machine, velocity, gap)
    plant.release()
    positions, velocities = [], []
    for _ in range(int(min(run.duration, 3.0) / H) - 10):
        positions.append(plant.position)
        velocities.append(plant.velocity)
        plant.advance()
    t = 0.01 + np.arange(len(positions)) * H
    assert np.abs(np.array(positions) - run.displacement(t)).max() < 1e-12
    assert np.abs(np.array(velocities) - run.velocity(t)).max() < 1e-11


def test_no_blow_is_lost_between_two_samples() -> None:
    # Means over the cycles add up to the speed, however short the blow: 0.6 ms here.
    machine = machine_of(rebound=0.3)
    short = machine.model_copy(update={"striker": machine.striker.model_copy(update={"duration": 0.6e-3})})
    plant = plant_of(short, 0.3, 0.02)
    plant.release()
    speed = 0.0
    for _ in range(40):
        plant.advance()
        speed += plant.measure_acceleration() * H
        assert speed == pytest.approx(plant.velocity, abs=1e-12)


def test_the_specimen_gets_both_blows_whole() -> None:
    gained: list[float] = []

    def specimen(duration: float, start: float, end: float) -> float:
        gained.append(0.5 * duration * (start + end))
        return 0.0

    plant = plant_of(machine_of(friction=0.01), 0.3, 0.02, specimen=specimen)
    plant.release()
    for _ in range(30):
        plant.advance()
    # Linear between 64 points of the half sine: 2e-4 of it.
    assert sum(gained) == pytest.approx(plant.velocity, rel=3e-4)
    while not plant.at_rest:
        plant.advance()
    assert sum(gained) == pytest.approx(0.0, abs=1e-4)
