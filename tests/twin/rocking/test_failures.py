"""Where methods fail: each row of the failure table, for the default solver. Right, or refused; never quietly wrong."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.facts import B6L, LIMIT, P, constant, quarter_period, sine
from twin import Outcome, simulate


def test_01_impacts_faster_than_the_step() -> None:
    response = simulate(B6L, initial_angular_velocity=0.002)
    expected = [0.000346585297409356, 0.000668705727488220, 0.000968088226545074, 0.00124633782861527]
    assert response.impact_times[:4] == pytest.approx(expected, abs=1e-15)
    assert response.rest_time == pytest.approx(0.00490995674123549, abs=1e-15)


def test_02_endless_impacts() -> None:
    response = simulate(B6L, initial_rotation=0.15)
    after = np.abs(response.impact_rates) * response.restitution
    n = np.arange(after.size)
    assert after == pytest.approx(after[0] * response.restitution**n, rel=1e-10)
    assert response.rest_time == pytest.approx(4.20162808742898, abs=1e-13)
    assert after.size < 200


def test_03_every_one_that_leaves_comes_back() -> None:
    for speed in np.geomspace(1e-9, 0.21, 400):
        response = simulate(B6L, initial_angular_velocity=speed * P)
        assert response.impact_rates[0] == pytest.approx(-speed * P, rel=1e-9, abs=1e-15)
        assert 0.0 < response.impact_times[0] < math.inf


def test_04_threshold() -> None:
    assert simulate(B6L, sine(1.0, 3)).outcome is Outcome.STAYED
    weak = simulate(B6L, sine(1.0001, 3))
    assert weak.uplift_time == pytest.approx(0.0711387583099853, abs=1e-13)
    assert weak.impact_times[0] == pytest.approx(0.0737238698832590, abs=1e-13)
    assert weak.outcome is Outcome.ROCKED


def test_04_one_sine() -> None:
    response = simulate(B6L, sine(3, 3))
    assert response.outcome is Outcome.OVERTURNED
    assert response.uplift_time == pytest.approx(0.0155304670444855, abs=1e-14)
    assert response.impact_times == pytest.approx([0.366383679370360], abs=1e-14)
    assert abs(response.impact_rates[0]) == pytest.approx(2.19928214486607, abs=1e-12)
    assert response.overturning_time == pytest.approx(0.889657851683760, abs=1e-13)
    # A positive base acceleration starts a negative rotation; after the impact it falls the other way.
    assert response.impact_rates[0] > 0.0
    assert response.direction == 1


@pytest.mark.parametrize("factor", [0.999, 1.0, 1.0 - 1e-15, 1.0 + 1e-15])
def test_04_at_the_threshold_rounding_does_not_lift(factor: float) -> None:
    assert simulate(B6L, constant(factor, 0.5)).outcome is Outcome.STAYED


@pytest.mark.parametrize(("amplitude", "touch"), [(3.39331, 0.311096168923972), (3.39332, 0.314778571347720)])
def test_05_grazing(amplitude: float, touch: float) -> None:
    response = simulate(B6L, sine(amplitude, 4, cycles=10))
    # Nearly tangential: an error of 1e-16 in the rotation moves the contact by 1e-13 s.
    assert response.impact_times[0] == pytest.approx(touch, abs=1e-12)


def test_05_a_near_miss_is_not_an_impact() -> None:
    response = simulate(B6L, sine(3.39332, 4, cycles=10))
    around = np.linspace(0.3124, 0.3128, 4001)
    lowest = float(np.min(np.abs(response.rotation(around))))
    assert lowest == pytest.approx(1.43e-6, rel=0.005)


def test_06_break_points() -> None:
    critical = 0.0951960321927143
    safe = simulate(B6L, constant(2, critical * (1.0 - 1e-9)))
    assert safe.outcome is Outcome.ROCKED
    assert safe.peak_rotation == pytest.approx(0.218658955722998, abs=1e-11)
    falls = simulate(B6L, constant(2, critical * (1.0 + 1e-9)))
    assert falls.outcome is Outcome.OVERTURNED
    assert simulate(B6L, constant(2, 0.09519603228791035)).overturning_time == pytest.approx(3.2413689601, abs=1e-7)


@pytest.mark.parametrize(
    ("rotation", "time"), [(0.21864707897935456, 1.35789784316246), (0.21866894368725251, 2.62062902727305)]
)
def test_07_near_the_unstable_equilibrium(rotation: float, time: float) -> None:
    tolerance = 2e-16 / (B6L.slenderness - rotation) / P
    response = simulate(B6L, initial_rotation=rotation)
    assert response.outcome is Outcome.ROCKED
    assert response.impact_times[0] == pytest.approx(time, abs=tolerance)
    assert response.impact_times[0] == pytest.approx(quarter_period(rotation), abs=2 * tolerance)


def test_07_released_above_the_corner() -> None:
    response = simulate(B6L, initial_rotation=0.22085563533268138)
    assert response.outcome is Outcome.OVERTURNED
    assert response.overturning_time == pytest.approx(0.981539406054123, abs=1e-13)


def test_07_on_the_equilibrium_itself_nobody_knows() -> None:
    response = simulate(B6L, initial_rotation=B6L.slenderness)
    assert response.outcome is Outcome.UNDECIDED
    assert math.isfinite(response.end_time)


def test_10_energy_without_loss() -> None:
    response = simulate(B6L, initial_rotation=0.15, restitution=1.0, duration=1000.0)
    impacts = np.abs(response.impact_rates)
    assert response.outcome is Outcome.ROCKED
    assert response.rest_time is None
    assert impacts == pytest.approx(impacts[0], abs=1e-11)
    # Every flight is as long as the first: two quarter periods.
    times = response.impact_times
    assert np.diff(times) == pytest.approx(2.0 * times[0], abs=1e-10)


def test_11_one_rounding_at_a_boundary_is_undecided() -> None:
    outcomes = {simulate(B6L, sine(1.130219301613210 + k * 2.2e-16, 1)).outcome for k in range(-12, 13)}
    assert Outcome.UNDECIDED in outcomes
    assert outcomes <= {Outcome.ROCKED, Outcome.UNDECIDED, Outcome.OVERTURNED}


def test_12_bulky_block() -> None:
    from excitation import ConstantPulse
    from twin import Block

    bulky = Block(0.12, 0.27)
    critical = 0.0988032
    assert simulate(bulky, ConstantPulse(8.72, critical * 1.0001)).outcome is Outcome.OVERTURNED
    assert simulate(bulky, ConstantPulse(8.72, critical * 0.9999)).outcome is Outcome.ROCKED
    # Here the linearised answer (0.0900974 s) is already wrong.
    assert simulate(bulky, ConstantPulse(8.72, 0.0935)).outcome is Outcome.ROCKED


@pytest.mark.parametrize(("amplitude", "product"), [(2.0, 0.6943582846972270), (5.0, 0.2241161638444389)])
def test_constant_pulse_critical_durations(amplitude: float, product: float) -> None:
    for factor, outcome in ((1.0 - 1e-9, Outcome.ROCKED), (1.0 + 1e-9, Outcome.OVERTURNED)):
        assert simulate(B6L, constant(amplitude, product / P * factor)).outcome is outcome


def test_uplift_needs_more_than_the_threshold() -> None:
    assert simulate(B6L, constant(1.0, 0.1)).uplift_time is None
    assert simulate(B6L, constant(1.001, 0.1)).uplift_time == 0.0
    assert math.isclose(LIMIT, B6L.gravity * math.tan(B6L.slenderness), rel_tol=1e-15)
