"""Error against time: one trajectory over a solver's settings, and whole maps.

Times are the best of several, after one run that does not count (compilation, caches), with the garbage collector off.
"""

from __future__ import annotations

import gc
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from twin.chart.solvers import NONE, STEP, Solver
from twin.chart.task import B6L, Answer, Task, difference, sample_times, sine
from twin.map.overturning import overturning_map
from twin.rocking.batch.codes import OVERTURNED, UNDECIDED
from twin.rocking.compiled import FloatArray
from twin.rocking.run import local_tolerance, parameters
from twin.simulation import overturns

MOST_REPEATS = 200
TIGHTEST = 1e-15
CHECK_TOLERANCE = 1e-13
MAP_SIDE = 100
OUTCOME = {False: 0, True: 1, None: 2}

Codes = NDArray[np.int8]
"""0 stands, 1 overturns, 2 undecided."""


@dataclass(frozen=True, slots=True)
class Point:
    """One measurement.

    Attributes
    ----------
    case : str
        "free", "sine", "record" or "map".
    solver : str
    knob : str
        "tolerance", "step" or "".
    setting : float or None
        rad or s.
    time : float
        s per trajectory.
    error : float
        Trajectory: largest |rotation - reference|, rad. Map: share of the cells that is wrong.
    impact_error : float
        Trajectory: largest error of the impact times, s; infinite where impacts are missing.
    repeats : int
        Runs the time is the best of.
    cells, wrong, undecided : int
        Map: cells looked at, wrong ones, and ones the solver calls undecided though they are not.
    refused : str
        Why there is no answer.
    """

    case: str
    solver: str
    knob: str
    setting: float | None
    time: float = math.nan
    error: float = math.nan
    impact_error: float = math.nan
    repeats: int = 0
    cells: int = 0
    wrong: int = 0
    undecided: int = 0
    refused: str = ""


@dataclass(frozen=True, slots=True)
class Reference:
    """The truth of one case: the default at its tightest, and how far independent codes are from it.

    Attributes
    ----------
    task : Task
    answer : Answer
    times : ndarray
        Where rotations are compared, s.
    checks : dict
        Name of an independent code -> largest difference of the rotation, rad.
    """

    task: Task
    answer: Answer
    times: FloatArray
    checks: dict[str, float]

    @property
    def floor(self) -> float:
        """Error below which nothing can be told, rad: the least difference of two independent codes."""
        return max(min(self.checks.values(), default=0.0), 1e-16)


def best_time(call: Callable[[], object], budget: float, least: int = 1) -> tuple[float, int]:
    """Return the shortest time of `call`, s, and of how many runs: `budget` seconds of them, or `least`.

    `call` has run before, so that nothing compiles here.
    """
    collecting = gc.isenabled()
    gc.disable()
    try:
        best, spent, runs = math.inf, 0.0, 0
        while runs < MOST_REPEATS and (runs < least or spent < budget):
            started = perf_counter()
            call()
            took = perf_counter() - started
            best, spent, runs = min(best, took), spent + took, runs + 1
    finally:
        if collecting:
            gc.enable()
    return best, runs


def make_reference(task: Task, default: Solver, checkers: list[Solver]) -> Reference:
    """Return the truth of a case, checked by every one of `checkers` that can."""
    answer = default.run(task, TIGHTEST)
    times = sample_times(answer)
    checks: dict[str, float] = {}
    for solver in checkers:
        try:
            other = solver.run(task, TIGHTEST if solver.name == "heyoka" else CHECK_TOLERANCE)
        except ValueError:
            continue
        checks[solver.name] = difference(other, answer, times).rotation
    return Reference(task, answer, times, checks)


def trajectory_points(solver: Solver, reference: Reference, budget: float, *, quick: bool) -> list[Point]:
    """Return error and time of a solver over its settings."""
    points: list[Point] = []
    settings: tuple[float | None, ...] = (solver.quick if quick else solver.settings) or (None,)
    task = reference.task
    for setting in settings:
        try:
            found = difference(solver.run(task, setting), reference.answer, reference.times)
            took, runs = best_time(partial(solver.run, task, setting), budget, 1 if quick else 3)
        except ValueError as error:
            points.append(Point(task.name, solver.name, solver.knob, setting, refused=str(error)))
            continue
        points.append(Point(task.name, solver.name, solver.knob, setting, took, found.rotation, found.impacts, runs))
    return points


@dataclass(frozen=True, slots=True)
class MapTruth:
    """The single-sine map of B6L by the default method: rows A, columns W, both 0.1 to 10.

    Attributes
    ----------
    axis : ndarray
        A and W.
    codes : ndarray of int8
        0 stands, 1 overturns, 2 undecided.
    """

    axis: FloatArray
    codes: Codes


def map_truth(default: Solver, side: int) -> MapTruth:
    """Return the map of `side` x `side` cells."""
    axis = np.linspace(0.1, 10.0, MAP_SIDE)[MAP_SIDE // side - 1 :: MAP_SIDE // side]
    codes = np.array([[_code(default, _cell(a, w), None) for w in axis] for a in axis], dtype=np.int8)
    return MapTruth(axis, codes)


def map_points(solver: Solver, truth: MapTruth, budget: float, *, quick: bool) -> list[Point]:
    """Return wrong cells and time per cell, on as many cells as the budget allows (s)."""
    settings: tuple[float | None, ...] = (None,)
    if solver.knob == STEP:
        settings = (5e-3, 1e-3)
    elif solver.peer:
        settings = solver.quick[-1:] if quick else (solver.settings[1], solver.settings[3])
    return [_map_point(solver, setting, truth, budget) for setting in settings]


def _map_point(solver: Solver, setting: float | None, truth: MapTruth, budget: float) -> Point:
    side = truth.axis.size
    try:
        probe = [_cell(truth.axis[k], truth.axis[side - 1 - k]) for k in range(0, side, max(1, side // 6))]
        each = 0.0
        for _ in range(2):  # the first one may compile
            each = _timed(lambda: [_code(solver, task, setting) for task in probe])[1] / len(probe)
        stride = next((s for s in (1, 2, 5, 10) if side % s == 0 and each * (side // s) ** 2 <= budget), 20)
        chosen = truth.axis[stride - 1 :: stride]
        tasks = [_cell(a, w) for a in chosen for w in chosen]
        codes, took = _timed(lambda: [_code(solver, task, setting) for task in tasks])
    except ValueError as error:
        return Point("map", solver.name, solver.knob, setting, refused=str(error))
    right = truth.codes[stride - 1 :: stride, stride - 1 :: stride].reshape(-1)
    return compared(solver.name, solver.knob, setting, np.array(codes, dtype=np.int8), right, took / len(tasks))


def batch_points(truth: MapTruth, budget: float) -> list[Point]:
    """Return the points of the engine of `overturning_map`, all processors: verdicts, and with times."""
    points: list[Point] = []
    right = truth.codes.reshape(-1)
    for name, times in (("overturning_map", False), ("overturning_map, with times", True)):
        call = partial(overturning_map, B6L, amplitudes=truth.axis, frequencies=truth.axis, times=times)
        found = call().codes.reshape(-1)
        took, runs = best_time(call, budget)
        codes = np.where(found == OVERTURNED, 1, np.where(found == UNDECIDED, 2, 0)).astype(np.int8)
        points.append(compared(name, NONE, None, codes, right, took / right.size, runs))
    return points


def verdict_point(truth: MapTruth) -> Point:
    """Return the default method asked for the outcome alone, cell by cell, without a history."""
    body = parameters(B6L, B6L.housner_restitution, local_tolerance(1e-10))
    pulses = [sine(a, w).pieces for a in truth.axis for w in truth.axis]
    codes, took = _timed(lambda: [OUTCOME[overturns(body, pieces)] for pieces in pulses])
    right = truth.codes.reshape(-1)
    return compared("taylor, outcome only", NONE, None, np.array(codes, dtype=np.int8), right, took / right.size)


def compared(
    name: str, knob: str, setting: float | None, codes: Codes, right: Codes, time: float, runs: int = 1
) -> Point:
    """Return a map's point from the codes found and the true ones."""
    known = right != OUTCOME[None]
    wrong = int(np.sum(known & (codes != right) & (codes != OUTCOME[None])))
    undecided = int(np.sum(known & (codes == OUTCOME[None])))
    return Point("map", name, knob, setting, time, wrong / right.size, math.nan, runs, right.size, wrong, undecided)


def _timed(call: Callable[[], list[int]]) -> tuple[list[int], float]:
    """Return the result of `call` and its time, s: the cells are many enough not to repeat it."""
    gc.disable()
    try:
        started = perf_counter()
        result = call()
        return result, perf_counter() - started
    finally:
        gc.enable()


def _cell(amplitude: float, frequency: float) -> Task:
    pulse = sine(amplitude, frequency)
    # The outcome is for ever: what comes after the wave follows from the state at its end.
    return Task("map", pulse, duration=pulse.duration)


def _code(solver: Solver, task: Task, setting: float | None) -> int:
    return OUTCOME[solver.run(task, setting).overturned]
