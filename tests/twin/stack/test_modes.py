"""Modes of overturning of many cells, against runs one by one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.facts import B6L
from twin import Stack, simulate
from twin.map.grid import make_grid
from twin.stack.modes import CONTACT_LOST, OVERTURNED, ROCKED, STAYED, overturning_modes

GRID = make_grid(B6L, "sine", amplitudes=np.linspace(0.3, 8.0, 7), frequencies=np.linspace(0.5, 6.0, 5))


@pytest.mark.parametrize("pulling", ["falls", "pulls", "ends"])
@pytest.mark.parametrize("stack", [Stack([B6L, B6L]), Stack([B6L, B6L, B6L])])
def test_cells_are_runs(stack: Stack, pulling: str) -> None:
    modes = overturning_modes(stack, GRID.pieces(0, GRID.size), pulling_pivot=pulling, tolerance=1e-7)
    for cell in range(GRID.size):
        pulse = GRID.pulse(cell)
        response = simulate(stack, pulse, pulling_pivot=pulling, tolerance=1e-7)
        assert modes.fallen[cell] == response.fallen
        assert modes.times[cell] == pytest.approx(response.overturning_times, abs=1e-9, nan_ok=True)
        if modes.codes[cell] in (STAYED, ROCKED, OVERTURNED):
            names = {STAYED: "stayed", ROCKED: "rocked", OVERTURNED: "overturned"}
            assert response.outcome.value == names[modes.codes[cell]]
        elif modes.codes[cell] == CONTACT_LOST:
            assert response.lost_contact is not None
    assert set(modes.codes) <= {STAYED, ROCKED, OVERTURNED, CONTACT_LOST}
    assert len(set(modes.fallen.tolist())) > 1


def test_order() -> None:
    stack = Stack([B6L, B6L, B6L])
    modes = overturning_modes(stack, GRID.pieces(0, GRID.size), pulling_pivot="pulls")
    seen = {tuple(row) for row in modes.order.tolist()}
    assert (0, 0, 0) in seen
    assert all(row[0] == 0 or row[0] >= row[1] >= row[2] >= 1 for row in seen)
    assert any(row[2] == 1 and row[1] == 1 and row[0] == 2 for row in seen)


def test_threads_change_nothing() -> None:
    pieces = GRID.pieces(0, GRID.size)
    one = overturning_modes(Stack([B6L, B6L]), pieces, threads=1)
    many = overturning_modes(Stack([B6L, B6L]), pieces, threads=5)
    assert np.array_equal(one.codes, many.codes)
    assert np.array_equal(one.times, many.times, equal_nan=True)


def test_refusals() -> None:
    with pytest.raises(ValueError, match="pieces have the shape"):
        overturning_modes(Stack([B6L]), np.zeros((3, 7)))
    with pytest.raises(ValueError, match="tolerance is 0 rad"):
        overturning_modes(Stack([B6L]), np.zeros((1, 1, 7)), tolerance=0.0)
