"""Every stop of a run: the motion from the moment it is broken off on, how long and how far it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from twin.foresight import REACTION_CYCLES
from twin.rocking.compiled import FloatArray
from twin.whole_run.following import ACCELERATION, POSITION, VELOCITY, asleep, stop, story
from twin.whole_run.marching import Offsets, join
from twin.whole_run.performed import Followed

How = Literal["ramp-down", "power cut", "run broken off"]

STANDING = 1e-3
"""A table slower than this stands, m/s."""
SLACK = 1e-4
"""A table this little beyond its soft limit, m, is within it: the loop overshoots its set-points."""
NOTHING = np.zeros((0, 7))
STRAIGHT = 1e-4
"""Share of g tan(alpha) within which samples of a stop's acceleration are taken for a straight line."""


@dataclass(frozen=True, slots=True)
class Stop:
    """The base's motion from the moment a stop is decided on.

    Attributes
    ----------
    rows : ndarray, shape (n, 7)
        Pieces of its acceleration, in times of the run; still afterwards.
    duration, distance : float
        Until it stands, s and m.
    furthest : float
        Largest |position|, m.
    strongest : float
        Largest |acceleration|, m/s2.
    beyond : float
        Speed with which it passes the soft limit, m/s; 0 where it does not.
    """

    rows: FloatArray
    duration: float
    distance: float
    furthest: float
    strongest: float
    beyond: float = 0.0


@dataclass(frozen=True, slots=True)
class Drive:
    """How the drive stops: gentle deceleration, m/s2; soft limit to either side of 0, m; the most there is, m/s2."""

    gentle: float
    half: float
    steepest: float


def ramps(followed: Followed, drive: Drive, moments: list[int], straight: float) -> Iterator[Stop]:
    """Return the ramp-down from each of the `moments`, points of the run; samples `straight` m/s2 off a line are on it.

    The decision takes `REACTION_CYCLES` to reach the drive; the plan goes on meanwhile.
    """
    if followed.mechanics.follows_exactly:
        yield from (_exact_ramp(followed, drive, k) for k in moments)
        return
    mechanics, cycle = followed.mechanics, followed.cycle
    settling = math.ceil(mechanics.settling / cycle)
    top = float(np.max(np.abs(np.diff(followed.points)))) / cycle
    longest = math.ceil(top / (drive.gentle * cycle)) + 10
    room = 8 + math.ceil(mechanics.delay / cycle) + REACTION_CYCLES + longest + settling
    buffer, motion, rows = np.zeros(room), np.zeros((3, room)), np.zeros((room, 7))
    told = np.zeros(4)
    numbers, points, made, delay = mechanics.numbers, followed.points, followed.made, mechanics.delay
    for k in moments:
        if asleep(numbers, points, made, k, cycle, delay, REACTION_CYCLES):
            yield Stop(NOTHING, 0.0, 0.0, abs(float(made[POSITION, k])), 0.0)
            continue
        count = stop(
            numbers,
            points,
            made,
            k,
            REACTION_CYCLES,
            drive.half,
            drive.gentle,
            drive.steepest,
            cycle,
            delay,
            settling,
            longest,
            buffer,
            motion,
        )
        lines = join(motion[ACCELERATION], 0, count - 1, cycle, straight, rows)
        last = story(motion, count, drive.half, SLACK, STANDING, told)
        found = rows[:lines].copy()
        found[:, :2] += k * cycle
        found[1:, 0] = found[:-1, 1]
        distance, furthest, strongest, beyond = told.tolist()
        yield Stop(found, last * cycle, distance, furthest, strongest, beyond)


def _exact_ramp(followed: Followed, drive: Drive, moment: int) -> Stop:
    """Return the ramp of a table that is where it is told to be: what is left of the plan, then one deceleration."""
    motion, start = followed.motion, moment * followed.cycle
    act = start + REACTION_CYCLES * followed.cycle
    rows = between(motion.pieces, start, act)
    x, v = motion.displacement(act), motion.velocity(act)
    strongest = float(np.max(np.abs(motion.acceleration(np.linspace(start, act, 5)))))
    if abs(v) <= STANDING:
        return Stop(rows, 0.0, 0.0, abs(x), strongest)
    room = drive.half - math.copysign(1.0, v) * x
    least = drive.steepest if room <= 0.0 else v * v / (2.0 * room)
    deceleration = min(max(drive.gentle, least), drive.steepest)
    length, way = abs(v) / deceleration, v * v / (2.0 * deceleration)
    ramp = np.array([[act, act + length, -math.copysign(deceleration, v), 0.0, 0.0, 0.0, 0.0]])
    end = x + math.copysign(way, v)
    beyond = math.sqrt(max(0.0, v * v - 2.0 * deceleration * max(room, 0.0)))
    return Stop(
        np.concatenate([rows, ramp]),
        act - start + length,
        abs(x - motion.displacement(start)) + way,
        max(abs(x), abs(end)),
        max(strongest, deceleration),
        beyond if beyond > 1e-3 * abs(v) else 0.0,
    )


def cuts(followed: Followed, moments: list[int]) -> Iterator[Stop]:
    """Return what friction alone makes of the table from each of the `moments`, points of the run, without power.

    Up to where the bumper would be met; from there on nothing is known, and the base is taken to stand.
    """
    mechanics, cycle = followed.mechanics, followed.cycle
    friction, bumper = mechanics.braking, mechanics.bumper or math.inf
    for k in moments:
        x, v = float(followed.made[POSITION, k]), float(followed.made[VELOCITY, k])
        start = k * cycle
        if abs(v) <= STANDING:
            yield Stop(NOTHING, 0.0, 0.0, abs(x), 0.0)
            continue
        room = max(0.0, bumper - math.copysign(1.0, v) * x)
        square = v * v - 2.0 * friction * room
        beyond = math.sqrt(max(0.0, square))
        length, way = (abs(v) - beyond) / friction, min(v * v / (2.0 * friction), room)
        row = np.array([[start, start + length, -math.copysign(friction, v), 0.0, 0.0, 0.0, 0.0]])
        rows = row if length > 0.0 else row[:0]
        yield Stop(rows, length, way, max(abs(x), abs(x + math.copysign(way, v))), friction, beyond)


def between(pieces: FloatArray, start: float, end: float) -> FloatArray:
    """Return the parts of `pieces` from `start` to `end`, s, each with its origin moved to where it now begins."""
    rows = pieces[(pieces[:, 1] > start) & (pieces[:, 0] < end)].copy()
    if not len(rows):
        return rows
    late = np.maximum(start - rows[:, 0], 0.0)
    rows[:, 2] += rows[:, 3] * late
    rows[:, 6] += rows[:, 5] * late
    rows[:, 0] += late
    rows[:, 1] = np.minimum(rows[:, 1], end)
    return rows[rows[:, 1] > rows[:, 0]]


def laid(stops: list[Stop]) -> tuple[FloatArray, Offsets]:
    """Return the rows of all stops one after the other, and where each begins; for compiled code."""
    counts = [0, *(len(stop.rows) for stop in stops)]
    rows = [stop.rows for stop in stops if len(stop.rows)]
    return np.concatenate([np.zeros((0, 7)), *rows]), np.cumsum(counts).astype(np.int64)
