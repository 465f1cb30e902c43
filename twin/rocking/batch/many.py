"""What becomes of many different blocks, each let go at its own rotation over one of several base motions."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import NamedTuple

import numpy as np

from twin.rocking.batch.codes import DOUBTFUL, UNDECIDED, UNSETTLED, Codes, Counts, Numbers, Signs
from twin.rocking.batch.engine import COARSE, quick_look_at_each
from twin.rocking.batch.exact import accurate_look
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.taylor import overturns

AT_ONCE = 512
"""Blocks of one piece of work."""
CLOSE, MARGIN = 1e-13, 1e-12
"""Of what a bounded error leaves open: steps' truncation, rad, and what the bound is cut to at every event."""
_NONE = np.zeros(0)


class Outcomes(NamedTuple):
    """Of each block: an outcome's code (`engine`), impacts before it falls, side it falls to; 0 where it does not."""

    codes: Codes
    impacts: Counts
    directions: Signs

    def at(self, k: int) -> Outcomes:
        """Return the `k`-th alone, to be read or written."""
        one = slice(k, k + 1)
        return Outcomes(self.codes[one], self.impacts[one], self.directions[one])


def outcomes_of(bodies: FloatArray, pieces: FloatArray, motions: Numbers, rotations: FloatArray) -> Outcomes:
    """Decide what becomes of each of `n` blocks; UNDECIDED where one rounding of an input would change it.

    The numbers do not depend on how the work is shared out. A base motion `factor` times as strong is the same as a
    gravity and a threshold `factor` times as small with the same p: a body may carry a gain so.

    Parameters
    ----------
    bodies : ndarray, shape (n, 7)
        See `twin.rocking.run.parameters`.
    pieces : ndarray, shape (m, k, 7)
        Base motions, from time 0; the base stands still afterwards.
    motions : ndarray, shape (n,)
        Which of the `pieces` each block stands on.
    rotations : ndarray, shape (n,)
        Initial rotations, rad, signed; at rest.

    Examples
    --------
    >>> from excitation import SineWave
    >>> from twin.rocking.block import Block
    >>> from twin.rocking.run import parameters
    >>> block = Block(0.06, 0.27)
    >>> bodies = np.array([parameters(block, 0.93), parameters(block, 0.2)])
    >>> pieces = SineWave(4.0, 2.0).pieces[None]
    >>> outcomes_of(bodies, pieces, np.zeros(2, dtype=np.int64), np.zeros(2)).directions
    array([1, 0], dtype=int8)
    """
    n = len(bodies)
    ranges = [slice(start, min(start + AT_ONCE, n)) for start in range(0, n, AT_ONCE)]

    def look(part: slice) -> Outcomes:
        return _look(bodies[part], pieces, motions[part], rotations[part])

    if len(ranges) < 2:
        parts = [look(part) for part in ranges]
    else:
        with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="futures") as threads:
            parts = list(threads.map(look, ranges))
    if not parts:
        return _blank(0)
    codes, impacts, directions = zip(*parts, strict=True)
    return Outcomes(np.concatenate(codes), np.concatenate(impacts), np.concatenate(directions))


def _blank(n: int) -> Outcomes:
    return Outcomes(np.zeros(n, dtype=np.uint8), np.zeros(n, dtype=np.int32), np.zeros(n, dtype=np.int8))


def _look(bodies: FloatArray, pieces: FloatArray, motions: Numbers, rotations: FloatArray) -> Outcomes:
    found = _blank(len(bodies))
    quick_look_at_each(bodies, pieces, motions, rotations, COARSE, 0.0, *found, _NONE)
    again = np.nonzero(found.codes == UNSETTLED)[0]
    if again.size:
        closer = _blank(again.size)
        quick_look_at_each(bodies[again], pieces, motions[again], rotations[again], CLOSE, MARGIN, *closer, _NONE)
        found.codes[again], found.impacts[again], found.directions[again] = closer
    left: list[int] = np.nonzero(found.codes == UNSETTLED)[0].tolist()
    for k in left:
        _look_closely(bodies[k], pieces[motions[k]], float(rotations[k]), found.at(k))
    return found


def _look_closely(body: FloatArray, pieces: FloatArray, rotation: float, found: Outcomes) -> None:
    """Follow one block with the accurate method and, where that is in doubt, ask its neighbours; writes `found`."""
    accurate_look(body, pieces[None], rotation, np.zeros(1, dtype=np.int64), *found, _NONE, _NONE)
    if found.codes[0] >= DOUBTFUL:
        found.codes[0] -= DOUBTFUL
        if overturns(body, pieces, rotation=rotation) is None:
            found.codes[0] = UNDECIDED
            found.impacts[0] = found.directions[0] = 0
