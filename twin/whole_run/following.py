"""A table following set-points, and the drive's ramp when it is told to stop: the emulated ones, compiled.

The table is that of `devices.quanser_st3.mechanics`, in Runge-Kutta steps of 0.25 ms or less with the knots of the
delayed set-point among their ends: with w = 200 rad/s a step errs by 3e-9 of what moves. Where a limit begins or ends
to hold inside a step it errs by the step's length; at the top speed, where it would, the speed is held. The ramp is
that of `devices.cia402.interpolation`.
"""

from __future__ import annotations

import math

from twin.rocking.compiled import FloatArray
from twin.whole_run.compiled import compiled

W, ZETA, STRONGEST, TOP_SPEED, SWITCH, BUMPER, BUMPER_K, BUMPER_C, SUBSTEP = range(9)
POSITION, VELOCITY, ACCELERATION = range(3)
# A table slower than this, m/s, that is pushed by less, m/s2, stands where it is.
STILL = 1e-9
# A knot of the delayed set-point this close to a cycle's end, in cycles, is at its end.
SAME = 1e-9


@compiled
def push(table: FloatArray, r: float, x: float, v: float) -> float:
    """Return the acceleration of the table, m/s2, at set-point `r`, m."""
    w = table[W]
    asked = w * w * (r - x) - 2.0 * table[ZETA] * w * v
    way = 1.0 if asked > 0.0 else -1.0
    a = min(max(asked, -table[STRONGEST]), table[STRONGEST])
    if way * v >= table[TOP_SPEED] or way * x >= table[SWITCH]:
        a = 0.0
    side = 1.0 if x >= table[BUMPER] else -1.0 if x <= -table[BUMPER] else 0.0
    if side != 0.0:
        a -= side * max(0.0, table[BUMPER_K] * (abs(x) - table[BUMPER]) + table[BUMPER_C] * side * v)
    return a


@compiled
def step(table: FloatArray, r: float, slope: float, x: float, v: float, h: float) -> tuple[float, float]:
    """Return position and velocity after `h` s of a set-point `r` + `slope` t: one step of RK4."""
    middle = r + 0.5 * h * slope
    a1 = push(table, r, x, v)
    v2 = v + 0.5 * h * a1
    a2 = push(table, middle, x + 0.5 * h * v, v2)
    v3 = v + 0.5 * h * a2
    a3 = push(table, middle, x + 0.5 * h * v2, v3)
    v4 = v + h * a3
    a4 = push(table, r + h * slope, x + h * v3, v4)
    return x + h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4), v + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4)


@compiled
def part(table: FloatArray, r: float, end: float, x: float, v: float, h: float) -> tuple[float, float]:
    """Return position and velocity after `h` s in which the set-point goes linearly from `r` to `end`."""
    steps = max(1, math.ceil(h / table[SUBSTEP] - SAME))
    slope = (end - r) / h
    for k in range(steps):
        before = abs(v)
        x, v = step(table, r + slope * h * k / steps, slope, x, v, h / steps)
        if abs(v) > table[TOP_SPEED] >= before:
            # The drive has let go within this step.
            v = math.copysign(table[TOP_SPEED], v)
    return x, v


@compiled
def follow(table: FloatArray, points: FloatArray, first: int, cycle: float, delay: float, motion: FloatArray) -> None:
    """Write the table's motion at the ends of the cycles that reach `points`; see the module.

    Parameters
    ----------
    points : ndarray, shape (n,)
        Set-points at the ends of cycles, m; the table stands at the first of them before it.
    first : int
        Of the point the motion is known at: `motion[:, first]`.
    motion : ndarray, shape (3, n)
        Position, velocity, acceleration: written from `first` + 1 on.
    """
    late = int(delay / cycle + SAME)
    knot = delay / cycle - late
    if knot <= SAME:
        knot = 0.0
    x = motion[POSITION, first]
    v = motion[VELOCITY, first]
    for k in range(first + 1, points.size):
        # During cycle k the loop sees the line from point k - 1 - late to k - late, from `knot` of the cycle on.
        one = points[max(0, k - 2 - late)]
        two = points[max(0, k - 1 - late)]
        three = points[max(0, k - late)]
        here = two
        if knot > 0.0:
            x, v = part(table, two - knot * (two - one), two, x, v, knot * cycle)
        there = two + (1.0 - knot) * (three - two)
        x, v = part(table, here, there, x, v, (1.0 - knot) * cycle)
        motion[POSITION, k] = x
        motion[VELOCITY, k] = v
        motion[ACCELERATION, k] = push(table, there, x, v)


@compiled
def ramp(points: FloatArray, last: int, half: float, gentle: float, steepest: float, cycle: float, longest: int) -> int:
    """Write the set-points of the drive's stop behind point `last`; return the number of the one it stands at.

    Parameters
    ----------
    half : float
        Soft limit to either side of 0, m.
    gentle, steepest : float
        Deceleration where there is room, and the most there is, m/s2.
    longest : int
        Cycles after which it is given up; there is room for that many.
    """
    position = points[last]
    velocity = (position - points[last - 1]) / cycle if last > 0 else 0.0
    n = last
    while velocity != 0.0 and n - last < longest:
        speed = abs(velocity)
        room = max(0.0, half - position if velocity > 0.0 else position + half)
        # Steps that lose d h of velocity each stop within (v - d h / 2)^2 / (2 d); the least d for the room left.
        s = speed * cycle + 2.0 * room
        least = 2.0 * speed * speed / (s + math.sqrt(max(0.0, s * s - speed * speed * cycle * cycle)))
        slower = max(0.0, speed - max(gentle, min(least, steepest)) * cycle)
        velocity = math.copysign(slower, velocity) if slower > 0.0 else 0.0
        position += velocity * cycle
        n += 1
        points[n] = position
    return n


@compiled
def stop(
    table: FloatArray,
    points: FloatArray,
    made: FloatArray,
    decided: int,
    ahead: int,
    half: float,
    gentle: float,
    steepest: float,
    cycle: float,
    delay: float,
    settling: int,
    longest: int,
    buffer: FloatArray,
    motion: FloatArray,
) -> int:
    """Write the table's motion when a stop is decided at point `decided`; return how many points it has.

    Parameters
    ----------
    points, made : ndarray, shape (n,) and (3, n)
        The whole run's set-points, and what the table makes of them.
    ahead : int
        Points after the decided one that are still those of the plan.
    half, gentle, steepest
        As for `ramp`.
    settling, longest : int
        Cycles for the table to come after its set-point, and the most a ramp may take.
    buffer, motion : ndarray, shape (m,) and (3, m)
        Written: set-points and motion, of which point 0 is the decided one. Room for ahead + longest + settling + 1
        points and those the delay looks back to.
    """
    back = min(decided, int(delay / cycle + SAME) + 2)
    count = back + ahead + 1
    for k in range(count):
        buffer[k] = points[min(decided - back + k, points.size - 1)]
    last = ramp(buffer, count - 1, half, gentle, steepest, cycle, longest)
    for k in range(last + 1, last + 1 + settling):
        buffer[k] = buffer[last]
    total = last + 1 + settling
    for row in range(3):
        motion[row, back] = made[row, decided]
    follow(table, buffer[:total], back, cycle, delay, motion[:, :total])
    for k in range(back, total):
        for row in range(3):
            motion[row, k - back] = motion[row, k]
        buffer[k - back] = buffer[k]
    return total - back


@compiled
def asleep(
    table: FloatArray, points: FloatArray, made: FloatArray, decided: int, cycle: float, delay: float, ahead: int
) -> bool:
    """Return whether neither the table nor its set-point moves from `decided` on, until the stop takes effect."""
    back = int(delay / cycle + SAME) + 2
    here = points[decided]
    for k in range(max(0, decided - back), min(decided + ahead + 1, points.size)):
        if points[k] != here:
            return False
    return abs(made[VELOCITY, decided]) < STILL and abs(push(table, here, made[POSITION, decided], 0.0)) < STILL


@compiled
def story(motion: FloatArray, count: int, half: float, slack: float, slowest: float, told: FloatArray) -> int:
    """Write distance, largest |position| and |acceleration|, and largest |velocity| beyond `half` + `slack`, m.

    Returns
    -------
    int
        The last of the first `count` points at which the table is faster than `slowest`, m/s; 0 where none is.
    """
    told[:] = 0.0
    last = 0
    way = 0.0
    for k in range(count):
        if k > 0:
            way += abs(motion[POSITION, k] - motion[POSITION, k - 1])
        speed = abs(motion[VELOCITY, k])
        if k > 0 and speed > slowest:
            last = k
            told[0] = way
        told[1] = max(told[1], abs(motion[POSITION, k]))
        told[2] = max(told[2], abs(motion[ACCELERATION, k]))
        if abs(motion[POSITION, k]) > half + slack:
            told[3] = max(told[3], speed)
    return last
