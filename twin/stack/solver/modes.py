"""Follow one stack through the base motions of many cells."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.stack.solver.book import Book
from twin.stack.solver.chain import BLOCKS, CLOCK_SIZE, FALLING, FRESH, LIFTED, PIECE, Chain, State
from twin.stack.solver.compiled import lent
from twin.stack.solver.march import CONTACT_LOST, NO_ANSWER, REACHED, SEVERAL_ANSWERS, STUCK, Bench, march_through

STAYED, ROCKED, OVERTURNED, LOST, NO_CANDIDATE, SEVERAL, UNFINISHED = range(7)


@lent
def follow(
    chain: Chain,
    state: State,
    pieces: FloatArray,
    still: FloatArray,
    bench: Bench,
    book: Book,
    start: int,
    stop: int,
    codes: NDArray[np.uint8],
    fallen: NDArray[np.uint8],
    times: FloatArray,
) -> None:
    """Write what becomes of the cells from `start` to before `stop`, each from rest.

    Parameters
    ----------
    pieces : ndarray, shape (cells, n, 7)
    still : ndarray, shape (1, 7)
        The still base that follows.
    state, bench, book
        Room; the book keeps nothing.
    codes, fallen : ndarray, shape (cells,)
        Written: STAYED ... UNFINISHED; how many blocks, from the top, have overturned.
    times : ndarray, shape (cells, N)
        Written: when each block left the stack, s; nan where it stands.
    """
    n = state.gap.shape[0]
    for cell in range(start, stop):
        for i in range(n):
            state.side[i] = 0.0
            state.gap[i] = 0.0
            state.rate[i] = 0.0
            state.fallen[i] = math.nan
        for k in range(CLOCK_SIZE):
            state.clock[k] = 0.0
        state.clock[BLOCKS] = n
        state.clock[FRESH] = 1.0
        code = march_through(chain, state, pieces[cell], math.inf, False, bench, book)
        if code == REACHED:
            state.clock[PIECE] = 0.0
            state.clock[FRESH] = 1.0
            code = march_through(chain, state, still, math.inf, True, bench, book)
        standing = int(state.clock[BLOCKS])
        if code == CONTACT_LOST:
            codes[cell] = LOST
            if state.clock[FALLING] >= 0.0:
                standing = int(state.clock[FALLING])
        elif code == NO_ANSWER:
            codes[cell] = NO_CANDIDATE
        elif code == SEVERAL_ANSWERS:
            codes[cell] = SEVERAL
        elif code == STUCK:
            codes[cell] = UNFINISHED
        elif standing < n:
            codes[cell] = OVERTURNED
        else:
            codes[cell] = ROCKED if state.clock[LIFTED] != 0.0 else STAYED
        fallen[cell] = n - standing
        for i in range(n):
            times[cell, i] = state.fallen[i]
