"""The emulated table's mechanics against independent solutions of the same equation."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from pydantic import ValidationError
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from devices.quanser_st3.plant import ClosedLoop, St3Parameters, St3Plant

H = 1e-3
PURE = St3Parameters(encoder_step=0.0, accelerometer_noise=0.0, accelerometer_bias=0.0)


def plant(parameters: St3Parameters = PURE, seed: int = 1, **arguments) -> St3Plant:
    return St3Plant(parameters, H, np.random.default_rng(seed), **arguments)


@pytest.mark.parametrize("damping", [0.1, 0.78, 1.0, 3.0])
def test_follows_the_equation_exactly(damping: float) -> None:
    w = math.tau * 31.9
    loop = ClosedLoop(w, damping, H, 0.0)
    rng = np.random.default_rng(5)
    setpoints = np.concatenate(([0.0], np.cumsum(rng.uniform(-1e-4, 1e-4, 300))))
    x = [0.0]
    a = [0.0]
    for r in setpoints[1:]:
        loop.advance(float(r))
        x.append(loop.position)
        a.append(loop.acceleration)
    # lsim also takes its input as linear between samples
    t = np.arange(len(setpoints)) * H
    system = (
        [[0, 1], [-w * w, -2 * damping * w]],
        [[0], [w * w]],
        [[1, 0], [-w * w, -2 * damping * w]],
        [[0], [w * w]],
    )
    _, y, _ = lsim(system, setpoints, t)
    assert np.allclose(x, y[:, 0], rtol=0.0, atol=1e-13)
    assert np.allclose(a, y[:, 1], rtol=0.0, atol=1e-8)


def test_one_sine_against_an_integrator() -> None:
    w, zeta = math.tau * 31.9, 0.78
    frequency, amplitude = 2.0, 0.01
    table = plant()
    for k in range(400):
        table.advance(amplitude * math.sin(math.tau * frequency * (k + 1) * H))

    def rate(t: float, z: np.ndarray) -> list[float]:
        r = amplitude * math.sin(math.tau * frequency * t)
        return [z[1], w * w * (r - z[0]) - 2 * zeta * w * z[1]]

    truth = solve_ivp(rate, (0.0, 0.4), [0.0, 0.0], rtol=1e-11, atol=1e-14).y[:, -1]
    # linear interpolation of the set-point: at most A w^2 h^2 / 8 = 2e-7 m off
    assert table.position == pytest.approx(truth[0], abs=2e-7)
    assert table.velocity == pytest.approx(truth[1], abs=5e-5)


def test_a_table_at_rest_stays_there_to_the_last_bit() -> None:
    table = plant(position=0.0371)
    for _ in range(1000):
        table.advance(0.0371)
    assert (table.position, table.velocity, table.acceleration) == (0.0371, 0.0, 0.0)


def test_substeps_do_not_change_the_table() -> None:
    one, ten = plant(), plant(PURE.model_copy(update={"substeps": 10}))
    for k in range(100):
        for table in (one, ten):
            table.advance(1e-6 * k * k)
    assert ten.position == pytest.approx(one.position, abs=1e-13)
    assert ten.acceleration == pytest.approx(one.acceleration, abs=1e-8)


def test_the_specimen_gets_the_true_acceleration_end_to_end() -> None:
    calls: list[tuple[float, float, float]] = []

    def specimen(duration: float, start: float, end: float) -> float:
        calls.append((duration, start, end))
        return 0.001 * len(calls)

    table = plant(PURE.model_copy(update={"substeps": 2}), specimen=specimen, rotation=-0.2)
    assert table.rotation == -0.2
    for k in range(50):
        table.advance(1e-6 * k * k)
    assert len(calls) == 100
    assert table.rotation == pytest.approx(0.1)
    assert {duration for duration, _, _ in calls} == {H / 2}
    assert all(a[2] == b[1] for a, b in itertools.pairwise(calls))
    assert calls[0][1] == 0.0
    assert calls[-1][2] == table.acceleration


def test_encoder_steps() -> None:
    table = plant(St3Parameters())
    step = 12.7e-3 / 8192
    assert step == pytest.approx(1.5503e-6, rel=1e-4)
    for k in range(200):
        table.advance(2e-7 * k * k)
        reading = table.measure_position()
        assert abs(reading - table.position) <= 0.5 * step + 1e-15
        assert reading / step == pytest.approx(round(reading / step), abs=1e-6)


def test_accelerometer_bias_noise_and_range() -> None:
    table = plant(St3Parameters())
    readings = np.array([table.measure_acceleration() for _ in range(20000)])
    assert readings.mean() == pytest.approx(2e-3 * 9.81, abs=2e-3)
    assert readings.std() == pytest.approx(5e-3 * 9.81, rel=0.03)
    table.advance(0.1)
    assert table.acceleration > 1000.0
    assert table.measure_acceleration() == 5.0 * 9.81


def test_equal_seeds_equal_readings() -> None:
    one, same, other = (plant(St3Parameters(), seed) for seed in (7, 7, 8))
    series = [[table.measure_acceleration() for _ in range(50)] for table in (one, same, other)]
    assert series[0] == series[1] != series[2]


@pytest.mark.parametrize(
    "wrong",
    [
        {"loop_frequency": 0.0},
        {"loop_damping": -1.0},
        {"encoder_step": math.nan},
        {"accelerometer_bias": math.inf},
        {"substeps": 0},
        {"delay": 1e-3},
    ],
)
def test_parameters_are_bounded(wrong: dict[str, float]) -> None:
    with pytest.raises(ValidationError):
        St3Parameters(**wrong)
