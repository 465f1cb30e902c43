"""Each row of the failure table for each method where it applies: right within what it states, or refused."""

from __future__ import annotations

import math

import numpy as np
import pytest

from excitation import ConstantPulse
from tests.facts import B6L, FREE_IMPACTS, FREE_REST, FREE_ROTATION_AT_2, P, constant, quarter_period, sine
from twin import Block, Outcome, Response, simulate
from twin.rocking.methods import MethodRefused

FORCED = ("taylor", "dop853", "rk4", "newmark")
FREE = ("closed-form", *FORCED)
ROUNDING = 2e-13


def allowed(response: Response, rate: float) -> float:
    """Return the error of an instant at which the rotation changes at `rate` rad/s, from the error stated."""
    return (response.rotation_error + ROUNDING) / abs(rate) + ROUNDING


def assert_honest(response: Response, truth: Response, until: float) -> None:
    """Undecided, or of the same outcome; and the rotation within the error it states."""
    assert response.outcome in (truth.outcome, Outcome.UNDECIDED)
    t = np.linspace(0.0, min(until, response.end_time, truth.end_time), 301)
    error = np.max(np.abs(np.asarray(response.rotation(t)) - np.asarray(truth.rotation(t))))
    assert error <= response.rotation_error + truth.rotation_error + ROUNDING or response.outcome is Outcome.UNDECIDED


@pytest.mark.parametrize("method", FREE)
def test_01_impacts_faster_than_the_step(method: str) -> None:
    response = simulate(B6L, initial_angular_velocity=0.002, method=method, duration=0.1)
    expected = [0.000346585297409356, 0.000668705727488220, 0.000968088226545074, 0.00124633782861527]
    assert response.impact_times[:4] == pytest.approx(expected, abs=allowed(response, 0.002))
    assert response.rest_time == pytest.approx(0.00490995674123549, abs=1e-8 if method == "newmark" else 1e-14)


@pytest.mark.parametrize("method", FREE)
def test_02_endless_impacts(method: str) -> None:
    response = simulate(B6L, initial_rotation=0.15, method=method)
    after = np.abs(response.impact_rates) * response.restitution
    n = np.arange(after.size)
    slack = {"newmark": 1e-4, "rk4": 1e-9, "dop853": 1e-9}.get(method, 1e-12)
    assert after == pytest.approx(after[0] * response.restitution**n, rel=slack)
    assert len(after) == 168
    assert response.rest_time == pytest.approx(FREE_REST, abs={"newmark": 5e-5, "rk4": 1e-9}.get(method, 2e-11))
    for k, (time, rate) in FREE_IMPACTS.items():
        assert response.impact_times[k - 1] == pytest.approx(time, abs=10 * allowed(response, rate))


@pytest.mark.parametrize(("method", "count"), [("closed-form", 2000), ("taylor", 200), ("rk4", 200), ("newmark", 200)])
def test_03_every_one_that_leaves_comes_back(method: str, count: int) -> None:
    for speed in np.geomspace(1e-9, 0.21, count):
        flight = 2.0 * quarter_from_contact(speed)
        response = simulate(B6L, initial_angular_velocity=speed * P, method=method, duration=1.01 * flight)
        assert response.impact_rates[0] == pytest.approx(-speed * P, rel=1e-4, abs=1e-15)
        slack = {"newmark": 1e-3, "rk4": 1e-8}.get(method, 1e-11)
        assert response.impact_times[0] == pytest.approx(flight, rel=slack)


def quarter_from_contact(speed: float) -> float:
    """Return the time from the contact at `speed` (units of p) to the peak, s, by SciPy's elliptic integral R_F."""
    from scipy.special import elliprf

    alpha = B6L.slenderness
    square = (math.sin(alpha / 2) - speed / 2) * (math.sin(alpha / 2) + speed / 2)
    tangent = speed / (2 * math.sqrt(square) * math.cos(alpha / 2))
    return tangent * float(elliprf(1.0, 1.0 + square * tangent**2, 1.0 + tangent**2)) / P


def test_03_dop853_comes_back_too() -> None:
    for speed in np.geomspace(1e-9, 0.21, 20):
        flight = 2.0 * quarter_from_contact(speed)
        response = simulate(B6L, initial_angular_velocity=speed * P, method="dop853", duration=1.01 * flight)
        assert response.impact_times[0] == pytest.approx(flight, rel=1e-9)


@pytest.mark.parametrize("method", FORCED)
def test_04_threshold(method: str) -> None:
    assert simulate(B6L, sine(1.0, 3), method=method).outcome is Outcome.STAYED
    weak = simulate(B6L, sine(1.0001, 3), method=method, duration=0.08)
    assert weak.uplift_time == pytest.approx(0.0711387583099853, abs=1e-13)
    # Shorter than a few of the fixed steps, which are cut to what the uplift itself allows.
    assert weak.impact_times[0] == pytest.approx(
        0.0737238698832590, abs={"newmark": 2e-4, "rk4": 1e-7}.get(method, 1e-11)
    )
    assert weak.outcome is Outcome.ROCKED


@pytest.mark.parametrize("method", FORCED)
def test_04_one_sine(method: str) -> None:
    response = simulate(B6L, sine(3, 3), method=method)
    assert response.outcome is Outcome.OVERTURNED
    assert response.direction == 1
    assert response.uplift_time == pytest.approx(0.0155304670444855, abs=1e-14)
    assert response.impact_times == pytest.approx([0.366383679370360], abs=allowed(response, 2.2))
    assert response.overturning_time == pytest.approx(0.889657851683760, abs=allowed(response, 3.0))


def test_04_nothing_forced_has_a_closed_form_in_the_full_equation() -> None:
    with pytest.raises(MethodRefused, match="no closed form on a moving base"):
        simulate(B6L, sine(3, 3), method="closed-form")


@pytest.mark.parametrize("amplitude", [3.39331, 3.39332])
@pytest.mark.parametrize(("method", "step"), [("rk4", 1e-3), ("rk4", 1e-2), ("newmark", 1e-3), ("newmark", 1e-4)])
def test_05_grazing(method: str, step: float, amplitude: float) -> None:
    pulse = sine(amplitude, 4, cycles=10)
    truth = simulate(B6L, pulse, duration=0.3125)
    assert_honest(simulate(B6L, pulse, method=method, step=step, duration=0.3125), truth, 0.3125)


def test_05_grazing_with_dop853() -> None:
    for amplitude, touch in ((3.39331, 0.311096168923972), (3.39332, 0.314778571347720)):
        pulse = sine(amplitude, 4, cycles=10)
        response = simulate(B6L, pulse, method="dop853", tolerance=1e-12, duration=0.33)
        assert response.impact_times[0] == pytest.approx(touch, abs=1e-10)


@pytest.mark.parametrize("method", FORCED)
@pytest.mark.parametrize(("sign", "truth"), [(-1.0, Outcome.ROCKED), (1.0, Outcome.OVERTURNED)])
@pytest.mark.parametrize("distance", [1e-9, 1e-6, 1e-3])
def test_06_break_points(method: str, sign: float, truth: Outcome, distance: float) -> None:
    pulse = constant(2, 0.0951960321927143 * (1.0 + sign * distance))
    response = simulate(B6L, pulse, method=method, tolerance=1e-12)
    assert response.outcome in (truth, Outcome.UNDECIDED)
    if method == "taylor" or distance == 1e-3 or (method, distance) == ("dop853", 1e-6):
        assert response.outcome is truth


@pytest.mark.parametrize("method", FREE)
@pytest.mark.parametrize("rotation", [0.21864707897935456, 0.21866894368725251])
def test_07_near_the_unstable_equilibrium(method: str, rotation: float) -> None:
    response = simulate(B6L, initial_rotation=rotation, method=method)
    assert response.outcome in (Outcome.ROCKED, Outcome.UNDECIDED)
    limit = 4e-16 / (B6L.slenderness - rotation) / P
    if response.outcome is Outcome.ROCKED:
        assert response.impact_times[0] == pytest.approx(
            quarter_period(rotation), abs=max(limit, allowed(response, response.impact_rates[0]))
        )
    assert method in ("rk4", "newmark", "dop853") or response.outcome is Outcome.ROCKED


@pytest.mark.parametrize("method", FREE)
def test_07_released_above_the_corner(method: str) -> None:
    response = simulate(B6L, initial_rotation=0.22085563533268138, method=method)
    assert response.outcome in (Outcome.OVERTURNED, Outcome.UNDECIDED)
    if response.outcome is Outcome.OVERTURNED:
        assert response.overturning_time == pytest.approx(0.981539406054123, abs=allowed(response, 5.0))
    assert method == "newmark" or response.outcome is Outcome.OVERTURNED


@pytest.mark.parametrize("step", [2.0 / P, 0.3])
def test_08_newmark_where_its_tangent_vanishes(step: float) -> None:
    with pytest.raises(MethodRefused, match=r"tangent .* vanishes at 2/p = 0.274199 s"):
        simulate(B6L, initial_rotation=0.15, method="newmark", step=step)


@pytest.mark.parametrize("step", [1e-5, 1e-7])
def test_08_newmark_below_its_residual(step: float) -> None:
    with pytest.raises(MethodRefused, match="rounding alone leaves a residual"):
        simulate(B6L, initial_rotation=0.15, method="newmark", step=step, duration=0.01)


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_08_steps_that_resolve_nothing_are_refused(method: str) -> None:
    with pytest.raises(MethodRefused, match=r"needs 0\.0685"):
        simulate(B6L, initial_rotation=0.15, method=method, step=0.1)
    with pytest.raises(MethodRefused, match=r"needs 0\.00685"):
        simulate(B6L, sine(3, 10), method=method, step=0.01)


@pytest.mark.parametrize(("method", "order"), [("rk4", 4), ("newmark", 2)])
def test_09_order_across_impacts(method: str, order: int) -> None:
    steps = (4e-3, 2e-3, 1e-3, 5e-4)
    errors = []
    for step in steps:
        response = simulate(B6L, initial_rotation=0.15, method=method, step=step)
        errors.append(abs(response.rotation(2.0) - FREE_ROTATION_AT_2))
        assert errors[-1] <= response.rotation_error
    slope = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert slope == pytest.approx(order, abs=0.2)


@pytest.mark.parametrize("method", ["rk4", "newmark"])
@pytest.mark.parametrize("rate", [50.0, 100.0])
def test_09_coarse_steps_do_not_topple_it(method: str, rate: float) -> None:
    response = simulate(B6L, initial_rotation=0.15, method=method, step=1.0 / rate)
    assert_honest(response, simulate(B6L, initial_rotation=0.15), 4.0)


def test_10_energy_without_loss() -> None:
    """Newmark's rates after 1000 s are the first ones; RK4 drifts, by less than it states."""
    arguments = {"initial_rotation": 0.15, "restitution": 1.0}
    newmark = simulate(B6L, **arguments, duration=1000.0, method="newmark")
    impacts = np.abs(newmark.impact_rates)
    # An impact falls anywhere in its step: the rate differs from flight to flight by the error of a step, and stays so.
    first, last = np.mean(impacts[:200]), np.mean(impacts[-200:])
    assert last == pytest.approx(first, rel=1e-7)
    exact = simulate(B6L, **arguments, duration=1000.0, method="closed-form")
    assert np.ptp(np.abs(exact.impact_rates)) == 0.0
    drifting = simulate(B6L, **arguments, duration=100.0, method="rk4")
    assert np.ptp(np.abs(drifting.impact_rates)) < 1e-8


@pytest.mark.parametrize("method", FREE[1:])
def test_10_without_loss_there_is_no_end(method: str) -> None:
    if method == "taylor":
        assert simulate(B6L, initial_rotation=0.1, restitution=1.0).rest_time is None
        return
    with pytest.raises(MethodRefused, match="never rests"):
        simulate(B6L, initial_rotation=0.1, restitution=1.0, method=method)


@pytest.mark.parametrize("method", FORCED)
def test_11_at_a_boundary(method: str) -> None:
    response = simulate(B6L, sine(1.130219301613210, 1), method=method)
    assert response.outcome is Outcome.UNDECIDED


@pytest.mark.parametrize("method", ["rk4", "newmark"])
def test_11_maps_are_never_quietly_wrong(method: str) -> None:
    decided = 0
    for frequency in np.geomspace(0.5, 8.0, 12):
        for amplitude in np.geomspace(0.5, 8.0, 12):
            truth = simulate(B6L, sine(amplitude, frequency)).outcome
            found = simulate(B6L, sine(amplitude, frequency), method=method).outcome
            assert found in (truth, Outcome.UNDECIDED)
            decided += found is truth
    # A few cells lie so near a boundary that two runs of a fixed step cannot answer for them.
    assert decided >= 140


@pytest.mark.parametrize("method", ["rk4", "newmark"])
@pytest.mark.parametrize("step", [1e-3, 8e-3])
def test_11_lasting_sines(method: str, step: float) -> None:
    """Coarse steps lose the track of these within seconds: two runs that both fall then prove nothing."""
    cells = [(a, w) for a in (1.2, 1.7, 2.1, 2.6, 4.0) for w in (1.0, 2.3, 4.0, 7.0)]
    for amplitude, frequency in [*cells, (1.467799267622069, 2.610157215682536), (3.831186849557287, 5.62341325190349)]:
        pulse = sine(amplitude, frequency, cycles=10.0 * frequency * P / (2 * math.pi))
        truth = simulate(B6L, pulse).outcome
        found = simulate(B6L, pulse, method=method, step=step).outcome
        assert found in (truth, Outcome.UNDECIDED) or truth is Outcome.UNDECIDED


def test_12_linear_models_answer_for_themselves() -> None:
    bulky = Block(0.12, 0.27)
    assert simulate(bulky, ConstantPulse(8.72, 0.0935)).outcome is Outcome.ROCKED
    linearised = simulate(bulky, ConstantPulse(8.72, 0.0935), model="linearised")
    assert linearised.outcome is Outcome.OVERTURNED
    assert linearised.model == "linearised"
