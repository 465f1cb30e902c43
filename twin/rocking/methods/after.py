"""The stage after the excitation, from Python: `run_free` with its arrays, and the motion it found."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.march import CAME_TO_REST, FELL, FULL
from twin.rocking.methods.free import MOST_IMPACTS, evaluate_flights, flight_rows, impacts_left, run_free
from twin.rocking.methods.problem import History
from twin.rocking.state import SIDE, TIME


@dataclass(frozen=True, slots=True)
class FreeStage:
    """Flights over a still base: impacts, shape (2, n) (times s, signed rates rad/s), and how it ended."""

    model: int
    alpha: float
    p: float
    impacts: FloatArray
    rows: FloatArray
    rest_time: float | None
    overturning_time: float | None

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation (rad) and angular velocity (rad/s) at `times` (s), from the stage's start on."""
        rotation, rate = np.zeros_like(times), np.zeros_like(times)
        if self.rows.shape[0]:
            evaluate_flights(self.model, self.alpha, self.rows, np.ascontiguousarray(times), self.p, rotation, rate)
        return rotation, rate


@dataclass(frozen=True, slots=True)
class Stages:
    """History of a run whose base moves until `shaken_until`, s, and stands still afterwards."""

    during: History
    shaken_until: float
    afterwards: FreeStage

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation and angular velocity at `times`."""
        if not self.afterwards.rows.shape[0]:
            return self.during.evaluate(times)
        rotation, rate = np.zeros_like(times), np.zeros_like(times)
        earlier = times < self.shaken_until
        for chosen, stage in ((earlier, self.during), (~earlier, self.afterwards)):
            if np.any(chosen):
                rotation[chosen], rate[chosen] = stage.evaluate(times[chosen])
        return rotation, rate


def free_stage(model: int, body: FloatArray, state: FloatArray, end: float) -> FreeStage:
    """Advance `state` in place over a still base to `end` (s, may be infinite), and return the stage."""
    begun = state[SIDE] != 0.0 and state[TIME] < end
    count = impacts_left(body, state, end) if begun else 0
    impacts, rows = flight_rows(count + 2 if begun else 0)
    used = np.zeros(1)
    code = CAME_TO_REST
    if begun:
        code = run_free(model, body, state, end, impacts, rows, used)
        while code == FULL and len(rows) < MOST_IMPACTS:
            grown = flight_rows(2 * len(rows))
            grown[0][:, : len(rows)] = impacts
            grown[1][: len(rows)] = rows
            impacts, rows = grown
            code = run_free(model, body, state, end, impacts, rows, used)
    flights = int(used[0])
    struck = flights
    # The last flight ends at the base only where the block then rests, or where the arrays are full.
    if begun and code not in (CAME_TO_REST, FULL):
        struck -= 1
    return FreeStage(
        model=model,
        alpha=float(body[0]),
        p=float(body[1]),
        impacts=impacts[:, :struck],
        rows=rows[:flights],
        rest_time=float(state[TIME]) if begun and code == CAME_TO_REST else None,
        overturning_time=float(state[TIME]) if code == FELL else None,
    )


def joined(forced: FloatArray, free: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return times and rates of the impacts of both stages."""
    if not forced.shape[1]:
        return free[0], free[1]
    both = np.concatenate([forced, free], axis=1)
    return both[0], both[1]
