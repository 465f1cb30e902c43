"""Accelerations of a stack: the numbers of the issue, and two forms of the equations against each other."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

from tests.twin.stack.states import B6L, PAIR, TRIO, Chained, configurations
from twin.rocking.compiled import FloatArray
from twin.stack.stack import Stack

RATES = (0.2, -0.3)
PAIR_NUMBERS = [
    ((1, 1), (0.05, 0.08), (-0.781561382082159, -11.589971878356767)),
    ((1, -1), (0.05, 0.08), (-25.721240302887203, 44.88921551948799)),
    ((-1, -1), (0.05, 0.08), (-6.125283531498607, 19.150325160561962)),
    ((-1, 1), (0.05, 0.08), (20.978618857351783, -41.59448596217482)),
    ((1, -1), (0.08, 0.05), (-23.9347988213911, 41.8345976856055)),
    ((-1, -1), (-0.05, -0.08), (-8.37524457746775, 14.0177688092528)),
    ((-1, 1), (-0.05, 0.03), (15.8916998243728, -37.6159582818057)),
]


@pytest.mark.parametrize(("side", "rotations", "expected"), PAIR_NUMBERS)
def test_two_equal_blocks(side: tuple[int, int], rotations: tuple[float, float], expected: tuple[float, float]) -> None:
    assert Chained(PAIR, side, rotations, RATES).accelerations(1.0) == pytest.approx(expected, rel=2e-14)


def test_tied_and_resting_parts() -> None:
    tied = Chained(PAIR, (1, 0), (0.05, 0.05), (0.2, 0.2)).accelerations(1.0)
    assert tied == pytest.approx([-4.39750326597311] * 2, rel=1e-14)
    upper = Chained(PAIR, (0, 1), (0.0, 0.08), (0.0, -0.3)).accelerations(1.0)
    assert upper == pytest.approx([0.0, -12.725074053988857], rel=1e-14, abs=0.0)


@pytest.mark.parametrize("stack", [Stack([B6L]), PAIR, TRIO])
def test_the_series_solve_the_same_equations(stack: Stack) -> None:
    """Gap coordinates with positions, and rotations with constant vectors: one motion in every configuration."""
    for side in configurations(len(stack)):
        state = Chained.random(stack, side, seed=3)
        angles = state.series(a=1.3)
        assert 2.0 * angles[:, 2] * state.p**2 == pytest.approx(state.accelerations(1.3), rel=1e-11, abs=1e-11)


@pytest.mark.parametrize("stack", [PAIR, TRIO])
def test_energy_is_constant_between_events(stack: Stack) -> None:
    """Over a step on a still base, in all 8 and all 26 moving configurations: to 1e-12 of the energy moved about."""
    seen = 0
    for side in configurations(len(stack)):
        state = Chained.random(stack, side, seed=11)
        angles = state.series(a=0.0)
        powers = 0.06 ** np.arange(angles.shape[1])
        slopes = np.arange(1, angles.shape[1])
        before = state.energy(angles[:, 0], angles[:, 1])
        after = state.energy(angles @ powers, (angles[:, 1:] * slopes) @ powers[:-1])
        moved = state.kinetic_energy(angles[:, 0], angles[:, 1])
        assert after == pytest.approx(before, abs=1e-12 * (moved + abs(before)))
        seen += 1
    assert seen == 3 ** len(stack) - 1


@pytest.mark.parametrize("stack", [PAIR, TRIO])
def test_contacts_in_series_are_those_of_newton_and_euler(stack: Stack) -> None:
    for side in configurations(len(stack)):
        state = Chained.random(stack, side, seed=5)
        state.accelerations(0.7)
        normal, moment = state.place.normal.copy(), state.place.moment.copy()
        state.series(a=0.7)
        closed = [i for i, sign in enumerate(side) if sign == 0]
        weight = sum(stack.masses) * stack.gravity / state.p**2
        assert state.bench.series.normal[:, 0] == pytest.approx(normal, abs=1e-12 * weight)
        assert state.bench.series.moment[closed, 0] == pytest.approx(moment[closed], abs=1e-12 * weight)


def test_mirror_symmetry() -> None:
    for stack, seed in itertools.product((PAIR, TRIO), range(5)):
        for side in configurations(len(stack)):
            state = Chained.random(stack, side, seed=seed)
            mirrored = state.mirrored()
            accelerations: FloatArray = state.accelerations(0.4)
            assert np.array_equal(mirrored.accelerations(-0.4), -accelerations)
