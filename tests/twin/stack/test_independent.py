"""Whole histories against an independent code: bodies' own coordinates, contacts as constraints, SciPy's DOP853."""

from __future__ import annotations

import numpy as np
import pytest

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, SineWave
from tests.twin.stack.independent import Body, IndependentStack
from twin.rocking.block import Block
from twin.stack.response import Ending, StackResponse
from twin.stack.simulation import simulate_stack
from twin.stack.stack import Stack

PAIR = [Body(0.06, 0.27, 1.0), Body(0.06, 0.27, 1.0)]
W = np.array([0.2, -0.3])


@pytest.mark.parametrize(
    ("sides", "rotations", "rates", "accelerations"),
    [
        ((1, 1), (0.05, 0.08), W, (-0.781561382082159, -11.589971878356767)),
        ((1, -1), (0.05, 0.08), W, (-25.721240302887203, 44.88921551948799)),
        ((-1, -1), (0.05, 0.08), W, (-6.125283531498607, 19.150325160561962)),
        ((-1, 1), (0.05, 0.08), W, (20.978618857351783, -41.59448596217482)),
        ((1, 0), (0.05, 0.05), (0.2, 0.2), (-4.39750326597311, -4.39750326597311)),
        ((0, 1), (0.0, 0.08), (0.0, -0.3), (0.0, -12.725074053988857)),
    ],
)
def test_the_independent_code_meets_the_numbers(sides, rotations, rates, accelerations) -> None:
    found, _ = IndependentStack(PAIR).solve(sides, np.array(rotations), np.array(rates), 1.0)
    np.testing.assert_allclose(found, accelerations, rtol=1e-12, atol=1e-12)


def runs(seed: int) -> tuple[Stack, Pulse, float]:
    """Two or three blocks of different sizes, under a pulse that rocks them."""
    rng = np.random.default_rng(seed)
    blocks = [Block(rng.uniform(0.05, 0.08), rng.uniform(0.15, 0.3)) for _ in range(2 + seed % 2)]
    stack = Stack(blocks)
    a = stack.uplift_acceleration * rng.uniform(1.1, 2.5)
    frequency = rng.uniform(1.5, 5.0)
    pulses = [
        SineWave(a, frequency),
        CosineWave(a, frequency),
        ConstantPulse(a, 0.3 / frequency),
        DoublePulse(0.15 * rng.uniform(0.8, 2.0), 0.02),
    ]
    return stack, pulses[(seed // 2) % len(pulses)], 0.5


@pytest.mark.parametrize("seed", range(8))
def test_histories_agree(seed: int) -> None:
    stack, pulse, duration = runs(seed)
    ours = simulate_stack(stack, pulse, duration=duration, pulling_pivot="ends")
    compare(stack, pulse, duration, ours)


def compare(stack: Stack, pulse: Pulse, duration: float, ours: StackResponse) -> tuple[float, float, int]:
    """Compare up to where the independent code ends; return the largest differences of times and rotations."""
    n = len(stack)
    bodies = [Body(b.width, b.height, m) for b, m in zip(stack.blocks, stack.masses, strict=True)]
    still = np.zeros(n)
    theirs = IndependentStack(bodies, stack.gravity).run(pulse.pieces, duration, still, still, (0,) * n)
    assert theirs.end in ("duration", "pulls", "overturned", "chatter")
    if theirs.end == "pulls":
        assert ours.ending is Ending.CONTACT_LOST
        assert ours.end_time == pytest.approx(theirs.time, abs=1e-9)
    hits = [hit for hit in ours.impacts if hit.time < theirs.time - 1e-7]
    assert len(hits) == len(theirs.impacts)
    worst = 0.0
    for hit, (time, interface, before, after) in zip(hits, theirs.impacts, strict=True):
        assert hit.interface == interface
        worst = max(worst, abs(hit.time - time))
        np.testing.assert_allclose(hit.rates_before, before, atol=1e-8)
        np.testing.assert_allclose(hit.rates_after, after, atol=1e-8)
    assert worst < 1e-9
    until = min(theirs.time, float(ours.end_time)) - 1e-7
    # Several contacts that change in one instant may be one change here and several there: the last one counts.
    in_order = [list({t: c for t, c in h.configurations if t < until}.items()) for h in (ours, theirs)]
    assert [c for _, c in in_order[0]] == [c for _, c in in_order[1]]
    np.testing.assert_allclose([t for t, _ in in_order[0]], [t for t, _ in in_order[1]], atol=1e-9)
    off = max(float(np.abs(theirs.rotations(t) - ours.rotations(t)).max()) for t in np.linspace(0.0, until, 60))
    assert off < 1e-9
    return worst, off, len(hits)
