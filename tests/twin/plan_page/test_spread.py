"""The ellipse of a run's point, against the point of another block."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.facts import B6L
from twin.plan_page.spread import Ellipse, Spread, ellipse_of
from twin.rocking.block import Block

SMALL = 1e-6


def block_with(slenderness: float = 0.0, size: float = 0.0) -> Block:
    alpha = B6L.slenderness * (1.0 + slenderness)
    diagonal = 2.0 * B6L.half_diagonal * (1.0 + size)
    return Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha))


def place(kind: str, block: Block, first: float, second: float) -> np.ndarray:
    """Return column and row of a pulse, in the block's own dimensionless numbers, logarithms of them."""
    lift, p = block.uplift_acceleration, block.frequency_parameter
    column, row = {
        "sine": (second / p, first / lift),
        "constant": (second * p, first / lift),
        "double pulse": (second * p * p / lift, first * p / lift),
    }[kind]
    return np.log([column, row])


@pytest.mark.parametrize("kind", ["sine", "constant", "double pulse"])
@pytest.mark.parametrize("cause", ["slenderness", "size", "gain"])
def test_each_cause_moves_the_point_as_another_block_would(kind: str, cause: str) -> None:
    before = place(kind, B6L, 2.0, 0.3)
    if cause == "gain":
        after = place(kind, B6L, 2.0 * (1.0 + SMALL), 0.3)
    else:
        after = place(kind, block_with(**{cause: SMALL}), 2.0, 0.3)
    moved = (after - before) / SMALL
    ellipse = ellipse_of(kind, B6L.slenderness, 5.0, 1.5, Spread(**{cause: 1.0}))
    assert ellipse.covariance == pytest.approx(np.outer(moved * [5.0, 1.5], moved * [5.0, 1.5]), abs=2e-4)


def test_restitution_is_an_axis_of_its_own_or_none() -> None:
    spread = Spread(restitution=0.01, gain=0.02)
    assert ellipse_of("restitution", 0.2, 0.9, 1.0, spread).deviations == pytest.approx((0.01, 0.02))
    assert ellipse_of("sine", 0.2, 3.0, 1.0, spread).deviations == pytest.approx((0.0, 0.02))


@given(a=st.floats(0.0, 1.0), b=st.floats(0.0, 1.0), c=st.floats(-0.99, 0.99), sigmas=st.floats(0.1, 5.0))
def test_every_point_of_the_outline_is_that_many_deviations_away(a: float, b: float, c: float, sigmas: float) -> None:
    covariance = np.array([[a * a, c * a * b], [c * a * b, b * b]])
    x, y = Ellipse(1.0, 2.0, covariance).outline(sigmas)
    assert np.max(np.abs(x - 1.0)) == pytest.approx(sigmas * a, rel=2e-3, abs=1e-9)
    assert np.max(np.abs(y - 2.0)) == pytest.approx(sigmas * b, rel=2e-3, abs=1e-9)
