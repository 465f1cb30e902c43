"""The base's motion to come as intervals with a cubic acceleration, in the units of the solver.

An interval keeps, of the motion it stands for, the acceleration at both ends and the change of velocity and of place:
with u = t / h on [0, 1] and a = c0 + c1 u + c2 u^2 + c3 u^3,

    a(0),   a(1),   int a du = dv / h,   int (1 - u) a du = (dx - v0 h) / h^2.

What a block makes of a base motion depends on it through these to the order of an interval: a blow of 5 ms may be one
interval, and samples closer than the block can tell apart may be taken together, without a drift.
"""

from __future__ import annotations

import numpy as np

from excitation.pieces import PieceTable
from twin.forecast.compiled import compiled
from twin.forecast.loop import TableLoop, follow
from twin.rocking.compiled import FloatArray

# Columns of an interval: start and length, 1/p; k0 to k3 of a / g in powers of the time since its start; largest
# |a| / g; at its start the table's velocity m/s, position m, and da/dt m/s3.
(START, LENGTH, K0, K1, K2, K3, STRONGEST, VELOCITY, POSITION, JERK) = range(10)
COLUMNS = 10
# No interval is longer, but on a still base: in units of 1/p, and in radians of a sine. Samples closer than CLOSEST,
# 1/p, are joined.
LONGEST = 0.2
SINE_STEP = 0.4
CLOSEST = 0.05
SHORTEST = 1e-4  # s
# An acceleration below, over g, is none: what a loop has left after some time constants.
STILL = 1e-7
# After a jump of the command the loop's answer is laid out in steps of 1/w, this many.
JUMP_STEPS = 7
# A smaller jump is none, m/s2.
SMALLEST_JUMP = 1e-3
# A sine is given to the loop in straight lines this long, rad: it is off by 1e-5 of its amplitude.
LINE = 0.01


@compiled
def cubic(rise: float, mean: float, moment: float) -> tuple[float, float, float]:
    """Return c1, c2, c3 from a(1) - a(0), int a du - a(0) and int (1 - u) a du - a(0) / 2."""
    c1 = 3.0 * rise - 24.0 * mean + 60.0 * moment
    c2 = -12.0 * rise + 84.0 * mean - 180.0 * moment
    c3 = 10.0 * rise - 60.0 * mean + 120.0 * moment
    return c1, c2, c3


def lay_course(pieces: FloatArray, loop: TableLoop, p: float, gravity: float) -> FloatArray:
    """Return the intervals of what a table makes of planned `pieces`, and a last one of no length at their end.

    Parameters
    ----------
    pieces : ndarray, shape (n, 7)
        Of the command, see `excitation.Pulse.pieces`; no rows for a table that stands still.
    loop : TableLoop
    p, gravity : float
        rad/s and m/s2.

    Returns
    -------
    ndarray, shape (m + 1, COLUMNS)
        Contiguous from time 0 of the plan. The last row holds where the table gets to, at whatever velocity.
    """
    if not len(pieces):
        return np.zeros((1, COLUMNS))
    command = PieceTable(_commanded(pieces, loop))
    nodes = _nodes(command, loop, p)
    right, left = command.acceleration(nodes), _from_the_left(command, nodes)
    velocity, position = command.velocity(nodes), command.displacement(nodes)
    jerk = np.zeros_like(nodes)
    w = loop.angular_frequency
    if w > 0.0:
        right, jerk = _followed(command, loop, nodes)
        left = right
        # The loop's equation, integrated once and twice from rest.
        velocity = velocity - 2.0 * loop.damping / w * right - jerk / (w * w)
        position = position - 2.0 * loop.damping / w * velocity - right / (w * w)
    course = np.zeros((len(nodes), COLUMNS))
    course[:, START] = p * nodes
    course[:, VELOCITY], course[:, POSITION], course[:, JERK] = velocity, position, jerk
    h = np.diff(nodes)
    course[:-1, LENGTH] = p * h
    a0, a1 = right[:-1], left[1:]
    # In a moment too short for its change of place to be told from rounding the acceleration is a straight line.
    short = h < SHORTEST
    mean = np.where(short, 0.5 * (a0 + a1), np.diff(velocity) / h)
    moment = np.where(short, (2.0 * a0 + a1) / 6.0, (np.diff(position) - velocity[:-1] * h) / (h * h))
    shape = np.array([cubic(*given) for given in zip(a1 - a0, mean - a0, moment - 0.5 * a0, strict=True)]).T
    course[:-1, K0] = a0 / gravity
    for k in range(3):
        course[:-1, K1 + k] = shape[k] / gravity / (p * h) ** (k + 1)
    u = np.linspace(0.0, 1.0, 9)
    values = a0[:, None] + (shape[0][:, None] + (shape[1][:, None] + shape[2][:, None] * u) * u) * u
    course[:-1, STRONGEST] = np.max(np.abs(values), axis=1) / gravity
    return _still_joined(course)


def _still_joined(course: FloatArray) -> FloatArray:
    """Return the course with intervals of a still base that follow each other as one, of whatever length."""
    still = course[:, STRONGEST] < STILL
    still[-1] = False
    course[still, K0 : STRONGEST + 1] = 0.0
    kept = course[~(still & np.append(False, still[:-1]))]
    kept[:-1, LENGTH] = np.where(kept[:-1, STRONGEST] == 0.0, np.diff(kept[:, START]), kept[:-1, LENGTH])
    return kept


def _commanded(pieces: FloatArray, loop: TableLoop) -> FloatArray:
    """Return the pieces as they reach the loop: times the gain, late by the delay, and with time to settle after."""
    rows = pieces.copy()
    rows[:, 2:5] *= loop.gain
    rows[:, :2] += loop.delay
    parts = [rows]
    if loop.delay > 0.0:
        parts.insert(0, np.array([[0.0, rows[0, 0], 0.0, 0.0, 0.0, 0.0, 0.0]]))
    if loop.frequency is not None:
        end = rows[-1, 1]
        parts.append(np.array([[end, end + JUMP_STEPS / loop.angular_frequency, 0.0, 0.0, 0.0, 0.0, 0.0]]))
    return np.concatenate(parts)


def _from_the_left(command: PieceTable, times: FloatArray) -> FloatArray:
    """Return the acceleration just before each time, m/s2."""
    index = np.maximum(np.searchsorted(command.boundaries, times, side="left") - 1, 0)
    index = np.minimum(index, len(command.rows) - 1)
    return command.acceleration_in(index, times - command.rows[index, 0])


def _nodes(command: PieceTable, loop: TableLoop, p: float) -> FloatArray:
    """Return the ends of the intervals, s: jumps, breaks that lie apart, and points between them where they lie far."""
    breaks = command.boundaries
    jumps = np.abs(command.acceleration(breaks) - _from_the_left(command, breaks)) > SMALLEST_JUMP
    if loop.frequency is None:
        # A blow after a pause keeps both its ends: joined to a neighbour it would act too early.
        long = np.diff(breaks) >= CLOSEST / p
        jumps[:-1] |= long
        jumps[1:] |= long
    jumps[0] = jumps[-1] = True
    nodes = breaks[jumps]
    if loop.frequency is not None:
        w = loop.angular_frequency
        settling = (nodes[:, None] + np.arange(1, JUMP_STEPS + 1) / w).ravel()
        nodes = _joined(nodes, settling[settling < breaks[-1]], 0.5 / w)
    nodes = _joined(nodes, breaks[~jumps], CLOSEST / p)
    index = np.minimum(np.searchsorted(breaks, 0.5 * (nodes[1:] + nodes[:-1]), side="right") - 1, len(command.rows) - 1)
    omega = np.where(command.rows[index, 4] != 0.0, command.rows[index, 5], 0.0)
    longest = np.minimum(LONGEST / p, SINE_STEP / np.maximum(omega, 1e-12))
    parts = np.maximum(1, np.ceil(np.diff(nodes) / longest - 1e-9).astype(int))
    filled: list[FloatArray] = []
    for start, end, count in zip(nodes[:-1].tolist(), nodes[1:].tolist(), parts.tolist(), strict=True):
        filled.append(start + (end - start) / count * np.arange(count, dtype=np.float64))
    return np.concatenate([*filled, nodes[-1:]])


def _joined(kept: FloatArray, more: FloatArray, closest: float) -> FloatArray:
    """Return the times that are kept, and those of `more` that are not closer to them or to each other, in order."""
    chosen: list[float] = []
    ordered = np.sort(more)
    after = np.searchsorted(kept, ordered)
    below = kept[np.maximum(after - 1, 0)]
    above = kept[np.minimum(after, len(kept) - 1)]
    free = ordered[np.minimum(np.abs(ordered - below), np.abs(above - ordered)) >= closest]
    last = -np.inf
    for time in map(float, free):
        if time - last >= closest:
            chosen.append(time)
            last = time
    return np.sort(np.concatenate([kept, np.array(chosen)]))


def _followed(command: PieceTable, loop: TableLoop, nodes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the loop's a and da/dt at `nodes`; every line of the command is exact, sines are given in short lines."""
    fine = [nodes, command.boundaries]
    for t0, t1, _, _, amplitude, omega, _ in command.rows.tolist():
        if amplitude != 0.0:
            lines = 1 + int(omega * (t1 - t0) / LINE)
            fine.append(t0 + (t1 - t0) / lines * np.arange(lines, dtype=np.float64))
    times = np.unique(np.concatenate(fine))
    answer = np.zeros((2, len(times)))
    u, before = command.acceleration(times), _from_the_left(command, times)
    _march_loop(loop.angular_frequency, loop.damping, times, u, before, answer)
    at = np.searchsorted(times, nodes)
    return answer[0, at], answer[1, at]


@compiled
def _march_loop(
    w: float, zeta: float, times: FloatArray, u: FloatArray, before: FloatArray, answer: FloatArray
) -> None:
    """Write the loop's a and da/dt at `times`, from rest, under the command's `u` there, `before` on the left."""
    for k in range(times.size - 1):
        h = times[k + 1] - times[k]
        slope = (before[k + 1] - u[k]) / h
        answer[0, k + 1], answer[1, k + 1] = follow(w, zeta, answer[0, k], answer[1, k], u[k], slope, h)
