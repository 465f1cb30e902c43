"""The block along a run and along every stop, compiled: states at moments, outcomes, what the contact has to bear."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.rocking.march import FELL, REACHED, march, march_through
from twin.rocking.methods.equations import FULL_EQUATION
from twin.rocking.methods.judgement import still_base_verdict
from twin.rocking.series import C0, C1, T0, T1, base_acceleration
from twin.rocking.state import ALPHA, DOUBT, EVENT_COLUMNS, GRAVITY, PHI, PSI, RATE, SIDE, STEP_COLUMNS, TIME
from twin.whole_run.compiled import compiled

Codes = NDArray[np.uint8]
Offsets = NDArray[np.int64]

STANDS, FALLS, UNDECIDED = range(3)
# Added to an outcome that an error as large as rounding might change.
DOUBTFUL = 16
FRICTION, FRICTION_TIME, NORMAL, NORMAL_TIME = range(4)


@compiled
def join(acceleration: FloatArray, first: int, last: int, cycle: float, tolerance: float, rows: FloatArray) -> int:
    """Write the acceleration between samples `first` and `last` as straight lines; return how many.

    A line takes as many cycles as it passes within `tolerance`, m/s2, of. `rows`, shape (n, 7), has room for one a
    cycle; times are those of the samples, `cycle` s apart from 0.
    """
    n = 0
    here = first
    while here < last:
        end = here + 1
        while end < last:
            slope = (acceleration[end + 1] - acceleration[here]) / (end + 1 - here)
            off = 0.0
            for k in range(here + 1, end + 1):
                off = max(off, abs(acceleration[here] + slope * (k - here) - acceleration[k]))
            if off > tolerance:
                break
            end += 1
        rows[n] = 0.0
        rows[n, T0] = here * cycle
        rows[n, T1] = end * cycle
        rows[n, C0] = acceleration[here]
        rows[n, C1] = (acceleration[end] - acceleration[here]) / ((end - here) * cycle)
        n += 1
        here = end
    return n


@compiled
def judge(body: FloatArray, state: FloatArray, code: int) -> int:
    """Return what becomes of the block if the base stands still from now on, `DOUBTFUL` added where it may not."""
    falls, doubt = still_base_verdict(FULL_EQUATION, body, state, code)
    outcome = FALLS if falls else STANDS
    return outcome + DOUBTFUL if doubt or state[DOUBT] != 0.0 else outcome


@compiled
def visit(
    body: FloatArray,
    state: FloatArray,
    pieces: FloatArray,
    moments: FloatArray,
    states: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> int:
    """Take the block through the run; write its state at each of the rising `moments`, s; return how the run ends.

    From the moment it lies on its side on, `states` hold that one.
    """
    used = np.zeros(3)
    no_steps = np.zeros((0, STEP_COLUMNS))
    no_events = np.zeros((0, EVENT_COLUMNS))
    still = np.zeros(7)
    code = REACHED
    row = 0
    for k in range(moments.size):
        while code == REACHED and row < pieces.shape[0] and pieces[row, T0] < moments[k]:
            end = min(pieces[row, T1], moments[k])
            code = march(body, state, pieces[row], end, no_steps, no_events, used, f, c, work)
            if pieces[row, T1] > moments[k]:
                break
            row += 1
        if code == REACHED and state[TIME] < moments[k]:
            # The run is over; the base stands still.
            code = march(body, state, still, moments[k], no_steps, no_events, used, f, c, work)
        states[k] = state
    if code == REACHED:
        used[2] = row
        code = march_through(body, state, pieces, math.inf, no_steps, no_events, used, f, c, work)
    return judge(body, state, code)


@compiled
def stop_outcomes(
    body: FloatArray,
    states: FloatArray,
    rows: FloatArray,
    offsets: Offsets,
    outcomes: Codes,
    contact: FloatArray,
    f: FloatArray,
    c: FloatArray,
    work: FloatArray,
) -> None:
    """Write what each stop does to the block, and what the contact has to bear in all of them.

    Parameters
    ----------
    states : ndarray, shape (m, STATE_SIZE)
        Of the block as each stop is decided.
    rows, offsets : ndarray, shape (n, 7) and (m + 1,)
        The base's motion from then on: rows offsets[k] to offsets[k + 1] - 1 of stop k.
    outcomes : ndarray, shape (m,)
        Written.
    contact : ndarray, shape (4,)
        Largest |T| / N and when that stop was decided, least N / (m g) and when; written. Looked at where rows begin
        and end, as long as the block has not passed alpha.
    """
    used = np.zeros(3)
    no_steps = np.zeros((0, STEP_COLUMNS))
    no_events = np.zeros((0, EVENT_COLUMNS))
    state = np.zeros(states.shape[1])
    contact[FRICTION] = 0.0
    contact[NORMAL] = 1.0
    for k in range(states.shape[0]):
        state[:] = states[k]
        code = FELL if state[PHI] >= 0.5 * math.pi else 0
        for row in range(offsets[k], offsets[k + 1]):
            if code == FELL:
                break
            piece = rows[row : row + 1]
            bear(body, state, base_acceleration(piece[0], piece[0, T0]), states[k, TIME], contact)
            used[2] = 0.0
            code = march_through(body, state, piece, math.inf, no_steps, no_events, used, f, c, work)
            bear(body, state, base_acceleration(piece[0], piece[0, T1]), states[k, TIME], contact)
        outcomes[k] = judge(body, state, code)


@compiled
def bear(body: FloatArray, state: FloatArray, acceleration: float, decided: float, contact: FloatArray) -> None:
    """Take what the contact bears now into the extremes; the forces are those of `twin.rocking.validity`."""
    if state[PHI] > body[ALPHA]:
        return
    a = acceleration / body[GRAVITY]
    tangential = abs(a)
    normal = 1.0
    if state[SIDE] != 0.0:
        s = math.sin(state[PSI])
        co = math.cos(state[PSI])
        v = state[RATE]
        w = -s - state[SIDE] * a * co
        tangential = abs(a + 0.75 * state[SIDE] * (w * co + v * v * s))
        normal = 1.0 + 0.75 * (w * s - v * v * co)
    needed = tangential / normal if normal > 0.0 else math.inf
    if needed > contact[FRICTION]:
        contact[FRICTION] = needed
        contact[FRICTION_TIME] = decided
    if normal < contact[NORMAL]:
        contact[NORMAL] = normal
        contact[NORMAL_TIME] = decided
