"""A stack of blocks by another way: every body with its own coordinates, contacts as constraints, SciPy's DOP853.

Plain and slow, to check `twin.stack` against. Nothing of it is used here. Body i has coordinates (x, z, rotation) of
its centre; a contact at a corner holds two material points together, a closed one the middles of the faces and the
rotations:

    M q'' = F + J^T l,   J q'' = -J' q',   F = (-m a, -m g, 0)   in the frame of the base

An impact keeps the positions and projects the velocities: M (v+ - v-) = J^T L, J v+ = 0, J being that of the
candidate's contacts.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

TOLERANCE = 1e-9
"""Of the checks of an impact, relative to its own rates and impulses."""
SLOW = 1e-5
"""Closing rate of an impact below which a run ends, rad/s."""
SAMPLES = np.linspace(0.0, 1.0, 9)[1:]
FIRST_SAMPLES = np.concatenate([np.geomspace(1e-7, 0.1, 22), SAMPLES])
"""Where in a step, and in the first one of a flight, which may be short, the guards are looked at."""


@dataclass(frozen=True)
class Body:
    width: float
    height: float
    mass: float

    @property
    def inertia(self) -> float:
        return self.mass * (self.width**2 + self.height**2) / 12.0


@dataclass
class History:
    """What happened: configurations with their times, impacts (time, interface, rates before and after), the end."""

    configurations: list[tuple[float, tuple[int, ...]]] = field(default_factory=list)
    impacts: list[tuple[float, int, np.ndarray, np.ndarray]] = field(default_factory=list)
    pieces: list[tuple[float, float, Callable[[float], np.ndarray]]] = field(default_factory=list)
    end: str = "duration"
    time: float = 0.0

    def rotations(self, t: float) -> np.ndarray:
        for start, stop, dense in self.pieces:
            if start <= t <= stop:
                return dense(t)[: dense(t).size // 2]
        raise ValueError(t)


def up(angle: float) -> np.ndarray:
    return np.array([np.sin(angle), np.cos(angle)])


def right(angle: float) -> np.ndarray:
    return np.array([np.cos(angle), -np.sin(angle)])


class IndependentStack:
    """Bodies from the base up, under gravity `g`."""

    def __init__(self, bodies: list[Body], g: float = 9.81) -> None:
        self.bodies, self.g, self.n = bodies, g, len(bodies)
        widths = [body.width for body in bodies]
        self.c = [0.5 * min(w, below) for w, below in zip(widths, [widths[0], *widths[:-1]], strict=True)]
        self.mass = np.diag([x for body in bodies for x in (body.mass, body.mass, body.inertia)])

    def points(self, i: int, s: int, angles: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """First and second derivative by the rotation: contact point from the upper, then the lower centre."""
        c, h = self.c[i], self.bodies[i].height
        u, r = up(angles[i]), right(angles[i])
        upper = (-0.5 * h * r - s * c * u, 0.5 * h * u - s * c * r)
        if i == 0:
            return *upper, np.zeros(2), np.zeros(2)
        hl = self.bodies[i - 1].height
        ul, rl = up(angles[i - 1]), right(angles[i - 1])
        return *upper, 0.5 * hl * rl - s * c * ul, -0.5 * hl * ul - s * c * rl

    def contacts(self, sides: tuple[int, ...], angles: np.ndarray, rates: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """J and J' q'."""
        rows, bias = [], []
        for i, s in enumerate(sides):
            du, ddu, dl, ddl = self.points(i, s, angles)
            for axis in range(2):
                row = np.zeros(3 * self.n)
                row[3 * i + axis] = 1.0
                row[3 * i + 2] = du[axis]
                b = ddu[axis] * rates[i] ** 2
                if i:
                    row[3 * i - 3 + axis] = -1.0
                    row[3 * i - 1] = -dl[axis]
                    b -= ddl[axis] * rates[i - 1] ** 2
                rows.append(row)
                bias.append(b)
            if s == 0:
                row = np.zeros(3 * self.n)
                row[3 * i + 2] = 1.0
                if i:
                    row[3 * i - 1] = -1.0
                rows.append(row)
                bias.append(0.0)
        return np.array(rows), np.array(bias)

    def solve(
        self, sides: tuple[int, ...], angles: np.ndarray, rates: np.ndarray, a: float
    ) -> tuple[np.ndarray, list[tuple[float, float]]]:
        """Angular accelerations, and each contact's normal force N and its N d, d being the centre's distance to +x."""
        jacobian, bias = self.contacts(sides, angles, rates)
        force = np.array([x for body in self.bodies for x in (-body.mass * a, -body.mass * self.g, 0.0)])
        k = len(bias)
        matrix = np.block([[self.mass, -jacobian.T], [jacobian, np.zeros((k, k))]])
        solution = np.linalg.solve(matrix, np.concatenate([force, -bias]))
        return solution[2 : 3 * self.n : 3], self.reactions(sides, angles, solution[3 * self.n :])

    def reactions(
        self, sides: tuple[int, ...], angles: np.ndarray, multipliers: np.ndarray
    ) -> list[tuple[float, float]]:
        loads, at = [], 0
        for i, s in enumerate(sides):
            below = 0.0 if i == 0 else angles[i - 1]
            wider = i > 0 and self.bodies[i].width > self.bodies[i - 1].width
            face = angles[i] if wider else below
            normal = float(multipliers[at : at + 2] @ up(face))
            # A normal force N at a distance d towards +x turns the upper body by -d N about the middle.
            loads.append((normal, s * self.c[i] * normal if s else -float(multipliers[at + 2])))
            at += 2 if s else 3
        return loads

    def velocities(self, sides: tuple[int, ...], angles: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Body velocities (x, z, rotation) for rotation rates that keep the contacts."""
        v = np.zeros(3 * self.n)
        for i, s in enumerate(sides):
            du, _, dl, _ = self.points(i, s, angles)
            lower = v[3 * i - 3 : 3 * i - 1] + dl * v[3 * i - 1] if i else np.zeros(2)
            v[3 * i : 3 * i + 2] = lower - du * rates[i]
            v[3 * i + 2] = rates[i]
        return v

    def impacts(
        self, sides: tuple[int, ...], near: list[int], angles: np.ndarray, rates: np.ndarray
    ) -> list[tuple[tuple[int, ...], np.ndarray]]:
        """Every candidate the contacts allow: sides and rotation rates after."""
        before = self.velocities(sides, angles, rates)
        gap_rates = np.diff(rates, prepend=0.0)
        scale = max(abs(gap_rates[i]) for i in near)
        found = []
        for choice in itertools.product((-1, 0, 1), repeat=len(near)):
            after = list(sides)
            for i, s in zip(near, choice, strict=True):
                after[i] = s
            jacobian, _ = self.contacts(tuple(after), angles, rates)
            k = len(jacobian)
            matrix = np.block([[self.mass, -jacobian.T], [jacobian, np.zeros((k, k))]])
            solution = np.linalg.solve(matrix, np.concatenate([self.mass @ before, np.zeros(k)]))
            new = solution[2 : 3 * self.n : 3]
            impulses = self.reactions(tuple(after), angles, solution[3 * self.n :])
            largest = max(abs(normal) for normal, _ in impulses)
            opens = all(
                after[i] == 0 or after[i] * (new[i] - (new[i - 1] if i else 0.0)) > TOLERANCE * scale for i in near
            )
            pushes = all(normal >= -TOLERANCE * largest for normal, _ in impulses)
            inside = all(
                abs(moment) <= self.c[i] * (normal + TOLERANCE * largest)
                for i, (normal, moment) in enumerate(impulses)
                if after[i] == 0
            )
            if opens and pushes and inside:
                found.append((tuple(after), new))
        return found

    def run(
        self,
        pieces: np.ndarray,
        duration: float,
        angles: np.ndarray,
        rates: np.ndarray,
        sides: tuple[int, ...],
        *,
        pulls: bool = False,
    ) -> History:
        """Follow the stack under base motion `pieces`, rows (t0, t1, c0, c1, A, omega, psi), and still base after them.

        It ends with the first block at pi/2, a pivot that would have to pull, an impact without exactly one answer, or
        one slower than `SLOW`: a chatter that dies is followed no further.
        """
        h = History(configurations=[(0.0, sides)])
        rows = [row for row in pieces if row[0] < duration]
        last = rows[-1][1] if rows else 0.0
        if last < duration:
            rows.append(np.array([last, duration, 0.0, 0.0, 0.0, 0.0, 0.0]))
        y = np.concatenate([angles, rates]).astype(float)
        for row in rows:
            t, stop = float(row[0]), float(min(row[1], duration))

            def base(time: float, row: np.ndarray = row) -> float:
                s = time - row[0]
                return row[2] + row[3] * s + row[4] * np.sin(row[5] * s + row[6])

            while t < stop:
                sides = self.opened(sides, y, base(t), h, t)
                t, y, sides = self.flight(sides, y, t, stop, base, h, pulls)
                if h.end != "duration":
                    h.time = t
                    return h
        h.time = duration
        return h

    def opened(self, sides: tuple[int, ...], y: np.ndarray, a: float, h: History, t: float) -> tuple[int, ...]:
        """Open every closed interface whose centre of pressure is at, or beyond, its corner; one after the other."""
        for _ in range(self.n):
            _, loads = self.solve(sides, y[: self.n], y[self.n :], a)
            beyond = [
                (abs(moment) / (self.c[i] * normal), i, 1 if moment > 0 else -1)
                for i, (normal, moment) in enumerate(loads)
                if sides[i] == 0 and abs(moment) >= self.c[i] * normal * (1.0 - 1e-12)
            ]
            if not beyond:
                return sides
            _, i, s = max(beyond)
            sides = (*sides[:i], s, *sides[i + 1 :])
            h.configurations.append((t, sides))
        return sides

    def flight(
        self,
        sides: tuple[int, ...],
        y: np.ndarray,
        t: float,
        stop: float,
        base: Callable[[float], float],
        h: History,
        pulls: bool,
    ) -> tuple[float, np.ndarray, tuple[int, ...]]:
        """Integrate until the next event or `stop`; return time, state and sides after it."""
        n = self.n

        def rhs(time: float, z: np.ndarray) -> np.ndarray:
            accelerations, _ = self.solve(sides, z[:n], z[n:], base(time))
            return np.concatenate([z[n:], accelerations])

        def guards(time: float, z: np.ndarray) -> np.ndarray:
            _, loads = self.solve(sides, z[:n], z[n:], base(time))
            gaps = np.diff(z[:n], prepend=0.0)
            first = [sides[i] * gaps[i] if sides[i] else self.c[i] - abs(loads[i][1]) / loads[i][0] for i in range(n)]
            second = [1.0 if pulls or not sides[i] else loads[i][0] for i in range(n)]
            return np.array([*first, *second, *(0.5 * np.pi - np.abs(z[:n]))])

        solution = solve_ivp(
            rhs, (t, stop), y, method="DOP853", rtol=1e-12, atol=1e-14, dense_output=True, max_step=0.004
        )
        dense = solution.sol
        for start, end in itertools.pairwise(solution.t):
            times = start + (FIRST_SAMPLES if start == t else SAMPLES) * (end - start)
            values = np.array([guards(time, dense(time)) for time in times])
            if not (values < 0.0).any():
                continue
            events = []
            for g in np.flatnonzero((values < 0.0).any(axis=0)):
                k = int(np.argmax(values[:, g] < 0.0))
                left = float(times[k - 1]) if k else float(start)
                at = times[k] if guards(left, dense(left))[g] <= 0.0 else None
                root = (
                    left
                    if at is not None
                    else brentq(lambda x, g=g: guards(x, dense(x))[g], left, times[k], xtol=1e-15)
                )
                events.append((float(root), int(g)))
            time, g = min(events)
            h.pieces.append((t, time, dense))
            return self.event(g, sides, time, np.array(dense(time)), base, h)
        h.pieces.append((t, stop, dense))
        return stop, np.array(dense(stop)), sides

    def event(
        self,
        g: int,
        sides: tuple[int, ...],
        time: float,
        y: np.ndarray,
        base: Callable[[float], float],
        h: History,
    ) -> tuple[float, np.ndarray, tuple[int, ...]]:
        n = self.n
        if g >= 2 * n:
            h.end = "overturned"
            return time, y, sides
        if g >= n:
            h.end = "pulls"
            return time, y, sides
        if sides[g] == 0:
            _, loads = self.solve(sides, y[:n], y[n:], base(time))
            sides = (*sides[:g], 1 if loads[g][1] > 0 else -1, *sides[g + 1 :])
            h.configurations.append((time, sides))
            return time, y, sides
        angles, rates = y[:n].copy(), y[n:].copy()
        shift = angles[g] - (angles[g - 1] if g else 0.0)
        angles[g:] -= shift  # to the contact, exactly
        near = [i for i in range(n) if i == g or sides[i] == 0]
        if abs(rates[g] - (rates[g - 1] if g else 0.0)) < SLOW:
            h.end = "chatter"
            return time, y, sides
        found = self.impacts(sides, near, angles, rates)
        if len(found) != 1:
            h.end = f"{len(found)} candidates"
            return time, y, sides
        after, new = found[0]
        h.impacts.append((time, g, rates, new))
        h.configurations.append((time, after))
        return time, np.concatenate([angles, new]), after
