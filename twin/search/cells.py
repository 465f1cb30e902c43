"""What many pulses do to one block, and to many blocks that it may be instead."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from excitation import Pulse
from twin.rocking.batch.codes import DOUBTFUL, OVERTURNED, UNDECIDED, UNSETTLED
from twin.rocking.batch.engine import COARSE, FINE, quick_look
from twin.rocking.batch.exact import accurate_look
from twin.rocking.compiled import FloatArray

Numbers = NDArray[np.int64]
NONE = np.zeros(0)
PADDING = 0.1
"""Length of the still piece behind a pulse that has fewer pieces than its neighbours, s."""


class Futures(Protocol):
    """What the block and the table may really be: one row a future.

    Attributes
    ----------
    bodies : ndarray, shape (n, 7)
        See `twin.rocking.run.parameters`.
    rotations : ndarray, shape (n,)
        Initial rotations, rad.
    factors : ndarray, shape (n,)
        Base motion made over base motion asked.
    """

    @property
    def bodies(self) -> FloatArray: ...

    @property
    def rotations(self) -> FloatArray: ...

    @property
    def factors(self) -> FloatArray: ...


@dataclass(frozen=True, slots=True)
class Looked:
    """Outcomes of cells: codes of `twin.rocking.batch.codes`, impacts before overturning, its side, peaks (rad)."""

    codes: NDArray[np.uint8]
    impacts: NDArray[np.int32]
    directions: NDArray[np.int8]
    peaks: FloatArray

    @property
    def overturned(self) -> NDArray[np.bool_]:
        """Whether it overturns for sure."""
        return self.codes == OVERTURNED

    @property
    def without_impact(self) -> NDArray[np.bool_]:
        """Whether it overturns before its first impact."""
        return (self.codes == OVERTURNED) & (self.impacts == 0)


@dataclass(frozen=True, slots=True)
class Counts:
    """In how many of `count` futures each cell overturns, does so without impact, and is undecided."""

    count: int
    overturned: Numbers
    without_impact: Numbers
    undecided: Numbers


def stacked(
    pulses: Sequence[Pulse | None], pieces: Callable[[Pulse], FloatArray]
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the base motion of every pulse, shape (cells, n, 7), and which there are; others stand still."""
    rows: list[FloatArray | None] = []
    for pulse in pulses:
        try:
            rows.append(None if pulse is None else pieces(pulse))
        except ValueError:
            rows.append(None)
    most = max((len(row) for row in rows if row is not None), default=1)
    still = np.zeros((0, 7))
    table = [padded((still if row is None else row)[None], most) for row in rows]
    return np.concatenate(table), np.array([row is not None for row in rows], dtype=np.bool_)


def padded(pieces: FloatArray, most: int) -> FloatArray:
    """Return motions, shape (cells, n, 7), with still pieces behind them up to `most`."""
    cells, used = pieces.shape[:2]
    table = np.zeros((cells, most, 7))
    table[:, :used] = pieces
    for k in range(used, most):
        table[:, k, 0] = table[:, k - 1, 1] if k else 0.0
        table[:, k, 1] = table[:, k, 0] + PADDING
    return table


def look(body: FloatArray, pieces: FloatArray, rotation: float, *, peaks: bool = False) -> Looked:
    """Decide every cell for one body let go at `rotation`, rad: a cheap look, then better ones at what it leaves."""
    n = len(pieces)
    directions = np.zeros(n, dtype=np.int8)
    looked = Looked(
        np.zeros(n, dtype=np.uint8), np.zeros(n, dtype=np.int32), directions, np.full(n, np.nan) if peaks else NONE
    )
    chosen = np.arange(n)
    if not peaks:
        quick_look(body, pieces, rotation, COARSE, looked.codes, looked.impacts, directions, NONE)
        again = np.nonzero(looked.codes == UNSETTLED)[0]
        if again.size:
            finer = looked.codes[again], looked.impacts[again], directions[again]
            quick_look(body, pieces[again], rotation, FINE, *finer, NONE)
            looked.codes[again], looked.impacts[again], directions[again] = finer
        chosen = np.nonzero(looked.codes == UNSETTLED)[0]
    if chosen.size:
        accurate_look(body, pieces, rotation, chosen, looked.codes, looked.impacts, directions, NONE, looked.peaks)
    # One rounding may decide these: where there are many futures that is none of them.
    looked.codes[looked.codes >= DOUBTFUL] -= DOUBTFUL
    return looked


def count(futures: Futures, pieces: FloatArray, *, settling: bool = False) -> Counts:
    """Count what becomes of every cell in all the futures, on as many threads as there are processors.

    `settling`: the initial rotations are those of a block that leans on its base until it is shaken. As it settles it
    strikes the base, and no such impact counts: it overturns without impact where it falls as it would from rest.
    """
    n = len(futures.bodies)
    workers = os.cpu_count() or 1
    shares = [np.arange(n)[k::workers] for k in range(workers)]
    with ThreadPoolExecutor(workers, thread_name_prefix="search") as pool:
        work = [pool.submit(_count, futures, pieces, share, settling) for share in shares]
        parts = [part.result() for part in work]
    sums = [np.sum([part[k] for part in parts], axis=0) for k in range(3)]
    return Counts(n, *sums)


def _count(futures: Futures, pieces: FloatArray, share: Numbers, settling: bool) -> tuple[Numbers, Numbers, Numbers]:
    cells = len(pieces)
    overturned, without, undecided = (np.zeros(cells, dtype=np.int64) for _ in range(3))
    own = pieces.copy()
    for k in share.tolist():
        # Of a piece c0, c1 and A are accelerations.
        own[:, :, 2:5] = pieces[:, :, 2:5] * futures.factors[k]
        looked = look(futures.bodies[k], own, float(futures.rotations[k]))
        overturned += looked.overturned
        undecided += looked.codes == UNDECIDED
        if not settling:
            without += looked.without_impact
            continue
        from_rest = look(futures.bodies[k], own, 0.0)
        without += looked.overturned & from_rest.without_impact & (looked.directions == from_rest.directions)
    return overturned, without, undecided
