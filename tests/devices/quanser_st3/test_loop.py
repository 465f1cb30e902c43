"""The position loop in the linear regime against independent solutions of the same equation."""

from __future__ import annotations

import cmath
import itertools
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.signal import lsim

from devices.quanser_st3.loop import LinearLoop, LinearStep

H = 1e-3
W = math.tau * 31.9


@pytest.mark.parametrize("damping", [0.1, 0.78, 1.0, 3.0])
def test_a_step_follows_the_equation_exactly(damping: float) -> None:
    loop = LinearLoop(W, damping)
    step = LinearStep(loop, H)
    rng = np.random.default_rng(5)
    setpoints = np.concatenate(([0.0], np.cumsum(rng.uniform(-1e-4, 1e-4, 300))))
    position = velocity = 0.0
    x, v = [0.0], [0.0]
    for before, after in itertools.pairwise(setpoints):
        position, velocity = step.advance(position, velocity, float(before), float(after))
        x.append(position)
        v.append(velocity)
    # lsim also takes its input as linear between samples
    system = ([[0, 1], [-W * W, -2 * damping * W]], [[0], [W * W]], np.eye(2), np.zeros((2, 1)))
    _, y, _ = lsim(system, setpoints, np.arange(len(setpoints)) * H)
    assert np.allclose(x, y[:, 0], rtol=0.0, atol=1e-13)
    assert np.allclose(v, y[:, 1], rtol=0.0, atol=1e-10)


def test_a_step_at_rest_changes_nothing_to_the_last_bit() -> None:
    step = LinearStep(LinearLoop(W, 0.78), H)
    assert step.advance(0.0371, 0.0, 0.0371, 0.0371) == (0.0371, 0.0)


@pytest.mark.parametrize("frequency", [0.5, 4.0, 10.0, 30.0, 80.0])
@pytest.mark.parametrize("delay", [0.0, 2.3e-3])
def test_response_is_what_an_integrator_settles_to(frequency: float, delay: float) -> None:
    zeta, omega = 0.78, math.tau * frequency

    def rate(t: float, z: np.ndarray) -> list[float]:
        return [z[1], W * W * (math.sin(omega * (t - delay)) - z[0]) - 2 * zeta * W * z[1]]

    # until the transient of exp(-zeta w t) is below 1e-12, then one period
    start = 30.0 / (zeta * W)
    t = start + np.arange(64) / (64 * frequency)
    y = solve_ivp(rate, (0.0, t[-1]), [0.0, 0.0], "DOP853", t_eval=t, rtol=1e-11, atol=1e-13).y[0]
    found = 2j * np.mean(y * np.exp(-1j * omega * t))
    assert found == pytest.approx(LinearLoop(W, zeta, delay).response(frequency), abs=1e-9)


def test_delay_is_the_slope_of_the_phase_at_low_frequency() -> None:
    loop = LinearLoop(W, 0.78, 1.5e-3)
    assert -cmath.phase(loop.response(0.01)) / (math.tau * 0.01) == pytest.approx(loop.delay, rel=1e-5)
    # facts.md: a pure lag of about 7.8 ms for the loop alone
    assert LinearLoop(200.7, 0.78).delay == pytest.approx(7.8e-3, abs=0.05e-3)
    assert loop.response(0.0) == 1.0
