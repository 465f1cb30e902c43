"""Many different blocks at once against the accurate solver, one by one."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from excitation import CosineWave, Pulse, SineWave
from tests.facts import B6L, BOUNDARIES, LIMIT, P
from twin.rocking.batch.codes import OVERTURNED, ROCKED, STAYED, UNDECIDED
from twin.rocking.batch.many import outcomes_of
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.run import parameters
from twin.simulation import overturns, simulate
from twin.uncertainty.motion import BaseMotion, scaled

COUNT = 150


def crowd(rng: np.random.Generator, count: int = COUNT) -> tuple[FloatArray, FloatArray]:
    """Return bodies and rotations of different blocks about B6L; every third stands upright."""
    bodies: list[FloatArray] = []
    for _ in range(count):
        alpha = B6L.slenderness * (1.0 + 0.1 * rng.standard_normal())
        diagonal = 2.0 * B6L.half_diagonal * (1.0 + 0.1 * rng.standard_normal())
        block = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))
        bodies.append(parameters(block, float(rng.uniform(0.7, 1.0))))
    rotations = np.where(np.arange(count) % 3 == 0, 0.0, 0.003 * rng.standard_normal(count))
    return np.array(bodies), rotations


def polygon(amplitude: float, frequency: float, knots: int = 80) -> FloatArray:
    """Return a sine as straight pieces."""
    t = np.linspace(0.0, 1.2 / frequency, knots)
    a = amplitude * np.sin(2.0 * math.pi * frequency * t) * (t < 1.0 / frequency)
    rows = np.zeros((knots - 1, 7))
    rows[:, 0], rows[:, 1], rows[:, 2] = t[:-1], t[1:], a[:-1]
    rows[:, 3] = np.diff(a) / np.diff(t)
    return rows


def check(bodies: FloatArray, rotations: FloatArray, motions: list[FloatArray], which: np.ndarray) -> None:
    longest = max(len(rows) for rows in motions)
    assert all(len(rows) == longest for rows in motions)
    found = outcomes_of(bodies, np.array(motions), which, rotations)
    for k in range(len(bodies)):
        expected = overturns(bodies[k], motions[which[k]], rotation=float(rotations[k]))
        assert bool(found.codes[k] == UNDECIDED) is (expected is None)
        if expected is not None:
            assert bool(found.codes[k] == OVERTURNED) is expected
        assert bool(found.directions[k] != 0) is bool(found.codes[k] == OVERTURNED)


@pytest.mark.parametrize("pulse", [SineWave(3.4, 2.0), CosineWave(4.5, 2.5), SineWave(3.0, 3.0, 3.0)])
def test_each_block_ends_as_the_accurate_solver_says(pulse: Pulse) -> None:
    bodies, rotations = crowd(np.random.default_rng(3))
    check(bodies, rotations, [pulse.pieces], np.zeros(COUNT, dtype=np.int64))


def test_straight_pieces_and_several_motions() -> None:
    rng = np.random.default_rng(4)
    bodies, rotations = crowd(rng)
    motions = [polygon(a, f) for a, f in ((3.2, 2.0), (4.0, 3.0), (2.0, 1.5), (2.2, 1.0))]
    check(bodies, rotations, motions, rng.integers(0, 4, COUNT))


def test_long_rocking_on_a_moving_base_is_decided_too() -> None:
    # A coast with friction: the bound of the error grows for seconds, the error does not.
    rows = np.array([[0.0, 0.12, 2.6, 0, 0, 0, 0], [0.12, 4.0, -0.02, 0, 0, 0, 0], [4.0, 4.3, 0, 0, -3.0, 10.47, 0]])
    bodies, rotations = crowd(np.random.default_rng(5), 60)
    check(bodies, rotations, [rows], np.zeros(60, dtype=np.int64))


def test_a_weaker_gravity_is_a_stronger_motion() -> None:
    bodies, rotations = crowd(np.random.default_rng(6))
    factors = 1.0 + 0.1 * np.random.default_rng(7).standard_normal(COUNT)
    lighter = bodies.copy()
    lighter[:, 2] /= factors
    lighter[:, 4] /= factors
    rows = SineWave(3.3, 2.2).pieces
    found = outcomes_of(lighter, rows[None], np.zeros(COUNT, dtype=np.int64), rotations)
    for k in range(COUNT):
        expected = overturns(bodies[k], scaled(rows, float(factors[k])), rotation=float(rotations[k]))
        assert bool(found.codes[k] == OVERTURNED) is expected


def test_the_answers_do_not_depend_on_their_company() -> None:
    bodies, rotations = crowd(np.random.default_rng(8), 1100)
    rows = polygon(3.2, 2.0)[None]
    everyone = outcomes_of(bodies, rows, np.zeros(1100, dtype=np.int64), rotations)
    some = outcomes_of(bodies[500:700], rows, np.zeros(200, dtype=np.int64), rotations[500:700])
    for whole, part in zip(everyone, some, strict=True):
        assert np.array_equal(whole[500:700], part)


def test_the_known_boundaries_of_facts() -> None:
    for frequency, edge, _ in BOUNDARIES:
        near = np.array([edge * (1.0 - 1e-9), edge * (1.0 + 1e-9)]) * LIMIT
        motions = np.array([SineWave(float(a), frequency * P / (2.0 * math.pi)).pieces for a in near])
        bodies = np.array([parameters(B6L, B6L.housner_restitution)] * 2)
        codes = outcomes_of(bodies, motions, np.arange(2), np.zeros(2)).codes
        assert sorted((codes == OVERTURNED).tolist()) == [False, True]


def test_below_the_threshold_nothing_moves() -> None:
    bodies = np.array([parameters(B6L, 0.9)] * 2)
    motions = np.array([polygon(0.999 * LIMIT, 2.0), polygon(1.001 * LIMIT, 2.0)])
    assert outcomes_of(bodies, motions, np.arange(2), np.zeros(2)).codes.tolist() == [STAYED, ROCKED]


def test_impacts_before_the_fall() -> None:
    rows = polygon(1.5 * LIMIT, 1.0)
    bodies = np.array([parameters(B6L, 0.92)])
    found = outcomes_of(bodies, rows[None], np.zeros(1, dtype=np.int64), np.zeros(1))
    response = simulate(B6L, BaseMotion(rows), restitution=0.92)
    before = [t for t in response.impact_times if t < (response.overturning_time or math.inf)]
    assert found.codes[0] == OVERTURNED
    assert found.impacts[0] == len(before)
    assert found.directions[0] == response.direction


def test_nobody() -> None:
    none = outcomes_of(np.zeros((0, 7)), polygon(1.0, 1.0)[None], np.zeros(0, dtype=np.int64), np.zeros(0))
    assert none.codes.size == 0


@settings(max_examples=40, deadline=None)
@given(
    st.lists(st.tuples(st.floats(0.002, 0.3), st.floats(-6.0, 6.0), st.floats(-60.0, 60.0)), min_size=1, max_size=12),
    st.floats(-0.05, 0.05),
    st.floats(0.3, 1.0),
)
def test_any_straight_pieces(parts: list[tuple[float, float, float]], rotation: float, eta: float) -> None:
    ends = np.cumsum([duration for duration, _, _ in parts])
    rows = np.zeros((len(parts), 7))
    rows[:, 1] = ends
    rows[1:, 0] = ends[:-1]
    rows[:, 2] = [value for _, value, _ in parts]
    rows[:, 3] = [slope for _, _, slope in parts]
    check(np.array([parameters(B6L, eta)]), np.array([rotation]), [rows], np.zeros(1, dtype=np.int64))
