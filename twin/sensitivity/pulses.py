"""Grids of cases for the map's engine: one pulse at many amplitudes, on one block, from one tilt."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from excitation import Pulse
from twin.map.blocks import Answer, Question, solve
from twin.map.grid import Grid
from twin.rocking.batch.codes import IMPOSSIBLE, OVERTURNED, ROCKED, STAYED
from twin.rocking.batch.codes import UNDECIDED as CODE_UNDECIDED
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import NONLINEAR, MethodRefused
from twin.sensitivity.case import Case

STAYS, ROCKS, LEFT, RIGHT, UNDECIDED, REFUSED = range(6)
"""Outcome and side of a cell; LEFT overturns towards -x, RIGHT towards +x; REFUSED: the model, or no such pulse."""
NAMES = ("stays", "rocks", "falls to the left (-x)", "falls to the right (+x)", "undecided", "refused")
MANY_PIECES = 100
MOST_PIECES = 100_000
"""Rows of base motion held at once; a record has thousands to a cell."""
_CLASS_OF_CODE = np.zeros(IMPOSSIBLE + 1, dtype=np.uint8)
_CLASS_OF_CODE[[STAYED, ROCKED, OVERTURNED, CODE_UNDECIDED, IMPOSSIBLE]] = STAYS, ROCKS, LEFT, UNDECIDED, REFUSED

Classes = np.ndarray[tuple[int, ...], np.dtype[np.uint8]]
Counts = np.ndarray[tuple[int, ...], np.dtype[np.int32]]


@dataclass(frozen=True)
class ScaledPulses(Grid):
    """A grid of one column, of pulses that are made already; None where there is no such pulse."""

    made: tuple[Pulse | None, ...] = ()

    def pulse(self, cell: int) -> Pulse | None:
        """Return the pulse of a cell."""
        return self.made[cell]

    def possible(self, start: int, stop: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which cells have a pulse."""
        return np.array([pulse is not None for pulse in self.made[start:stop]])

    def pieces(self, start: int, stop: int) -> FloatArray:
        """Return the pieces of the cells, shape (stop - start, n, 7); an impossible cell stands still."""
        rows = [None if pulse is None else pulse.pieces for pulse in self.made[start:stop]]
        still = np.zeros((max((len(row) for row in rows if row is not None), default=1), 7))
        return np.stack([still if row is None else row for row in rows])


def scaled(case: Case, factors: FloatArray) -> ScaledPulses:
    """Return the case's pulse times each of `factors`."""
    if case.pulse is None:
        raise ValueError("a case without a pulse has no amplitudes")
    made = tuple(_scaled(case.pulse, float(factor)) for factor in factors)
    return ScaledPulses(case.block, case.pulse.family, factors, np.ones(1), made=made)


def _scaled(pulse: Pulse, factor: float) -> Pulse | None:
    if factor == 1.0:
        return pulse
    try:
        return pulse.scaled(factor)
    except ValueError:
        return None


def row_of(case: Case, grid: ScaledPulses, tilt: float, model: str = NONLINEAR) -> tuple[Classes, Counts]:
    """Return what the pulses of a grid of the case do from a `tilt` (rad): class and impacts before the fall.

    The nonlinear model is the map's batch engine; the others go one by one through `simulate`. A model that refuses
    leaves the whole row REFUSED.
    """
    asked = None if model == NONLINEAR else model
    longest = max((len(pulse.pieces) for pulse in grid.made if pulse is not None), default=1)
    # Asked for peaks the engine goes to its accurate look at once: the quick one cannot do ramps, and looks through all
    # the pieces to come at each.
    question = Question(grid, case.restitution, model=asked, initial_rotation=tilt, peaks=longest > MANY_PIECES)
    step = max(1, MOST_PIECES // longest)
    classes = np.full(len(grid.made), REFUSED, dtype=np.uint8)
    impacts = np.zeros(len(grid.made), dtype=np.int32)
    for start in range(0, len(grid.made), step):
        stop = min(start + step, len(grid.made))
        try:
            answer = solve(question, start, stop)
        except MethodRefused:
            continue
        classes[start:stop] = classes_of(answer)
        impacts[start:stop] = answer.impacts
    return classes, impacts


def classes_of(answer: Answer) -> Classes:
    """Return the class of each cell of an answer of the map's."""
    classes = _CLASS_OF_CODE[answer.codes]
    classes[(answer.codes == OVERTURNED) & (answer.directions > 0)] = RIGHT
    return classes
