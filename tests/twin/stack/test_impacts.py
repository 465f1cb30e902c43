"""Impacts: the numbers of the issue, both rules, and what every impact must keep or lose."""

from __future__ import annotations

import numpy as np
import pytest

from tests.twin.stack.states import B6L, PAIR, TRIO, Chained, configurations
from twin import Block
from twin.rocking.restitution import Improved
from twin.stack.solver.chain import ANGULAR_MOMENTUM, UNILATERAL
from twin.stack.stack import Stack

QUARTET = Stack([Block(0.06, 0.27), Block(0.05, 0.1), Block(0.1, 0.2), Block(0.04, 0.3)])


@pytest.mark.parametrize("rule", [UNILATERAL, ANGULAR_MOMENTUM])
@pytest.mark.parametrize(
    ("side", "rotations", "rates", "after", "expected"),
    [
        ((1, 0), (0.0, 0.0), (-1.0, -1.0), (-1, 0), (-0.9817073170731707, -0.9817073170731707)),
        ((1, 1), (0.05, 0.05), (0.3, -1.0), (1, -1), (0.156880733944954, -0.713761467889908)),
        ((1, 1), (0.0, 0.05), (-1.0, 0.4), (-1, 1), (-0.861116288461167, 0.152483349265111)),
    ],
)
def test_two_equal_blocks(
    rule: float,
    side: tuple[int, int],
    rotations: tuple[float, float],
    rates: tuple[float, float],
    after: tuple[int, int],
    expected: tuple[float, float],
) -> None:
    state = Chained(PAIR, side, rotations, rates, rule)
    assert state.strike() == 1
    assert tuple(state.state.side) == after
    assert state.rates_now() == pytest.approx(expected, abs=1e-15)


def test_where_the_rules_disagree() -> None:
    """The upper of two blocks lands on the resting one: it tips it over the other corner, or leaves it at rest."""
    state = Chained(PAIR, (0, 1), (0.0, 0.0), (0.0, -1.0), UNILATERAL)
    assert state.strike() == 1
    assert tuple(state.state.side) == (-1, -1)
    assert state.rates_now() == pytest.approx([-0.0555735549, -0.8499742715], abs=5e-11)
    state = Chained(PAIR, (0, 1), (0.0, 0.0), (0.0, -1.0), ANGULAR_MOMENTUM)
    assert state.strike() == 1
    assert tuple(state.state.side) == (0, -1)
    assert state.rates_now() == pytest.approx([0.0, -0.9294117647058824], abs=1e-15)


@pytest.mark.parametrize("k", [0.0, 0.3, 0.8, 1.0])
def test_one_block_with_the_impulse_inside(k: float) -> None:
    state = Chained(Stack([B6L], impulse_shares=[k]), (1,), (0.0,), (-1.0,))
    assert state.strike() == 1
    assert state.rates_now() == pytest.approx([-Improved(k).ratio(B6L)], abs=1e-15)


def test_a_bulky_block_sticks() -> None:
    state = Chained(Stack([Block(0.5, 0.1)]), (1,), (0.0,), (-1.0,))
    assert state.strike() == 1
    assert tuple(state.state.side) == (0,)
    assert state.rates_now()[0] == 0.0


def _about_to_strike(stack: Stack, side: tuple[int, ...], which: int, seed: int) -> Chained | None:
    """Return a state in which the gap of interface `which` is 0 and closing; None where it is closed."""
    if side[which] == 0:
        return None
    state = Chained.random(stack, side, seed)
    state.state.gap[which] = 0.0
    state.state.rate[which] = -side[which] * abs(state.state.rate[which])
    return state


@pytest.mark.parametrize("stack", [PAIR, TRIO, QUARTET])
def test_momentum_is_balanced_and_energy_lost(stack: Stack) -> None:
    """Angular momentum of every sub-stack about its pivot after the impact; one candidate fits, or none does."""
    counts = dict.fromkeys(("one", "lost", "none"), 0)
    for seed in range(3):
        for side in configurations(len(stack)):
            for which in range(len(stack)):
                state = _about_to_strike(stack, side, which, seed)
                if state is None:
                    continue
                before = state.rates_now()
                count = state.strike()
                if count != 1:
                    counts["lost" if count < 0 else "none"] += 1
                    assert count <= 0, (side, which, seed)
                    continue
                counts["one"] += 1
                after, sides = state.rates_now(), [int(sign) for sign in state.state.side]
                rotations = np.cumsum(state.state.gap)
                _, pivots = state.bodies(rotations, sides)
                scale = float(np.max(np.abs(before))) * stack.height**2 * sum(stack.masses)
                for part in range(len(stack)):
                    if sides[part] == 0:
                        continue
                    kept = state.angular_momentum(part, pivots[part], before, side)
                    now = state.angular_momentum(part, pivots[part], after, sides)
                    assert now == pytest.approx(kept, abs=1e-12 * scale)
                old, new = (
                    state.kinetic_energy(rotations, rates, signs) for rates, signs in ((before, side), (after, sides))
                )
                assert new <= old * (1.0 + 1e-12)
                assert state.bench.room.lost[0] * state.p**2 == pytest.approx(old - new, abs=1e-12 * old)
    assert counts["one"] > 10 * (counts["lost"] + counts["none"]), counts


def test_mirrored_impacts() -> None:
    for side in configurations(3):
        for which in range(3):
            state = _about_to_strike(TRIO, side, which, seed=8)
            if state is None:
                continue
            other = state.mirrored()
            assert state.strike() == other.strike()
            assert np.array_equal(other.state.side, -state.state.side)
            assert np.array_equal(other.state.rate, -state.state.rate)
