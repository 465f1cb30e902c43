"""The base's motion to come if the table is ramped down now: the plan for as long as it goes on, then the ramp."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic.dataclasses import dataclass

from excitation.quantity import VALUE, quantity
from twin.forecast.compiled import compiled
from twin.forecast.course import (
    JERK,
    JUMP_STEPS,
    K0,
    K1,
    K2,
    K3,
    LENGTH,
    LONGEST,
    POSITION,
    START,
    STRONGEST,
    VELOCITY,
    cubic,
)
from twin.forecast.loop import follow
from twin.rocking.compiled import FloatArray

# Rows a ramp may take, beyond those of the plan before it.
RAMP_ROWS = 128
# A table told to go no faster, m/s, stands.
SLOWEST = 1e-4
LONGEST_RAMP = 100


@dataclass(frozen=True, config=VALUE)
class RampDown:
    """How a table stops when a run is broken off: the drive's quick stop.

    Parameters
    ----------
    deceleration : float
        m/s2, above 0: gentle, under g tan(alpha) with a margin (`twin.stopping.stop_deceleration`).
    limit : float or None
        Soft limit of the position to either side of 0, m; the deceleration is the least that stops before it where the
        gentle one does not. None: there is always room.
    steepest : float
        The table's own limit, m/s2: no ramp is steeper, whatever the room.
    reaction : float
        From the decision to the first set-point of the ramp, s.
    until : float or None
        Time of the plan from which on no decision stops the table any more, s: a released machine may be one that only
        its end stop stops. None: it can always be stopped.
    """

    deceleration: Annotated[float, quantity("m/s2", above=0.0)]
    limit: Annotated[float, quantity("m", above=0.0)] | None = None
    steepest: Annotated[float, quantity("m/s2", above=0.0)] = 1e6
    reaction: Annotated[float, quantity("s", at_least=0.0)] = 1e-3
    until: Annotated[float, quantity("s", at_least=0.0)] | None = None


@compiled
def deceleration_for(velocity: float, position: float, gentle: float, limit: float, steepest: float) -> float:
    """Return the deceleration, m/s2: the gentle one, or the least that stops before the limit, v^2 / (2 room)."""
    room = limit - math.copysign(1.0, velocity) * position
    least = steepest if room <= 0.0 else velocity * velocity / (2.0 * room)
    return min(max(gentle, least), steepest)


@compiled
def interval_at(course: FloatArray, tau: float) -> int:
    """Return the interval that holds time `tau`, 1/p; the last row's number after the end."""
    low = 0
    high = course.shape[0] - 1
    while low < high:
        middle = (low + high) // 2
        if course[middle, START] + course[middle, LENGTH] <= tau:
            low = middle + 1
        else:
            high = middle
    return low


@compiled
def lay_ramp(
    course: FloatArray,
    first: int,
    now: float,
    act: float,
    loop: FloatArray,
    stop: FloatArray,
    p: float,
    gravity: float,
    rows: FloatArray,
) -> int:
    """Write what is left of the plan from `now` to `act` (1/p), the ramp, and a last row; return the number of rows.

    Parameters
    ----------
    first : int
        The plan's interval that holds `now`.
    loop : ndarray, shape (2,)
        w rad/s (0 for none) and zeta.
    stop : ndarray, shape (3,)
        Gentle deceleration m/s2, limit m, steepest m/s2.
    rows : ndarray, shape (n, COLUMNS)
        Written.
    """
    last = course.shape[0] - 1
    n = 0
    here = first
    while here < last and course[here, START] < act and n < rows.shape[0] - RAMP_ROWS:
        rows[n] = course[here]
        if course[here, START] + course[here, LENGTH] > act:
            rows[n, LENGTH] = act - course[here, START]
            n += 1
            break
        n += 1
        here += 1
    if n == 0 and act > now:
        # Before the plan, or after it.
        rows[0] = 0.0
        rows[0, START] = now
        rows[0, LENGTH] = act - now
        rows[0, VELOCITY] = course[first, VELOCITY]
        rows[0, POSITION] = course[first, POSITION]
        n = 1
    here = min(here, last)
    x = max(0.0, act - course[here, START])
    a, da, v, position = table_at(course[here], x, p, gravity)
    w = loop[0]
    zeta = loop[1]
    lag = 2.0 * zeta / w if w > 0.0 else 0.0
    quick = 1.0 / (w * w) if w > 0.0 else 0.0
    told = v + lag * a + quick * da
    place = position + lag * v + quick * a
    u = 0.0
    length = 0.0
    if abs(told) > SLOWEST:
        d = deceleration_for(told, place, stop[0], stop[1], stop[2])
        u = -math.copysign(d, told)
        length = abs(told) / d
    if w == 0.0:
        a = u
        da = 0.0
    t = act
    for part in range(2):
        left = p * length if part == 0 else (p * JUMP_STEPS / w if w > 0.0 else 0.0)
        push = u if part == 0 else 0.0
        if part == 1 and w == 0.0:
            a = 0.0
        longest = max(LONGEST, left / LONGEST_RAMP)
        taken = 0
        while left > 0.0:
            h = min(left, longest)
            if w > 0.0 and taken < JUMP_STEPS:
                h = min(h, p / w)
            if left - h < 0.2 * h:
                h = left
            taken += 1
            a, da, v, position = _ramp_row(rows[n], t, h, a, da, v, position, push, w, zeta, p, gravity)
            t += h
            left -= h
            n += 1
    rows[n] = 0.0
    rows[n, START] = t
    rows[n, VELOCITY] = v
    rows[n, POSITION] = position
    return n + 1


@compiled
def table_at(row: FloatArray, x: float, p: float, gravity: float) -> tuple[float, float, float, float]:
    """Return a, da/dt, velocity and position of the table `x` (1/p) after the start of an interval."""
    k0, k1, k2, k3 = row[K0], row[K1], row[K2], row[K3]
    a = gravity * (k0 + x * (k1 + x * (k2 + x * k3)))
    da = gravity * p * (k1 + x * (2.0 * k2 + x * 3.0 * k3))
    once = x * (k0 + x * (k1 / 2.0 + x * (k2 / 3.0 + x * k3 / 4.0)))
    twice = x * x * (k0 / 2.0 + x * (k1 / 6.0 + x * (k2 / 12.0 + x * k3 / 20.0)))
    v = row[VELOCITY] + gravity / p * once
    position = row[POSITION] + row[VELOCITY] * x / p + gravity / (p * p) * twice
    return a, da, v, position


@compiled
def _ramp_row(
    row: FloatArray,
    start: float,
    length: float,
    a: float,
    da: float,
    v: float,
    position: float,
    u: float,
    w: float,
    zeta: float,
    p: float,
    gravity: float,
) -> tuple[float, float, float, float]:
    """Write one interval under the constant command `u`; return a, da/dt, velocity and position at its end."""
    h = length / p
    new = u
    rate = 0.0
    velocity = v + u * h
    place = position + v * h + 0.5 * u * h * h
    if w > 0.0:
        new, rate = follow(w, zeta, a, da, u, 0.0, h)
        lag = 2.0 * zeta / w
        quick = 1.0 / (w * w)
        velocity -= lag * (new - a) + quick * (rate - da)
        place -= lag * (velocity - v - a * h) + quick * (new - a - da * h)
    mean = (velocity - v) / h
    moment = (place - position - v * h) / (h * h)
    c1, c2, c3 = cubic(new - a, mean - a, moment - 0.5 * a)
    row[:] = 0.0
    row[START] = start
    row[LENGTH] = length
    row[K0] = a / gravity
    row[K1] = c1 / gravity / length
    row[K2] = c2 / gravity / (length * length)
    row[K3] = c3 / gravity / (length * length * length)
    row[STRONGEST] = (max(abs(a), abs(new)) + abs(c2) + abs(c3)) / gravity
    row[VELOCITY] = v
    row[POSITION] = position
    row[JERK] = da
    return new, rate, velocity, place
