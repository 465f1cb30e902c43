"""One block through the chain of the stack, against the single-block solver; and a pair that never parts."""

from __future__ import annotations

import math
import pkgutil
from importlib import import_module

import numpy as np
import pytest

import twin.stack
from tests.facts import B6L, FREE_IMPACTS, FREE_REST, sine
from twin import Block, Outcome, Stack, overturning_map, simulate
from twin.rocking import march
from twin.rocking.methods import taylor
from twin.rocking.restitution import Improved
from twin.stack.modes import ROCKED, STAYED, overturning_modes

ONE = Stack([B6L])


def test_the_single_block_solver_is_not_called(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(*_: object) -> None:
        raise AssertionError("the single-block solver was called")

    for name in ("march", "march_through"):
        solver = getattr(march, name)
        for module in pkgutil.walk_packages(twin.stack.__path__, "twin.stack."):
            for value in vars(import_module(module.name)).values():
                assert value is not solver, module.name
    monkeypatch.setattr(taylor.Taylor, "solve", refused)
    monkeypatch.setattr("twin.simulation.method_called", refused)
    assert simulate(ONE, initial_rotation=0.15).outcome is Outcome.ROCKED
    with pytest.raises(AssertionError, match="was called"):
        simulate(B6L, initial_rotation=0.15)


def test_free_rocking() -> None:
    response = simulate(ONE, initial_rotation=0.15)
    for n, (time, rate) in FREE_IMPACTS.items():
        impact = response.impacts[n - 1]
        assert impact.time == pytest.approx(time, abs=1e-13)
        assert impact.rates_before[0] == pytest.approx(-rate * (-1) ** (n - 1), abs=1e-13)
        assert impact.rates_after[0] == pytest.approx(B6L.housner_restitution * impact.rates_before[0], abs=1e-15)
    assert response.rest_time == pytest.approx(FREE_REST, abs=1e-9)
    assert response.configurations[0] == (0.0, (1,))
    assert response.configurations[-1] == (response.rest_time, (0,))


@pytest.mark.parametrize("k", [0.4, 1.0])
@pytest.mark.parametrize(("amplitude", "frequency"), [(3.0, 3.0), (1.2, 1.0), (5.2, 4.0), (-2.5, 2.0), (0.9, 2.0)])
def test_sine_waves(amplitude: float, frequency: float, k: float) -> None:
    pulse = sine(amplitude, frequency)
    expected = simulate(B6L, pulse, restitution=Improved(k))
    response = simulate(Stack([B6L], impulse_shares=[k]), pulse, pulling_pivot="pulls")
    assert response.outcome is expected.outcome
    times = [impact.time for impact in response.impacts][: len(expected.impact_times)]
    assert times == pytest.approx(expected.impact_times[: len(times)], abs=1e-12)
    if expected.overturning_time is None:
        assert response.overturnings == ()
        assert response.peak_rotations[0] == pytest.approx(expected.peak_rotation, abs=1e-13)
    else:
        (fall,) = response.overturnings
        assert fall.time == pytest.approx(expected.overturning_time, abs=1e-12)
        assert fall.rotations[0] == pytest.approx(expected.direction * 0.5 * math.pi, abs=1e-15)
    sampled = np.linspace(0.0, min(3.0, response.end_time), 50)
    assert response.rotations(sampled)[:, 0] == pytest.approx(expected.rotation(sampled), abs=1e-12)
    assert response.angular_velocities(sampled)[:, 0] == pytest.approx(expected.angular_velocity(sampled), abs=1e-10)


def test_map() -> None:
    """Every decided outcome, and every time of overturning (1e-12 s where it hardly depends on the amplitude)."""
    amplitudes, frequencies = np.linspace(0.5, 8.0, 16), np.linspace(0.5, 6.0, 15)
    chart = overturning_map(B6L, amplitudes=amplitudes, frequencies=frequencies, times=True)
    assert chart.overturning_time is not None
    pieces = chart.grid.pieces(0, chart.grid.size)
    modes = overturning_modes(ONE, pieces, pulling_pivot="pulls", tolerance=1e-10)
    decided = chart.codes.reshape(-1) <= 2
    assert np.array_equal(modes.codes[decided], chart.codes.reshape(-1)[decided])
    fell = decided & (modes.fallen == 1)
    times = modes.times[fell, 0]
    errors = np.abs(times - chart.overturning_time.reshape(-1)[fell])
    assert np.max(errors) < 1e-9
    pieces[:, 0, 4] *= 1.0 + 1e-7
    moved = overturning_modes(ONE, pieces, pulling_pivot="pulls", tolerance=1e-10).times[fell, 0]
    steady = np.abs(moved - times) < 10.0 * 1e-7
    assert np.max(errors[steady]) < 1e-12
    assert np.count_nonzero(steady) > 0.9 * np.count_nonzero(fell)
    assert np.all(np.isin(modes.codes[~fell], (STAYED, ROCKED)))


@pytest.mark.parametrize("amplitude", [1.5, 2.2])
def test_blocks_that_never_part_are_one_block(amplitude: float) -> None:
    """Flat blocks on a slender one stay closed: the motion is that of one block of the summed height."""
    pulse = sine(amplitude, 6.0)
    whole = simulate(Block(0.06, 0.27), pulse)
    assert whole.outcome is Outcome.ROCKED
    for heights in ((0.24, 0.03), (0.23, 0.02, 0.02)):
        response = simulate(Stack([Block(0.06, height) for height in heights]), pulse)
        assert {signs[1:] for _, signs in response.configurations} == {(0,) * (len(heights) - 1)}
        times = [impact.time for impact in response.impacts][: len(whole.impact_times)]
        assert times == pytest.approx(whole.impact_times[: len(times)], abs=1e-12)
        assert (response.mode, response.ending.value) == ("none", "at rest")
        assert response.rest_time == pytest.approx(whole.rest_time, abs=1e-9)
        sampled = np.linspace(0.0, 2.0, 21)
        for block in range(len(heights)):
            assert response.rotations(sampled)[:, block] == pytest.approx(whole.rotation(sampled), abs=1e-12)
