"""Which part of a map a table can run at all."""

from __future__ import annotations

import numpy as np

from excitation import Capacity, Pulse, clip
from twin.map.grid import Grid
from twin.rocking.compiled import FloatArray

BISECTIONS = 24
COLUMNS = 200


def reachable(
    grid: Grid, capacity: Capacity, *, brake: float | None = None, coast: float = 0.0, payload: float | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return columns of the map and, for each, the largest row value that the table makes exactly as asked.

    What `excitation.clip` finds feasible, closed in on by bisection: less of a pulse never asks more of a table.

    Parameters
    ----------
    grid : Grid
    capacity : Capacity
    brake, coast, payload
        As for `excitation.clip`; `brake` is needed by every pulse that ends moving.

    Returns
    -------
    tuple of ndarray
        Column values and row values, at most `COLUMNS` of them; nan where not even the least row can be run, inf where
        the greatest can.
    """
    picked = np.unique(np.linspace(0, len(grid.columns) - 1, min(COLUMNS, len(grid.columns))).round().astype(np.intp))
    columns = grid.columns[picked]
    low, high = float(np.abs(grid.rows).min()), float(np.abs(grid.rows).max())

    def feasible(row: float, column: float) -> bool:
        single = Grid(
            grid.block,
            grid.kind,
            np.array([row]),
            np.array([column]),
            grid.duration,
            grid.rebound,
            grid.pulse_acceleration,
        )
        pulse: Pulse | None = single.pulse(0)
        if pulse is None:
            return False
        return clip(pulse, capacity, brake=brake, coast=coast, payload=payload).feasible

    tops = np.full(len(columns), np.nan)
    for k, column in enumerate(columns.tolist()):
        if not feasible(low, column):
            continue
        if feasible(high, column):
            tops[k] = np.inf
            continue
        inside, outside = low, high
        for _ in range(BISECTIONS):
            middle = 0.5 * (inside + outside)
            inside, outside = (middle, outside) if feasible(middle, column) else (inside, middle)
        tops[k] = inside
    return columns, tops
