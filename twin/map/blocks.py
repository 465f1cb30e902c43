"""A block of a map's cells: the unit of work that any executor can be given, and its answer."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.map.grid import Grid
from twin.rocking.batch.codes import DOUBTFUL, IMPOSSIBLE, OVERTURNED, ROCKED, STAYED, UNDECIDED, UNSETTLED
from twin.rocking.batch.engine import COARSE, FINE, quick_look
from twin.rocking.batch.exact import accurate_look
from twin.rocking.compiled import FloatArray
from twin.rocking.methods import NONLINEAR
from twin.rocking.response import Outcome
from twin.rocking.restitution import Restitution, restitution_ratio
from twin.rocking.run import local_tolerance, parameters
from twin.simulation import overturns, simulate

CELLS_PER_BLOCK = 8192
# Cells of a block where each goes through `simulate`.
CELLS_BY_SIMULATE = 64
OUTCOMES = (Outcome.STAYED, Outcome.ROCKED, Outcome.OVERTURNED, Outcome.UNDECIDED, None)
"""What the codes of a map stand for; None where there is no such pulse."""
NONE = np.zeros(0)


@dataclass(frozen=True, slots=True)
class Question:
    """What is asked about every cell of `grid`; the arguments of `overturning_map`."""

    grid: Grid
    restitution: Restitution = None
    method: str | None = None
    model: str | None = None
    initial_rotation: float = 0.0
    times: bool = False
    peaks: bool = False
    tolerance: float = 1e-10

    @property
    def block_size(self) -> int:
        """Cells of one piece of work."""
        return CELLS_PER_BLOCK if self.method is None and self.model is None else CELLS_BY_SIMULATE


@dataclass(frozen=True, slots=True)
class Answer:
    """The cells from `start` on, in the map's order: see `OverturningMap`; empty arrays for what was not asked."""

    start: int
    codes: NDArray[np.uint8]
    impacts: NDArray[np.int32]
    directions: NDArray[np.int8]
    times: FloatArray
    peaks: FloatArray


def solve(question: Question, start: int, stop: int) -> Answer:
    """Answer the cells from `start` to before `stop`; the same numbers wherever and with whatever others it is done."""
    if question.method is not None or question.model is not None:
        return _by_simulate(question, start, stop)
    block, rotation = question.grid.block, question.initial_rotation
    eta = restitution_ratio(block, question.restitution)
    body = parameters(block, eta, local_tolerance(question.tolerance))
    pieces = question.grid.pieces(start, stop)
    answer = _blank(question, start, stop)
    codes, impacts, directions = answer.codes, answer.impacts, answer.directions

    if question.peaks:
        chosen = np.arange(stop - start)
    else:
        # Overturning times need every digit at once; verdicts seldom do.
        first = FINE if question.times else COARSE
        quick_look(body, pieces, rotation, first, codes, impacts, directions, answer.times)
        again = np.nonzero(codes == UNSETTLED)[0]
        if again.size and first != FINE:
            finer = codes[again], impacts[again], directions[again]
            quick_look(body, pieces[again], rotation, FINE, *finer, NONE)
            codes[again], impacts[again], directions[again] = finer
        chosen = np.nonzero(codes == UNSETTLED)[0]
    if chosen.size:
        accurate_look(body, pieces, rotation, chosen, codes, impacts, directions, answer.times, answer.peaks)
    for cell in np.nonzero(codes >= DOUBTFUL)[0]:
        codes[cell] -= DOUBTFUL
        if overturns(body, pieces[cell], rotation=rotation) is None:
            codes[cell] = UNDECIDED
    _erase(answer, ~question.grid.possible(start, stop), IMPOSSIBLE)
    _erase(answer, codes == UNDECIDED, UNDECIDED)
    return answer


def _blank(question: Question, start: int, stop: int) -> Answer:
    n = stop - start
    return Answer(
        start,
        np.zeros(n, dtype=np.uint8),
        np.zeros(n, dtype=np.int32),
        np.zeros(n, dtype=np.int8),
        np.full(n, np.nan) if question.times else NONE,
        np.full(n, np.nan) if question.peaks else NONE,
    )


def _erase(answer: Answer, cells: NDArray[np.bool_], code: int) -> None:
    """Leave nothing but `code` of the cells that have no answer."""
    answer.codes[cells] = code
    answer.impacts[cells] = 0
    answer.directions[cells] = 0
    if answer.times.size:
        answer.times[cells] = np.nan
    if answer.peaks.size:
        answer.peaks[cells] = np.nan


def _by_simulate(question: Question, start: int, stop: int) -> Answer:
    """Answer cell by cell with `simulate`, by the method and model asked for."""
    answer = _blank(question, start, stop)
    for k in range(stop - start):
        pulse = question.grid.pulse(start + k)
        if pulse is None:
            answer.codes[k] = IMPOSSIBLE
            continue
        response = simulate(
            question.grid.block,
            pulse,
            restitution=question.restitution,
            initial_rotation=question.initial_rotation,
            tolerance=question.tolerance,
            method=question.method,
            model=question.model or NONLINEAR,
        )
        answer.codes[k] = CODES[response.outcome]
        if question.peaks and response.outcome is not Outcome.UNDECIDED:
            answer.peaks[k] = response.peak_rotation
        if response.outcome is Outcome.OVERTURNED:
            answer.impacts[k] = len(response.impact_times)
            answer.directions[k] = response.direction
            if question.times and response.overturning_time is not None:
                answer.times[k] = response.overturning_time
    return answer


CODES = {Outcome.STAYED: STAYED, Outcome.ROCKED: ROCKED, Outcome.OVERTURNED: OVERTURNED, Outcome.UNDECIDED: UNDECIDED}


def answers(
    question: Question,
    executor: Executor | None,
    ranges: Iterator[tuple[int, int]],
    stopped: Callable[[], bool] = lambda: False,
) -> Iterator[Answer]:
    """Yield the answer of each range of cells, in the order they are finished; a bounded number are under way.

    After `stopped` nothing new is begun, and what is under way is still yielded.
    """
    if executor is None:
        with ThreadPoolExecutor(os.cpu_count(), thread_name_prefix="map") as own:
            yield from answers(question, own, ranges, stopped)
        return
    room = max(16, 4 * (os.cpu_count() or 1))
    under_way: set[Future[Answer]] = set()
    try:
        while True:
            while len(under_way) < room and not stopped():
                following = next(ranges, None)
                if following is None:
                    break
                under_way.add(executor.submit(solve, question, *following))
            if not under_way:
                return
            done, under_way = wait(under_way, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
    finally:
        for future in under_way:
            future.cancel()


def block_ranges(question: Question, size: int | None = None) -> Iterator[tuple[int, int]]:
    """Yield the ranges of cells that make the map."""
    step, cells = size or question.block_size, question.grid.size
    return ((start, min(start + step, cells)) for start in range(0, cells, step))
