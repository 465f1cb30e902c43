"""What is asked, what is answered, and how a method says no."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.facts import B6L, constant, sine
from twin import Block, Outcome, simulate
from twin.rocking.methods import METHODS, MODELS, MethodRefused, method
from twin.rocking.restitution import Improved, restitution_ratio


@pytest.mark.parametrize("name", METHODS)
def test_every_method_keeps_the_contract(name: str) -> None:
    found = method(name)
    assert found.name == name
    assert found.source
    assert set(found.models) <= set(MODELS)
    for model in MODELS:
        if model not in found.models:
            with pytest.raises(MethodRefused, match=f"{name} solves the"):
                simulate(B6L, initial_rotation=0.1, method=name, model=model)
            continue
        response = simulate(B6L, initial_rotation=0.1, method=name, model=model)
        assert response.outcome is Outcome.ROCKED
        assert (response.method, response.model) == (name, model)
        again = simulate(B6L, initial_rotation=0.1, method=name, model=model)
        assert np.array_equal(response.impact_times, again.impact_times)
        assert response.rest_time == again.rest_time


@pytest.mark.parametrize("name", METHODS)
def test_mirror(name: str) -> None:
    one = simulate(B6L, initial_rotation=0.12, initial_angular_velocity=0.2, method=name, duration=1.0)
    other = simulate(B6L, initial_rotation=-0.12, initial_angular_velocity=-0.2, method=name, duration=1.0)
    assert np.array_equal(one.impact_rates, -other.impact_rates)
    t = np.linspace(0.0, 1.0, 50)
    assert np.array_equal(one.rotation(t), -np.asarray(other.rotation(t)))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("duration", [0.1, 0.2505, 0.3, 1.0, 10.0])
def test_a_duration_ends_the_run(name: str, duration: float) -> None:
    response = simulate(B6L, initial_rotation=0.15, method=name, duration=duration)
    whole = simulate(B6L, initial_rotation=0.15, method=name)
    assert response.outcome is Outcome.ROCKED
    assert response.end_time == (math.inf if duration == 10.0 else duration)
    count = np.count_nonzero(whole.impact_times <= duration)
    assert response.impact_times == pytest.approx(whole.impact_times[:count], abs=1e-11)
    slack = 2 * response.rotation_error + 1e-11
    assert response.rotation(duration) == pytest.approx(whole.rotation(duration), abs=slack)


@pytest.mark.parametrize("name", ["taylor", "dop853", "rk4", "newmark"])
def test_shaking_cut_short_still_has_its_verdict(name: str) -> None:
    cut = simulate(B6L, constant(2, 0.2), duration=0.12, method=name)
    assert cut.outcome is Outcome.OVERTURNED
    assert cut.overturning_time is None
    assert cut.direction == 0
    assert cut.end_time == 0.12
    assert cut.rotation(0.12) == pytest.approx(simulate(B6L, constant(2, 0.2)).rotation(0.12), abs=1e-6)


@pytest.mark.parametrize("name", ["taylor", "dop853", "rk4", "newmark"])
def test_standing_still_and_lying(name: str) -> None:
    assert simulate(B6L, sine(0.5, 2), method=name).outcome is Outcome.STAYED
    assert simulate(B6L, method=name).rotation([0.0, 5.0]) == pytest.approx([0.0, 0.0])
    lying = simulate(B6L, sine(3, 3), method=name)
    assert lying.rotation(3.0) == math.pi / 2
    assert lying.angular_velocity(3.0) == 0.0
    assert lying.peak_rotation == math.pi / 2


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"method": "euler"}, "there is no method 'euler'"),
        ({"model": "cubic"}, "there is no model 'cubic'"),
        ({"step": 0.0}, "step is 0 s"),
        ({"step": math.nan}, "step is nan s"),
    ],
)
def test_bad_arguments_are_named(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        simulate(B6L, **arguments)


def test_too_many_steps_are_refused_not_cut() -> None:
    with pytest.raises(MethodRefused, match="needs more than 2000000 steps"):
        simulate(B6L, initial_rotation=0.15, restitution=1.0, duration=1e4, method="rk4")


def test_improved_restitution() -> None:
    s = math.sin(B6L.slenderness) ** 2
    assert restitution_ratio(B6L, Improved(1.0)) == pytest.approx(B6L.housner_restitution, rel=1e-15)
    assert restitution_ratio(B6L, Improved(0.0)) == 1.0
    assert restitution_ratio(B6L, Improved(0.5)) == pytest.approx((4 - 4.5 * s) / (4 - 1.5 * s), rel=1e-15)
    assert restitution_ratio(B6L, 0.9) == 0.9
    response = simulate(B6L, initial_rotation=0.1, restitution=Improved(0.5))
    assert response.restitution == Improved(0.5).ratio(B6L)
    rates = np.abs(response.impact_rates)
    assert rates[1:] == pytest.approx(rates[:-1] * response.restitution, rel=1e-9)


def test_improved_restitution_of_a_cube_and_flatter() -> None:
    assert Improved(1.0).ratio(Block(0.3, 0.3)) == pytest.approx(0.25)
    assert Improved(1.0).ratio(Block(1.0, 0.5)) == 0.0


@pytest.mark.parametrize("k", [-0.1, 1.1, math.nan])
def test_improved_restitution_has_a_range(k: float) -> None:
    with pytest.raises(ValueError, match="share of the half width"):
        Improved(k)
