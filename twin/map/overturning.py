"""`overturning_map`: what every pulse of a grid does to one block."""

from __future__ import annotations

import math
from concurrent.futures import Executor
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.map.blocks import OUTCOMES, Answer, Question, answers, block_ranges
from twin.map.grid import Grid, make_grid
from twin.rocking.batch.codes import OVERTURNED
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN
from twin.rocking.restitution import Restitution, restitution_ratio


@dataclass(frozen=True, slots=True)
class OverturningMap:
    """The block's answers over a grid of pulses; every array has the shape (rows, columns).

    Attributes
    ----------
    grid : Grid
        Block, kind, `rows` (amplitudes in g tan(alpha), or peak velocities in m/s) and `columns` (frequencies omega/p,
        durations in s, or stop gaps in m).
    codes : ndarray of uint8
        The outcome, one byte a cell: 0 stayed, 1 rocked, 2 overturned, 3 undecided, 4 no such pulse (a double pulse
        whose gap is shorter than the run-up to its velocity).
    impacts : ndarray of int32
        Impacts before overturning; 0 where it stands.
    direction : ndarray of int8
        +1 or -1, the side it overturns to; 0 where it does not.
    overturning_time : ndarray or None
        When |rotation| reaches pi/2, s; nan where it stands, or where it would take for ever. None unless asked for.
    peak_rotation : ndarray or None
        Largest |rotation|, rad; pi/2 where it overturns, nan where undecided. None unless asked for.
    """

    grid: Grid
    codes: NDArray[np.uint8]
    impacts: NDArray[np.int32]
    direction: NDArray[np.int8]
    overturning_time: FloatArray | None
    peak_rotation: FloatArray | None

    @property
    def outcome(self) -> NDArray[np.object_]:
        """The `twin.Outcome` of each cell, made at each call; None where there is no such pulse."""
        return np.array(OUTCOMES, dtype=np.object_)[self.codes]

    @property
    def overturned(self) -> NDArray[np.bool_]:
        """Whether it overturns; False where undecided."""
        return self.codes == OVERTURNED


def overturning_map(
    block: Block,
    kind: str = "sine",
    *,
    amplitudes: ArrayLike | None = None,
    frequencies: ArrayLike | None = None,
    durations: ArrayLike | None = None,
    peak_velocities: ArrayLike | None = None,
    stop_gaps: ArrayLike | None = None,
    restitution: Restitution = None,
    method: str | None = None,
    model: str | None = None,
    initial_rotation: float = 0.0,
    times: bool = False,
    peaks: bool = False,
    tolerance: float = 1e-10,
    duration: float | None = None,
    rebound: float = 0.0,
    pulse_acceleration: float = 100.0,
    executor: Executor | None = None,
) -> OverturningMap:
    """Return what each pulse of a grid does to `block`, as `simulate` would say, cell by cell.

    A cheap pass with a bound of its error settles most cells, sixteen in lock step; the others are looked at with ever
    more digits. A cell is undecided where one rounding of an input changes whether it overturns.

    Parameters
    ----------
    block : Block
    kind : str
        "sine" or "cosine" (one cycle), "lasting sine" (of `duration`), "constant", "double pulse".
    amplitudes : array_like, shape (n,)
        Rows, in g tan(alpha): the block lifts above 1 (of magnitude).
    frequencies : array_like, shape (m,)
        Columns of the waves, angular frequency in units of p, above 0.
    durations : array_like, shape (m,)
        Columns of the constant pulse, s (divide p ta by `block.frequency_parameter`).
    peak_velocities, stop_gaps : array_like
        Rows, m/s, and columns, m, of the double pulse.
    restitution, method, model, initial_rotation, tolerance
        As for `simulate`. With `method` or `model` each cell goes through `simulate` itself: thousands of times slower.
    times, peaks : bool
        Whether `overturning_time` and `peak_rotation` are wanted too.
    duration : float, optional
        Length of a lasting sine, s.
    rebound, pulse_acceleration : float
        Of the double pulse; see `excitation.DoublePulse`.
    executor : concurrent.futures.Executor, optional
        Who does the work: a pool of threads or processes, or that of a `dask.distributed` client. None: a thread per
        processor. The result is the same.

    Raises
    ------
    ValueError
        One sentence: an axis missing, not of this kind, empty, not finite or out of range, or another such argument.

    Examples
    --------
    >>> import numpy as np
    >>> chart = overturning_map(Block(0.06, 0.27), amplitudes=np.linspace(1, 6, 6), frequencies=[1.0, 2.0, 4.0])
    >>> chart.overturned.sum(axis=1)
    array([0, 3, 3, 3, 3, 3])
    """
    grid = make_grid(
        block,
        kind,
        amplitudes=amplitudes,
        frequencies=frequencies,
        durations=durations,
        peak_velocities=peak_velocities,
        stop_gaps=stop_gaps,
        duration=duration,
        rebound=rebound,
        pulse_acceleration=pulse_acceleration,
    )
    question = checked(Question(grid, restitution, method, model, initial_rotation, times, peaks, tolerance))
    whole = empty_map(question)
    for answer in answers(question, executor, block_ranges(question)):
        put(whole, answer)
    return whole


def checked(question: Question) -> Question:
    """Return `question` itself; raises `ValueError` where an argument is out of range."""
    restitution_ratio(question.grid.block, question.restitution)
    if not abs(question.initial_rotation) < HALF_TURN:
        raise ValueError(f"initial rotation is {question.initial_rotation:g} rad; it must lie inside -pi/2 to pi/2")
    if not 0.0 < question.tolerance < math.inf:
        raise ValueError(f"tolerance is {question.tolerance:g} rad; it must be above 0 and finite")
    return question


def empty_map(question: Question) -> OverturningMap:
    """Return the map with nothing in it yet."""
    shape = question.grid.shape
    return OverturningMap(
        question.grid,
        np.zeros(shape, dtype=np.uint8),
        np.zeros(shape, dtype=np.int32),
        np.zeros(shape, dtype=np.int8),
        np.full(shape, np.nan) if question.times else None,
        np.full(shape, np.nan) if question.peaks else None,
    )


def put(whole: OverturningMap, answer: Answer) -> None:
    """Write an answer's cells into the map."""
    cells = slice(answer.start, answer.start + len(answer.codes))
    whole.codes.reshape(-1)[cells] = answer.codes
    whole.impacts.reshape(-1)[cells] = answer.impacts
    whole.direction.reshape(-1)[cells] = answer.directions
    if whole.overturning_time is not None:
        whole.overturning_time.reshape(-1)[cells] = answer.times
    if whole.peak_rotation is not None:
        whole.peak_rotation.reshape(-1)[cells] = answer.peaks
