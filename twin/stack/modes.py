"""`overturning_modes`: which blocks of a stack overturn, and when, in every cell of a map."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.rocking.run import STILL_BASE, local_tolerance
from twin.stack.simulation import IMPACT_RULES, PULLING_PIVOTS, chosen, sticking_rate
from twin.stack.solver.book import new_book
from twin.stack.solver.chain import chain_of, new_state
from twin.stack.solver.march import new_bench
from twin.stack.solver.modes import LOST as CONTACT_LOST
from twin.stack.solver.modes import NO_CANDIDATE, OVERTURNED, ROCKED, SEVERAL, STAYED, UNFINISHED, follow
from twin.stack.stack import Stack

__all__ = [
    "CONTACT_LOST",
    "NO_CANDIDATE",
    "OVERTURNED",
    "ROCKED",
    "SEVERAL",
    "STAYED",
    "UNFINISHED",
    "OverturningModes",
    "overturning_modes",
]

CELLS_AT_ONCE = 64


@dataclass(frozen=True, slots=True)
class OverturningModes:
    """What becomes of a stack in each cell.

    Attributes
    ----------
    codes : ndarray of uint8, shape (cells,)
        0 stayed, 1 rocked, 2 overturned (at least the top); the run ended early: 3 contact lost, 4 an impact or a jump
        of acceleration with no candidate, 5 with several, 6 unfinished.
    fallen : ndarray of uint8, shape (cells,)
        How many blocks, from the top, have overturned: 0 none, 1 top only, ... N all. With codes 3 to 6: so far, and
        what was falling for good.
    times : ndarray, shape (cells, N)
        When each block left the stack, s; nan where it stands.
    """

    codes: NDArray[np.uint8]
    fallen: NDArray[np.uint8]
    times: FloatArray

    @property
    def order(self) -> NDArray[np.uint8]:
        """1 for the blocks that fell first, 2 for the next ones, ...; 0 where a block stands. Shape (cells, N)."""
        falls = np.isfinite(self.times)
        times = np.where(falls, self.times, np.inf)
        earlier = times[:, np.newaxis, :] < times[:, :, np.newaxis]
        # Blocks that fell together are the run from one of them up: count the first of each run.
        begins = np.ones_like(falls)
        begins[:, 1:] = times[:, 1:] != times[:, :-1]
        return np.where(falls, 1 + np.sum(earlier & begins[:, np.newaxis, :], axis=2), 0).astype(np.uint8)


def overturning_modes(
    stack: Stack,
    pieces: FloatArray,
    *,
    impact_rule: str = "unilateral",
    pulling_pivot: str = "falls",
    tolerance: float = 1e-7,
    threads: int | None = None,
) -> OverturningModes:
    """Return which blocks overturn under each base motion, from rest.

    Once the base stands still a run ends as soon as the energy left cannot overturn anything (`solver.energy`).

    Parameters
    ----------
    stack : Stack
    pieces : ndarray, shape (cells, n, 7)
        Rows of each cell's pulse (`Pulse.pieces`); shorter ones filled up with rows of no duration.
    impact_rule, pulling_pivot : str
        See `twin.stack.simulation.simulate_stack`.
    tolerance : float
        Absolute error of the rotations asked for, rad, above 0.
    threads : int, optional
        None: one a processor. The result is the same.

    Raises
    ------
    ValueError
        Where an argument is out of range.
    """
    pieces = np.array(pieces, dtype=np.float64, order="C")
    if pieces.ndim != 3 or pieces.shape[2] != 7:
        raise ValueError(f"pieces have the shape {pieces.shape}; it must be (cells, n, 7)")
    if not 0.0 < tolerance < np.inf:
        raise ValueError(f"tolerance is {tolerance:g} rad; it must be above 0 and finite")
    rule = chosen("impact rule", impact_rule, IMPACT_RULES)
    lost = chosen("pulling pivot", pulling_pivot, PULLING_PIVOTS)
    chain = chain_of(stack, local_tolerance(tolerance), sticking_rate(tolerance), rule, lost)
    cells, n = len(pieces), len(stack)
    modes = OverturningModes(np.zeros(cells, np.uint8), np.zeros(cells, np.uint8), np.full((cells, n), np.nan))

    def some(start: int) -> None:
        stop = min(start + CELLS_AT_ONCE, cells)
        room = new_state(n), pieces, STILL_BASE, new_bench(n), new_book(n, 0, 0)
        follow(chain, *room, start, stop, modes.codes, modes.fallen, modes.times)

    with ThreadPoolExecutor(threads or os.cpu_count() or 1) as pool:
        list(pool.map(some, range(0, cells, CELLS_AT_ONCE)))
    return modes
