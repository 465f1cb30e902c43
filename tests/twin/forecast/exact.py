"""What the exact solver says of a block in any state at any instant: what the fast futures are held against."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from twin.forecast.course import START, lay_course
from twin.forecast.ensemble import place
from twin.forecast.futures import FALL, MARGIN, RESULTS, conclude, energy_margins, march
from twin.forecast.loop import TableLoop
from twin.forecast.ramp import interval_at
from twin.forecast.step import OFFSET, ROWS
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.methods.equations import FULL_EQUATION
from twin.rocking.methods.flight import fall, strike
from twin.rocking.run import Run, parameters
from twin.rocking.state import PEAK, PHI, PSI, RATE, SIDE, STATE_SIZE, TIME

NEAR = 1e-4
"""How near to a boundary of the outcome a future may be wrong, rad and relative."""


class Start(NamedTuple):
    """A block let go: side, |theta| rad, d|theta|/d(p t); slenderness rad, restitution."""

    side: float
    phi: float
    rate: float
    alpha: float
    eta: float


class Fate(NamedTuple):
    """Margin as the forecast defines it (-1 where it fell while the base moved), and time of pi/2, s."""

    margin: float
    fall: float


def exact_fate(block: Block, start: Start, time: float, pieces: FloatArray) -> Fate:
    """Return what becomes of it, by the default solver and the closed forms."""
    body = parameters(block, start.eta)
    body[0], body[4] = start.alpha, block.gravity * math.tan(start.alpha)
    state = np.zeros(STATE_SIZE)
    state[TIME], state[SIDE], state[PHI], state[RATE] = time, start.side, start.phi, start.rate
    state[PSI], state[PEAK] = start.alpha - start.phi, start.phi
    run = Run(body, state, record=False)
    run.advance(np.ascontiguousarray(pieces[pieces[:, 1] > time]))
    p, begun = block.frequency_parameter, max(time, float(state[TIME]))
    if run.fallen:
        return Fate(-1.0, float(state[TIME]))
    if state[SIDE] == 0.0:
        return Fate(1.0, math.inf)
    ahead, around = energy_margins(start.alpha, start.eta, state[PSI], state[RATE])
    margin = max(min(ahead, around), -1.0)
    if ahead < 0.0:
        return Fate(margin, begun + fall(FULL_EQUATION, start.alpha, state[PSI], state[RATE]) / p)
    if around < 0.0:
        time_to, rate, _ = strike(FULL_EQUATION, start.alpha, state[PSI], state[RATE])
        after = fall(FULL_EQUATION, start.alpha, start.alpha, start.eta * rate)
        return Fate(margin, begun + (time_to + after) / p)
    return Fate(margin, math.inf)


def fast_fates(block: Block, starts: list[Start], time: float, pieces: FloatArray) -> list[Fate]:
    """Return the same of up to sixteen, by the futures' own engine, on a table that follows exactly."""
    p = block.frequency_parameter
    course = lay_course(pieces, TableLoop(), p, block.gravity)
    group, results = np.zeros((ROWS, WIDTH)), np.zeros((WIDTH, RESULTS))
    for lane in range(WIDTH):
        start = starts[lane % len(starts)]
        place(group, lane, *start, p * time)
    first = interval_at(course, p * time)
    group[OFFSET] = max(0.0, p * time - course[first, START])
    last = len(course) - 1
    march(group, course, first, last, 10**9)
    conclude(group, max(p * time, course[last, START]), results, 0)
    return [Fate(float(row[MARGIN]), float(row[FALL]) / p) for row in results[: len(starts)]]


def near_a_boundary(block: Block, start: Start, time: float, pieces: FloatArray) -> bool:
    """Tell whether a small change makes the exact outcome another: 1e-4 rad of rotation, 1e-4 of the base's motion."""
    falls = exact_fate(block, start, time, pieces).margin < 0.0
    for by in (-NEAR, NEAR):
        shaken = pieces.copy()
        shaken[:, 2:5] *= 1.0 + by
        if (exact_fate(block, moved(start, by), time, pieces).margin < 0.0) != falls:
            return True
        if (exact_fate(block, start, time, shaken).margin < 0.0) != falls:
            return True
    return False


def moved(start: Start, by: float) -> Start:
    """Return the start with its rotation `by` rad further out, at least on the base; from rest it leans."""
    phi = max(0.0, start.phi + by)
    return start._replace(phi=phi, side=start.side or (1.0 if phi > 0.0 else 0.0))
