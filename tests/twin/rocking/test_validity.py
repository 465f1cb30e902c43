"""Reactions against closed forms, momentum, and the motion of the centre of mass itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, Record, SineWave
from tests.facts import B6L, LIMIT, P, constant, sine
from twin import Block, Outcome, simulate
from twin.rocking.response import Response
from twin.rocking.validity import Validity, impact_friction, reactions, validity

ALPHA = B6L.slenderness
blocks = st.builds(Block, width=st.floats(0.03, 0.3), height=st.floats(0.2, 1.0))


def centre(block: Block, response: Response, t: float) -> tuple[float, float]:
    """Return where the centre of mass is over the base, m, from the geometry of a tilted block."""
    theta = float(response.rotation(t))
    side = math.copysign(1.0, theta)
    half_width, half_height = side * 0.5 * block.width, 0.5 * block.height
    corner = half_width  # the corner it turns about stays where it stood
    x = corner - half_width * math.cos(theta) + half_height * math.sin(theta)
    return x, half_width * math.sin(theta) + half_height * math.cos(theta)


@pytest.mark.parametrize(
    ("pulse", "rotation"), [(sine(3.0, 6.0), 0.0), (sine(1.25, 2.0), 0.0), (None, 0.15), (sine(-4.0, 8.0), 0.05)]
)
def test_the_forces_accelerate_the_centre_of_mass(pulse: SineWave | None, rotation: float) -> None:
    """m x'' = T and m z'' = N - m g, by finite differences of the position: nothing of the equation is used."""
    response = simulate(B6L, pulse, initial_rotation=rotation, tolerance=1e-13)
    g, h = B6L.gravity, 2e-4
    start = response.uplift_time or 0.0
    events = np.array([start, *response.impact_times, *(pulse.breakpoints if pulse is not None else [])])
    compared = 0
    for t in np.linspace(start, min(response.end_time, start + 0.6), 97)[1:-1].tolist():
        if np.min(np.abs(events - t)) < 3 * h or response.rotation(t) == 0.0:
            continue
        points = np.array([centre(B6L, response, t + k * h) for k in (-1, 0, 1)])
        if response.outcome is Outcome.OVERTURNED and response.overturning_time and t > response.overturning_time - h:
            break
        x2, z2 = (points[0] - 2.0 * points[1] + points[2]) / h**2
        base = 0.0 if pulse is None else float(pulse.acceleration(t))
        tangential, normal = reactions(response, pulse, np.array([t]))
        assert tangential[0] * g == pytest.approx(base + x2, abs=2e-3)
        assert normal[0] * g == pytest.approx(g + z2, abs=2e-3)
        compared += 1
    assert compared > 60


def test_at_rest_the_base_pushes_what_it_accelerates() -> None:
    pulse = sine(0.9, 2.0)
    found = validity(simulate(B6L, pulse), pulse)
    assert found.friction_needed == pytest.approx(0.9 * math.tan(ALPHA), rel=1e-6)
    assert (found.least_normal, found.impact_friction, found.lift_off_time) == (1.0, None, None)
    assert found.holds


def test_uplift_is_at_friction_tan_alpha() -> None:
    pulse = sine(1.25, 2.0)
    response = simulate(B6L, pulse)
    uplift = response.uplift_time
    assert uplift is not None
    tangential, normal = reactions(response, pulse, np.array([uplift * (1.0 - 1e-9), uplift, uplift + 1e-9]))
    assert np.abs(tangential) / normal == pytest.approx(math.tan(ALPHA), rel=1e-6)


def test_a_sudden_push_is_felt_from_its_first_instant() -> None:
    """A constant pulse of A g tan(alpha) lifts at once: f = -A tan(alpha), v = 0, phi = 0."""
    pulse = constant(2.0, 0.09)
    found = validity(simulate(B6L, pulse), pulse)
    s, c, f = math.sin(ALPHA), math.cos(ALPHA), -2.0 * math.tan(ALPHA)
    w = -s - f * c
    assert found.friction_needed == pytest.approx(abs(f + 0.75 * w * c) / (1.0 + 0.75 * w * s), rel=1e-12)
    assert found.friction_time == 0.0


def test_free_rocking() -> None:
    """Released from rest at phi0, the block strikes at v2 = 2 (cos(alpha - phi0) - cos(alpha)), where N is least."""
    response = simulate(B6L, initial_rotation=0.15)
    found = validity(response, None)
    s, c = math.sin(ALPHA), math.cos(ALPHA)
    v2 = 2.0 * (math.cos(ALPHA - 0.15) - c)
    assert found.least_normal == pytest.approx(1.0 - 0.75 * (s * s + v2 * c), rel=1e-9)
    assert found.least_normal_time == pytest.approx(response.impact_times[0], abs=1e-12)
    # In its smallest flights the block asks for as much friction as an impact does.
    assert found.friction_needed == pytest.approx(0.75 * s * c / (1.0 - 0.75 * s * s), rel=1e-6)
    assert found.impact_friction == pytest.approx(0.75 * s * c / (1.0 - 0.75 * s * s), rel=1e-12)


@given(blocks)
@settings(max_examples=30, deadline=None)
def test_housner_impulses(block: Block) -> None:
    alpha = block.slenderness
    if block.housner_restitution > 0.0:
        expected = 3.0 * math.sin(alpha) * math.cos(alpha) / (4.0 - 3.0 * math.sin(alpha) ** 2)
        assert impact_friction(block, block.housner_restitution) == pytest.approx(expected, rel=1e-12)
    assert impact_friction(block, 1.0) == 0.0
    assert impact_friction(block, 0.0) == pytest.approx(1.0 / math.tan(alpha))


def test_impulse_and_angular_momentum_agree() -> None:
    """Housner: the impulse acts at the new corner, so its moment about the centre changes the spin."""
    eta, alpha, radius, v0 = B6L.housner_restitution, ALPHA, B6L.half_diagonal, 1.3
    across, up = radius * v0 * (1.0 - eta) * math.cos(alpha), radius * v0 * (1.0 + eta) * math.sin(alpha)
    # Moment about the centre of an impulse at the corner (b/2, -h/2) from it; moment of inertia m R2 / 3.
    spin = (0.5 * B6L.width * up - 0.5 * B6L.height * across) / (radius * radius / 3.0)
    assert spin == pytest.approx((1.0 - eta) * v0, rel=1e-12)


def test_the_extremes_are_those_of_a_dense_grid() -> None:
    pulse = sine(2.5, 5.0)
    response = simulate(B6L, pulse)
    found = validity(response, pulse)
    t = np.linspace(0.0, found.until, 400_001)
    tangential, normal = reactions(response, pulse, t)
    ratio = np.abs(tangential) / normal
    assert found.friction_needed >= ratio.max() * (1.0 - 1e-12)
    assert found.friction_needed == pytest.approx(ratio.max(), rel=1e-5)
    assert found.least_normal <= normal.min() + 1e-12
    assert found.least_normal == pytest.approx(normal.min(), abs=1e-5)


def test_sliding_is_dated() -> None:
    pulse = sine(1.25, 2.0)
    response = simulate(B6L, pulse)
    needed = validity(response, pulse).friction_needed
    assert validity(response, pulse, friction=needed * 1.001).sliding_time is None
    # Below tan(alpha) the block slides before it can rock: where |a| passes mu g.
    early = validity(response, pulse, friction=0.2).sliding_time
    assert early is not None
    assert pulse.acceleration(early) == pytest.approx(0.2 * B6L.gravity, rel=1e-9)
    # Enough for every flight, too little for the impacts: they come first in a run that starts tilted on ice.
    free = simulate(B6L, initial_rotation=0.02, restitution=0.5)
    found = validity(free, None, friction=0.3)
    assert found.impact_friction is not None
    assert found.impact_friction > 0.3 > found.friction_needed
    assert found.sliding_time == free.impact_times[0]
    assert not found.holds


def test_a_block_thrown_up_leaves_the_base() -> None:
    """A rate of 1.6 p on B6L: N = 1 - 3/4 (sin2 alpha + 2.56 cos alpha) is negative from the start."""
    response = simulate(B6L, initial_angular_velocity=1.6 * P)
    found = validity(response, None)
    assert found.lift_off_time == 0.0
    assert found.friction_needed == math.inf
    assert found.least_normal < 0.0
    assert not found.holds


def test_lift_off_within_a_flight_is_dated() -> None:
    """A strong push the other way stops the flight: N falls through zero where the equation says so."""
    pulse = Record(np.array([-6.0, -6.0, 60.0, 60.0, 0.0]) * LIMIT, 0.05)
    response = simulate(B6L, pulse)
    found = validity(response, pulse)
    assert found.lift_off_time is not None
    assert found.lift_off_time > 0.0
    before, after = found.lift_off_time * (1.0 - 1e-7), found.lift_off_time * (1.0 + 1e-7)
    _, normal = reactions(response, pulse, np.array([before, after]))
    assert normal[0] > 0.0 >= normal[1]


def test_a_falling_block_is_judged_until_it_passes_alpha() -> None:
    pulse = sine(3.0, 3.0)
    response = simulate(B6L, pulse)
    found = validity(response, pulse)
    assert response.outcome is Outcome.OVERTURNED
    assert abs(response.rotation(found.until)) == pytest.approx(ALPHA, abs=1e-9)
    assert found.friction_time <= found.until


@pytest.mark.parametrize("friction", [0.0, -1.0, math.nan, math.inf])
def test_friction_is_a_number_above_0(friction: float) -> None:
    with pytest.raises(ValueError, match="friction"):
        validity(simulate(B6L), None, friction=friction)


def test_mirror() -> None:
    one, other = sine(2.0, 5.0), sine(-2.0, 5.0)
    here, there = (validity(simulate(B6L, pulse), pulse, friction=0.25) for pulse in (one, other))
    assert isinstance(here, Validity)
    assert here == there


@pytest.mark.parametrize("pulse", [CosineWave(4.0, 3.0), ConstantPulse(3.0, 0.05), ConstantPulse(0.1, 1.0)])
def test_a_cut_run_is_judged_to_its_end(pulse: CosineWave | ConstantPulse) -> None:
    found = validity(simulate(B6L, pulse, duration=0.04), pulse)
    assert found.until <= pulse.duration
    assert found.least_normal_time <= found.until
