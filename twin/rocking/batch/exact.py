"""The accurate look at cells of a batch, by the default method: verdicts in doubt, overturning times, peaks."""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.batch.codes import DOUBTFUL, OVERTURNED, ROCKED, STAYED, Codes, Counts, Numbers, Signs
from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import FELL, FULL, HALF_TURN, march, march_through
from twin.rocking.march import UPLIFT as UPLIFT_EVENT
from twin.rocking.run import SAFETY
from twin.rocking.series import ORDER
from twin.rocking.state import (
    ALPHA,
    DOUBT,
    E11,
    E12,
    E22,
    EVENT_COLUMNS,
    IMPACT,
    PEAK,
    PHI,
    PSI,
    RATE,
    RESTITUTION,
    SIDE,
    STATE_SIZE,
    STEP_COLUMNS,
    TIME,
)
from twin.rocking.verdict import barrier_margins, impact_slope

EVENT_ROOM = 64
ONE_ROUNDING = 4e-16


@compiled
def accurate_look(
    body: FloatArray,
    pieces: FloatArray,
    rotation: float,
    chosen: Numbers,
    codes: Codes,
    impacts: Counts,
    directions: Signs,
    times: FloatArray,
    peaks: FloatArray,
) -> None:
    """Follow the `chosen` cells with the default method; arguments as for `quick_look`.

    A cell whose verdict needs its neighbours' (see `twin.simulation.overturns`) gets the code it has plus DOUBTFUL.

    Parameters
    ----------
    chosen : ndarray
        Indices of the cells.
    times : ndarray, shape (cells,) or (0,)
        Written where it has room: time at which |rotation| reaches pi/2, s; nan where it stands.
    peaks : ndarray, shape (cells,) or (0,)
        Written where it has room: largest |rotation|, rad; pi/2 where it overturns.
    """
    state = np.zeros(STATE_SIZE)
    steps = np.zeros((0, STEP_COLUMNS))
    events = np.zeros((EVENT_ROOM, EVENT_COLUMNS))
    used = np.zeros(3)
    f = np.zeros(ORDER + 1)
    c = np.zeros(ORDER + 1)
    work = np.zeros((3, ORDER + 1))
    still = np.zeros(7)
    still[1] = math.inf
    for here in chosen:
        state[:] = 0.0
        state[PHI] = abs(rotation)
        state[PSI] = body[ALPHA] - abs(rotation)
        state[PEAK] = abs(rotation)
        if rotation != 0.0:
            state[SIDE] = math.copysign(1.0, rotation)
        used[:] = 0.0
        lifted = rotation != 0.0
        struck = 0
        while True:
            code = march_through(body, state, pieces[here], math.inf, steps, events, used, f, c, work)
            struck, lifted = _counted(events, used, struck, lifted)
            if code != FULL:
                break
        codes[here] = ROCKED if lifted else STAYED
        impacts[here] = 0
        directions[here] = 0
        ahead = 0.0
        around = 0.0
        doubtful = state[DOUBT] != 0.0
        fallen = code == FELL
        if not fallen and state[SIDE] != 0.0:
            ahead, around = barrier_margins(body[ALPHA], body[RESTITUTION], state[PSI], state[RATE])
            doubtful |= _within_error(body, state, ahead, around)
        overturns = fallen or ahead > 0.0 or around > 0.0
        if overturns:
            codes[here] = OVERTURNED
            directions[here] = 1 if state[SIDE] > 0.0 else -1
            impacts[here] = struck
            if not fallen and ahead <= 0.0:
                directions[here] = -directions[here]
                impacts[here] += 1
        if doubtful:
            codes[here] += DOUBTFUL
        if peaks.size > 0:
            peaks[here] = HALF_TURN if overturns else _peak(body, state)
        if times.size > 0:
            times[here] = math.nan
            if overturns:
                if not fallen:
                    code = march(body, state, still, math.inf, steps, events, used, f, c, work)
                if code == FELL:
                    times[here] = state[TIME]


@compiled
def _counted(events: FloatArray, used: FloatArray, struck: int, lifted: bool) -> tuple[int, bool]:
    """Add the events so far to the count of impacts and to whether the block has lifted, and clear them."""
    for k in range(int(used[1])):
        struck += events[k, 2] == IMPACT
        lifted |= events[k, 2] == UPLIFT_EVENT
    used[1] = 0.0
    return struck, lifted


@compiled
def _within_error(body: FloatArray, state: FloatArray, ahead: float, around: float) -> bool:
    """Tell whether the carried error could change the verdict; the rule of `still_base_verdict`."""
    if abs(ahead) <= SAFETY * _spread(state, math.cos(0.5 * state[PSI]), 1.0):
        return True
    if ahead > 0.0:
        return False
    by_phi, by_rate = impact_slope(body[ALPHA], state[PSI], state[RATE])
    return abs(around) <= SAFETY * (body[RESTITUTION] * _spread(state, by_phi, by_rate) + ONE_ROUNDING)


@compiled
def _spread(state: FloatArray, by_phi: float, by_rate: float) -> float:
    variance = by_phi * by_phi * state[E11] + 2.0 * by_phi * by_rate * state[E12] + by_rate * by_rate * state[E22]
    return math.sqrt(max(0.0, variance)) + ONE_ROUNDING


@compiled
def _peak(body: FloatArray, state: FloatArray) -> float:
    """Return the largest |rotation| of a block that stands for ever: so far, or where it turns back once more.

    On a still base sin2(psi / 2) - v2 / 4 does not change in flight, and v = 0 where it turns back.
    """
    if state[SIDE] == 0.0:
        return state[PEAK]
    base = math.sin(0.5 * body[ALPHA])
    half = math.sin(0.5 * state[PSI])
    level = half * half - 0.25 * state[RATE] * state[RATE]
    if state[RATE] < 0.0:
        level = base * base - (body[RESTITUTION] * body[RESTITUTION]) * (base * base - level)
    return max(state[PEAK], body[ALPHA] - 2.0 * math.asin(math.sqrt(max(0.0, level))))
