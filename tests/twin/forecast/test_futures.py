"""Futures sixteen at a time against the exact solver, the closed forms and the mirror."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, Record, SineWave
from excitation.pieces import assemble
from tests.facts import B6L, LIMIT, P
from tests.twin.forecast.exact import Start, exact_fate, fast_fates, near_a_boundary
from twin.forecast.futures import energy_margins
from twin.forecast.step import CALM, FLIGHT
from twin.rocking.block import Block
from twin.rocking.response import Outcome
from twin.rocking.verdict import barrier_margins
from twin.simulation import simulate

ALPHA, ETA = B6L.slenderness, B6L.housner_restitution
AT_REST = Start(0.0, 0.0, 0.0, ALPHA, ETA)


def random_pulse(rng: np.random.Generator, kind: int) -> Pulse:
    amplitude, hertz = LIMIT * rng.uniform(0.9, 4.0), P * rng.uniform(0.6, 6.0) / math.tau
    if kind == 0:
        return SineWave(amplitude, hertz)
    if kind == 1:
        return CosineWave(amplitude, hertz)
    if kind == 2:
        return ConstantPulse(amplitude, rng.uniform(0.02, 1.0) / P)
    if kind == 3:
        return DoublePulse(rng.uniform(0.1, 0.9), rng.uniform(0.01, 0.05))
    if kind == 4:
        return SineWave(0.7 * amplitude, hertz, float(rng.integers(2, 9)))
    noise = np.convolve(rng.standard_normal(300), np.hanning(12), "same")
    return Record(noise / np.max(np.abs(noise)) * 0.7 * amplitude, 0.01)


def random_start(rng: np.random.Generator) -> Start:
    alpha, eta = ALPHA * (1.0 + 0.01 * rng.standard_normal()), min(1.0, ETA * (1.0 + 0.05 * rng.standard_normal()))
    if rng.random() < 0.3:
        return Start(0.0, 0.0, 0.0, alpha, eta)
    phi, rate = 1.2 * alpha * rng.random() ** 2, 1.8 * math.sin(0.5 * alpha) * rng.uniform(-1.0, 1.0)
    if rng.random() < 0.2:
        phi, rate = 0.0, abs(rate)
    return Start(float(rng.choice([-1.0, 1.0])), phi, rate, alpha, eta)


@pytest.mark.parametrize("kind", range(6))
def test_outcomes_are_those_of_the_exact_solver(kind: int) -> None:
    """Any state at any instant: a wrong outcome only near a boundary, and times of overturning within 2 ms."""
    rng = np.random.default_rng([2, kind])
    late: list[float] = []
    for _ in range(12):
        pulse = random_pulse(rng, kind)
        time = pulse.duration * rng.random() * rng.integers(0, 2)
        starts = [random_start(rng) for _ in range(16)]
        for start, fast in zip(starts, fast_fates(B6L, starts, time, pulse.pieces), strict=True):
            exact = exact_fate(B6L, start, time, pulse.pieces)
            if (fast.margin < 0.0) != (exact.margin < 0.0):
                assert near_a_boundary(B6L, start, time, pulse.pieces), (pulse, time, start)
            elif exact.margin < 0.0:
                late.append(abs(fast.fall - exact.fall))
    if late:
        assert np.median(late) < 1e-5
        assert np.percentile(late, 90) < 2e-3


@pytest.mark.parametrize("pause", [0.05, 0.4, 1.5, 6.0])
def test_outcomes_over_a_pause_are_those_of_the_exact_solver(pause: float) -> None:
    """Two blows with a still base between them, one interval: what rests there, and what still rocks when it ends."""
    rng = np.random.default_rng([4, round(100 * pause)])
    wrong = 0
    for _ in range(12):
        first, second = random_pulse(rng, 0).pieces, random_pulse(rng, 0).pieces.copy()
        end = float(first[-1, 1])
        second[:, :2] += end + pause
        still = np.array([[end, end + pause, 0.0, 0.0, 0.0, 0.0, 0.0]])
        pieces = np.concatenate([first, still, second])
        starts = [random_start(rng) for _ in range(16)]
        for start, fast in zip(starts, fast_fates(B6L, starts, 0.0, pieces), strict=True):
            if (fast.margin < 0.0) != (exact_fate(B6L, start, 0.0, pieces).margin < 0.0):
                wrong += 1
                assert near_a_boundary(B6L, start, 0.0, pieces), (first, second, start)
    assert wrong <= 2


@given(alpha=st.floats(0.02, 1.5), eta=st.floats(0.0, 0.99), x=st.floats(1e-3, CALM))
@settings(max_examples=60)
def test_impacts_end_no_later_than_the_bound_says(alpha: float, eta: float, x: float) -> None:
    block = Block(math.sin(alpha), math.cos(alpha))
    p, rate = block.frequency_parameter, x * math.sqrt(alpha * math.sin(alpha))
    response = simulate(block, restitution=eta, initial_angular_velocity=p * rate)
    assert response.rest_time is not None
    flights = FLIGHT * rate / (math.sin(alpha) * (1.0 - eta))
    assert p * response.rest_time <= flights * (1.0 + 1e-9)


def test_known_answers() -> None:
    """The facts' sine A = 3, W = 3: pi/2 at 0.88966 s; A = 1 never moves; the critical constant pulse, to 1e-6."""
    sine = SineWave(3.0 * LIMIT, 3.0 * P / math.tau)
    (fate,) = fast_fates(B6L, [AT_REST], 0.0, sine.pieces)
    assert fate.fall == pytest.approx(0.889657851683760, abs=2e-5)
    (fate,) = fast_fates(B6L, [AT_REST], 0.0, SineWave(LIMIT, 3.0 * P / math.tau).pieces)
    assert fate == (1.0, math.inf)
    for share, falls in ((1.0 - 1e-6, False), (1.0 + 1e-6, True)):
        pulse = ConstantPulse(2.0 * LIMIT, 0.0951960321927143 * share)
        (fate,) = fast_fates(B6L, [AT_REST], 0.0, pulse.pieces)
        assert (fate.margin < 0.0) is falls


@pytest.mark.parametrize("kind", range(6))
def test_the_mirror_image_falls_to_the_other_side(kind: int) -> None:
    rng = np.random.default_rng([3, kind])
    pulse = random_pulse(rng, kind)
    rows = pulse.pieces.copy()
    rows[:, 2:5] *= -1.0
    starts = [random_start(rng) for _ in range(16)]
    assert fast_fates(B6L, starts, 0.0, rows) == fast_fates(
        B6L, [start._replace(side=-start.side) for start in starts], 0.0, pulse.pieces
    )


@given(
    phi=st.floats(0.0, 0.4),
    rate=st.floats(-0.5, 0.5),
    width=st.floats(0.03, 0.2),
)
@settings(max_examples=60)
def test_the_rule_after_the_pulse_is_the_long_simulation(phi: float, rate: float, width: float) -> None:
    block = Block(width, 0.27)
    p, alpha, eta = block.frequency_parameter, block.slenderness, block.housner_restitution
    rate = abs(rate) if phi == 0.0 else rate
    ahead, around = energy_margins(alpha, eta, alpha - phi, rate)
    response = simulate(block, initial_rotation=phi, initial_angular_velocity=p * rate)
    if min(abs(ahead), abs(around)) > 1e-9 and response.outcome is not Outcome.UNDECIDED:
        assert (min(ahead, around) < 0.0) == (response.outcome is Outcome.OVERTURNED)
        if phi > 0.0 or rate > 0.0:
            start = Start(1.0, phi, rate, alpha, eta)
            (fate,) = fast_fates(block, [start], 0.0, assemble([]))
            assert (fate.margin < 0.0) == (response.outcome is Outcome.OVERTURNED)
            if fate.margin < 0.0:
                assert fate.fall == pytest.approx(response.overturning_time, rel=1e-9)


@given(psi=st.floats(-0.5, 0.5), rate=st.floats(-0.6, 0.6), alpha=st.floats(0.05, 0.6), eta=st.floats(0.0, 1.0))
def test_the_margins_have_the_signs_of_the_barriers(psi: float, rate: float, alpha: float, eta: float) -> None:
    psi = min(psi, alpha)
    energies, rates = energy_margins(alpha, eta, psi, rate), barrier_margins(alpha, eta, psi, rate)
    if abs(rates[0]) > 1e-12:
        assert (energies[0] < 0.0) == (rates[0] > 0.0)
    if rates[0] < -1e-12 and abs(rates[1]) > 1e-12:
        assert (energies[1] < 0.0) == (rates[1] > 0.0)


def test_what_the_margin_measures() -> None:
    """1 on the base at rest, 0 balanced; a block let go from a rotation misses the rest of the way up."""
    assert energy_margins(ALPHA, ETA, ALPHA, 0.0)[0] == pytest.approx(1.0)
    assert energy_margins(ALPHA, ETA, 0.0, 0.0)[0] == 0.0
    phi = 0.1
    share = (1.0 - math.cos(ALPHA - phi)) / (1.0 - math.cos(ALPHA))
    assert energy_margins(ALPHA, ETA, ALPHA - phi, 0.0)[0] == pytest.approx(share)
