"""Closed forms against the table of facts, against theory, and against the integrator that solves the same equation."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, Record, SineWave
from tests.facts import B6L, P
from twin import Block, Outcome, simulate
from twin.rocking.methods import MethodRefused
from twin.rocking.methods.elliptic import position, series_position
from twin.rocking.methods.flight import carlson, flight_series, from_turning, turning

ALPHA = B6L.slenderness
WEIGHT = B6L.gravity * ALPHA  # g alpha: uplift of the linearised model


def wave(amplitude: float, frequency: float, *, cosine: bool = False, cycles: float = 1.0) -> Pulse:
    kind = CosineWave if cosine else SineWave
    return kind(amplitude * WEIGHT, frequency * P / (2 * math.pi), cycles)


@pytest.mark.parametrize(("model", "quarter"), [("linearised", 0.250314513548138), ("quasi-linear", 0.248321744239537)])
def test_quarter_periods(model: str, quarter: float) -> None:
    response = simulate(B6L, initial_rotation=0.15, model=model)
    assert response.method == "closed-form"
    assert response.impact_times[0] == pytest.approx(quarter, abs=2e-15)
    assert response.rotation_error < 1e-12


def test_linearised_rest() -> None:
    response = simulate(B6L, initial_rotation=0.15, model="linearised")
    assert response.rest_time == pytest.approx(4.18419120279822, abs=2e-14)
    rates = np.abs(response.impact_rates)
    assert rates == pytest.approx(rates[0] * response.restitution ** np.arange(rates.size), rel=1e-12)


@pytest.mark.parametrize(("model", "critical"), [("linearised", 0.0900974), ("quasi-linear", 0.1008408)])
def test_critical_durations_of_a_bulky_block(model: str, critical: float) -> None:
    bulky = Block(0.12, 0.27)
    assert simulate(bulky, ConstantPulse(8.72, critical - 1e-7), model=model).outcome is Outcome.ROCKED
    assert simulate(bulky, ConstantPulse(8.72, critical + 1e-7), model=model).outcome is Outcome.OVERTURNED


@pytest.mark.parametrize("amplitude", [1.2, 2.0, 5.0])
def test_linear_theory_of_the_constant_pulse(amplitude: float) -> None:
    critical = math.log(amplitude / (amplitude - 1.0)) / P
    for factor, outcome in ((1.0 - 1e-11, Outcome.ROCKED), (1.0 + 1e-11, Outcome.OVERTURNED)):
        pulse = ConstantPulse(amplitude * WEIGHT, critical * factor)
        assert simulate(B6L, pulse, model="linearised").outcome is outcome


def test_uplift_of_the_linearised_model() -> None:
    between = 0.5 * (WEIGHT + B6L.uplift_acceleration)
    assert simulate(B6L, ConstantPulse(between, 0.1), model="linearised").uplift_time == 0.0
    assert simulate(B6L, ConstantPulse(between, 0.1)).outcome is Outcome.STAYED
    assert simulate(B6L, ConstantPulse(WEIGHT, 0.1), model="linearised").outcome is Outcome.STAYED


@given(st.floats(1.05, 5.0), st.floats(0.5, 6.0), st.booleans())
@settings(max_examples=60, deadline=None)
def test_overturning_integral_of_linear_theory(amplitude: float, frequency: float, cosine: bool) -> None:
    """No impact before the pulse ends: overturns iff p / g times the integral of exp(-p (t - t0)) a exceeds alpha."""
    pulse = wave(amplitude, frequency, cosine=cosine)
    response = simulate(B6L, pulse, model="linearised")
    start = response.uplift_time
    assert start is not None
    inside = response.impact_times[response.impact_times <= pulse.duration]
    lies = response.overturning_time
    if inside.size or (lies is not None and lies <= pulse.duration):
        return
    t = start + np.linspace(0.0, pulse.duration - start, 20001)
    a = np.asarray(pulse.acceleration(t[:-1] + 0.5 * (t[1] - t[0])))
    middle = t[:-1] - start + 0.5 * (t[1] - t[0])
    sign = math.copysign(1.0, float(pulse.acceleration(start + 1e-9)))
    total = sign * P / B6L.gravity * float(np.sum(np.exp(-P * middle) * a)) * (t[1] - t[0])
    if abs(total - ALPHA) > 1e-5:
        # The rule is for the side that was lifted; a block that stands it may still fall over the other one.
        assert (response.outcome is Outcome.OVERTURNED and not response.impact_times.size) == (total > ALPHA)


pulses = st.one_of(
    st.builds(wave, st.floats(0.5, 6.0), st.floats(0.3, 8.0), cosine=st.booleans(), cycles=st.floats(0.3, 2.5)),
    st.builds(lambda a, d: ConstantPulse(a * WEIGHT, d), st.floats(-5.0, 5.0).filter(bool), st.floats(0.02, 0.4)),
    st.builds(DoublePulse, st.floats(0.1, 0.6), st.floats(0.005, 0.03), st.floats(0.0, 0.5)),
    st.builds(
        lambda values: Record(np.array([0.0, *values, 0.0]) * WEIGHT, 0.04),
        st.lists(st.floats(-3.0, 3.0), min_size=3, max_size=8),
    ),
)


@given(pulses, st.floats(0.3, 0.98), st.floats(-0.1, 0.1))
@settings(max_examples=25, deadline=None)
def test_linearised_against_dop853(pulse: Pulse, eta: float, rotation: float) -> None:
    arguments = {"model": "linearised", "restitution": eta, "initial_rotation": rotation, "duration": pulse.duration}
    closed = simulate(B6L, pulse, **arguments)
    stepped = simulate(B6L, pulse, **arguments, method="dop853", tolerance=1e-12)
    assert Outcome.UNDECIDED in (closed.outcome, stepped.outcome) or closed.outcome is stepped.outcome
    t = np.linspace(0.0, min(closed.end_time, stepped.end_time, pulse.duration), 200)
    slack = 1e-10 + stepped.rotation_error + closed.rotation_error
    assert closed.rotation(t) == pytest.approx(stepped.rotation(t), abs=slack)


@given(st.floats(1.2, 60.0), st.floats(0.1, 1.5), st.floats(0.4, 0.98), st.floats(-0.2, 0.2))
@settings(max_examples=25, deadline=None)
def test_quasi_linear_against_dop853(amplitude: float, length: float, eta: float, rotation: float) -> None:
    """Up to 60 g tan(alpha): where cos(alpha) < (a0 / g) sin(alpha), above 4.5 g, the solution is trigonometric."""
    pulse = ConstantPulse(amplitude * B6L.uplift_acceleration, length / P)
    arguments = {"model": "quasi-linear", "restitution": eta, "initial_rotation": rotation, "duration": 2 * length / P}
    closed = simulate(B6L, pulse, **arguments)
    stepped = simulate(B6L, pulse, **arguments, method="dop853", tolerance=1e-12)
    assert Outcome.UNDECIDED in (closed.outcome, stepped.outcome) or closed.outcome is stepped.outcome
    t = np.linspace(0.0, min(closed.end_time, stepped.end_time, 2 * length / P), 200)
    slack = 1e-10 + stepped.rotation_error + closed.rotation_error
    assert closed.rotation(t) == pytest.approx(stepped.rotation(t), abs=slack)


def test_quasi_linear_turns_trigonometric() -> None:
    """a = 6 g towards the lifted side: phi'' = -m^2 phi - q, so phi = (phi0 + q / m^2) cos(m x) - q / m^2."""
    load = 6.0
    m = math.sqrt(load * math.sin(ALPHA) - math.cos(ALPHA))
    assert math.cos(ALPHA) < load * math.sin(ALPHA)
    q = math.sin(ALPHA) + load * math.cos(ALPHA)
    response = simulate(
        B6L, ConstantPulse(load * B6L.gravity, 0.1), initial_rotation=0.2, model="quasi-linear", duration=0.1
    )
    contact = math.acos(q / m**2 / (0.2 + q / m**2)) / m
    assert response.impact_times[0] == pytest.approx(contact / P, rel=1e-14)
    x = 0.7 * contact
    expected = (0.2 + q / m**2) * math.cos(m * x) - q / m**2
    assert response.rotation(x / P) == pytest.approx(expected, abs=1e-15)


def test_quasi_linear_under_a_wave_has_no_closed_form() -> None:
    with pytest.raises(MethodRefused, match="constant accelerations only"):
        simulate(B6L, wave(2, 2), model="quasi-linear", method="closed-form")
    assert simulate(B6L, wave(2, 2), model="quasi-linear").method == "dop853"


def test_a_bulky_block_has_no_quasi_linear_equilibrium() -> None:
    with pytest.raises(MethodRefused, match="must lie below pi/2"):
        simulate(Block(1.0, 0.5), initial_rotation=0.2, model="quasi-linear")


@given(st.floats(0.001, 0.999), st.floats(0.5, 0.99), st.floats(0.03, 0.3), st.floats(0.2, 1.0))
@settings(max_examples=30, deadline=None)
def test_free_rocking_is_what_the_series_steps_through(share: float, eta: float, width: float, height: float) -> None:
    from twin.rocking.run import Run, initial_state, parameters

    block = Block(width, height)
    start = share * block.slenderness
    response = simulate(block, initial_rotation=start, restitution=eta, method="closed-form")
    body = parameters(block, eta)
    run = Run(body, initial_state(body, start))
    run.advance_free()
    stepped = run.events[run.events[:, 2] == 1.0]
    # The stepped run is the less accurate of the two: see the forty digits below.
    slack = 1e-13 * (1.0 + 0.1 * len(stepped)) / (1.0 - share)
    assert response.impact_times == pytest.approx(stepped[:, 0], abs=slack)
    assert response.impact_rates == pytest.approx(stepped[:, 1], abs=1e-12)
    assert response.rest_time == pytest.approx(run.time, abs=slack)


@pytest.mark.parametrize(("share", "eta"), [(0.5, 0.984375), (0.9, 0.93), (0.999, 0.7), (0.01, 0.99)])
def test_free_rocking_to_forty_digits(share: float, eta: float) -> None:
    """R_F by duplication in decimal arithmetic, summed over 150 flights."""
    from decimal import Decimal, localcontext

    block = Block(0.25, 1.0)
    start = share * block.slenderness
    response = simulate(block, initial_rotation=start, restitution=eta)
    with localcontext() as context:
        context.prec = 40

        def sine_of(x: Decimal) -> Decimal:
            total = term = x
            n = 1
            while abs(term) > Decimal("1e-42"):
                term *= -x * x / ((n + 1) * (n + 2))
                n += 2
                total += term
            return total

        def carlson_of(x: Decimal, y: Decimal, z: Decimal) -> Decimal:
            for _ in range(66):
                shift = (x * y).sqrt() + (y * z).sqrt() + (x * z).sqrt()
                x, y, z = (x + shift) / 4, (y + shift) / 4, (z + shift) / 4
            return 1 / x.sqrt()

        base = sine_of(Decimal(block.slenderness) / 2)
        half = sine_of((Decimal(block.slenderness) - Decimal(start)) / 2)
        v = 2 * ((base - half) * (base + half)).sqrt()
        time = Decimal(0)
        p = Decimal(block.frequency_parameter)
        for n, (found, rate) in enumerate(
            zip(response.impact_times[:150].tolist(), response.impact_rates[:150].tolist(), strict=True)
        ):
            square = (base - v / 2) * (base + v / 2)
            tangent = v * v / (4 * square * (1 - base * base))
            quarter = tangent.sqrt() * carlson_of(Decimal(1), 1 + square * tangent, 1 + tangent) / p
            time += quarter if n == 0 else 2 * quarter
            assert abs(Decimal(found) - time) < Decimal("4e-15") * (1 + time) / Decimal(str(1.0 - share))
            assert abs(abs(Decimal(rate)) - v * p) < Decimal("1e-14")
            v *= Decimal(eta)


@given(st.floats(0.0, 0.5), st.floats(-0.5, 0.5), st.floats(0.0, 3.0))
@settings(max_examples=200, deadline=None)
def test_elliptic_position_is_the_taylor_one(phi: float, v: float, x: float) -> None:
    expected = series_position(phi, ALPHA - phi, v, x)
    if not -1.0 < expected[0] < 1.7:
        return
    found = position(ALPHA, phi, ALPHA - phi, v, x)
    assert found == pytest.approx(expected, abs=1e-13 * math.exp(x))


def test_carlson_integral() -> None:
    from scipy.special import elliprf

    for y in np.geomspace(1e-12, 1e12, 25):
        assert carlson(0.0, y, 1.0) == pytest.approx(float(elliprf(0.0, y, 1.0)), rel=1e-15)
        assert carlson(1.0, y, 2.0) == pytest.approx(float(elliprf(1.0, y, 2.0)), rel=1e-15)


def test_flight_series_meets_the_integral() -> None:
    b = flight_series(ALPHA)
    v = 0.04
    total = float(np.sum(b * v ** (2 * np.arange(b.size) + 1)))
    assert total == pytest.approx(2 * from_turning(ALPHA, v, turning(ALPHA, v)), rel=1e-15)


def test_motion_at_the_instants_between() -> None:
    response = simulate(B6L, wave(1.6, 2.0, cycles=2.5), model="linearised")
    t = np.linspace(0.05, 2.0, 400)
    clear = np.min(np.abs(t[:, None] - response.impact_times[None, :]), axis=1) > 1e-3
    clear &= t < (response.rest_time or response.overturning_time or 9.0) - 1e-3
    h = 1e-6
    slope = (np.asarray(response.rotation(t + h)) - np.asarray(response.rotation(t - h))) / (2 * h)
    assert np.asarray(response.angular_velocity(t))[clear] == pytest.approx(slope[clear], abs=1e-7)
    for impact in response.impact_times:
        assert response.rotation(float(impact)) == pytest.approx(0.0, abs=1e-14)
