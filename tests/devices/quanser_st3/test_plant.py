"""The emulated table's mechanics against independent solutions of the same equation."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from devices.cia402.machine import Switches
from devices.quanser_st3.parameters import St3Parameters
from devices.quanser_st3.plant import St3Plant

H = 1e-3
PURE = St3Parameters(encoder_step=0.0, accelerometer_noise=0.0, accelerometer_bias=0.0, delay=0.0)
"""What is left is the loop."""


def plant(parameters: St3Parameters = PURE, seed: int = 1, **arguments) -> St3Plant:
    return St3Plant(parameters, H, np.random.default_rng(seed), **arguments)


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
    # the motor does 345 m/s2 without a payload
    for _ in range(2):
        table.advance(0.1)
    assert table.acceleration == pytest.approx(345.2, abs=0.1)
    assert table.measure_acceleration() == 5.0 * 9.81


def test_equal_seeds_equal_readings() -> None:
    one, same, other = (plant(St3Parameters(), seed) for seed in (7, 7, 8))
    series = [[table.measure_acceleration() for _ in range(50)] for table in (one, same, other)]
    assert series[0] == series[1] != series[2]


@pytest.mark.parametrize("delay", [0.0, 0.4e-3, 1e-3, 2.3e-3, 17e-3])
@pytest.mark.parametrize("substeps", [1, 3])
def test_the_delay_is_exact(delay: float, substeps: int) -> None:
    """A delayed table does what an undelayed one did, `delay` earlier; a quadratic motion shows the knots."""
    positions = [1e-6 * k * k for k in range(200)]
    late = plant(PURE.model_copy(update={"delay": delay, "substeps": substeps}))
    for x in positions[1:]:
        late.advance(x)
    w, zeta = math.tau * 31.9, 0.78
    times = np.arange(200) * H

    def rate(t: float, z: np.ndarray) -> list[float]:
        return [z[1], w * w * (np.interp(t - delay, times, positions) - z[0]) - 2 * zeta * w * z[1]]

    state, now = [0.0, 0.0], 0.0
    for knot in sorted({*times[1:], *(t + delay for t in times if t + delay < times[-1])}):
        state = solve_ivp(rate, (now, knot), state, "DOP853", rtol=1e-12, atol=1e-15).y[:, -1] if knot > now else state
        now = float(knot)
    assert late.position == pytest.approx(state[0], abs=1e-12)
    assert late.velocity == pytest.approx(state[1], abs=1e-10)


def test_payload_makes_the_loop_slower_and_less_damped() -> None:
    """A step of the set-point: the overshoot exp(-pi zeta / sqrt(1 - zeta^2)), and when it comes."""
    for payload in (0.0, 2.5692, 30.0, 100.0):
        table = plant(PURE.model_copy(update={"substeps": 10}), payload=payload)
        loop = PURE.loop(payload)
        root = math.sqrt(1 - loop.damping**2)
        path = []
        for _ in range(400):
            table.advance(1e-4)
            path.append(table.position)
        assert max(path) / 1e-4 == pytest.approx(1 + math.exp(-math.pi * loop.damping / root), abs=2e-3)
        # the set-point takes a cycle to get there
        when = math.pi / (loop.angular_frequency * root) + 0.5 * H
        assert (1 + path.index(max(path))) * H == pytest.approx(when, abs=1.5 * H)
    assert PURE.loop(100.0).damping == pytest.approx(0.78 * math.sqrt(7.74 / 107.74))


def test_the_specimen_feels_the_bumper() -> None:
    felt: list[tuple[float, float, float]] = []

    def specimen(duration: float, start: float, end: float) -> float:
        felt.append((duration, start, end))
        return 0.0

    table = plant(PURE.model_copy(update={"top_speed": 1.0}), specimen=specimen)
    # far beyond both ends: the drive pushes the table into the switch, and it runs on into the bumper
    for k in range(300):
        table.advance(0.6e-3 * k)
    hardest = min(start for _, start, _ in felt)
    assert hardest < -20.0
    assert sum(duration for duration, _, _ in felt) == pytest.approx(0.3, abs=1e-9)
    # the jump as the bumper is touched is there as a jump: v c / M in no time
    assert max(abs(b[1] - a[2]) for a, b in itertools.pairwise(felt)) > 20.0
    # and the velocity is the integral of what is felt, as far as straight lines follow it
    change = sum(duration * 0.5 * (start + end) for duration, start, end in felt)
    assert change == pytest.approx(table.velocity, abs=1e-3)


def test_switches() -> None:
    assert plant().switches == Switches(home=True)
    assert plant(position=0.003).switches == Switches()
    assert plant(position=0.1129).switches == Switches()
    assert plant(position=0.1131).switches == Switches(positive=True)
    assert plant(position=-0.1131).switches == Switches(negative=True)
    assert plant(position=0.04, half_stroke=0.035).switches == Switches(positive=True)
    pressed = plant()
    pressed.stop = True
    assert pressed.switches == Switches(home=True, stop=True)


def test_power_comes_back_where_the_table_stands() -> None:
    table = plant(PURE.model_copy(update={"delay": 2.5e-3}))
    for k in range(100):
        table.advance(2e-4 * k)
    table.powered = False
    assert table.velocity > 0.1
    for _ in range(300):
        table.advance(0.0)
    assert table.velocity == 0.0
    there = table.position
    table.powered = True
    for _ in range(50):
        table.advance(there)
    assert (table.position, table.velocity) == (there, 0.0)


def test_pace_changes_the_cycle_and_nothing_else() -> None:
    quick, slow = plant(PURE), plant(PURE)
    slow.pace(4 * H)
    for k in range(1, 201):
        quick.advance(1e-5 * k)
        if k % 4 == 0:
            slow.advance(1e-5 * k)
    assert slow.position == pytest.approx(quick.position, abs=1e-14)


def test_a_sensor_can_be_replaced() -> None:
    class Frozen:
        def read(self, true: float) -> float:
            return 0.25

    table = plant()
    table.encoder = table.accelerometer = Frozen()
    assert (table.measure_position(), table.measure_acceleration()) == (0.25, 0.25)
