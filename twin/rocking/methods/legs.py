"""SciPy's DOP853 from event to event: legs of the motion, each searched for its contact with a bound."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, cast

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq  # pyright: ignore[reportUnknownVariableType]

from twin.rocking.compiled import FloatArray
from twin.rocking.march import FELL, HALF_TURN, REACHED
from twin.rocking.methods.contact import lift_off, strike_base
from twin.rocking.methods.equations import acceleration, centre
from twin.rocking.methods.fixed_march import clear_of_contact, greatest_bend
from twin.rocking.methods.problem import MethodRefused
from twin.rocking.series import base_acceleration
from twin.rocking.state import ALPHA, EVENT_COLUMNS, GRAVITY, OVERTURNED, PEAK, PHI, PSI, RATE, SIDE, TIME, P, note

MOST_STEPS = 100_000
LONGEST = 0.4
"""Longest step, 1/p: the interpolant, of order 7, is what the contact is read from."""
Curve = Callable[[float], FloatArray]


class Legs:
    """Recorded steps and events of one run; also its history.

    A step keeps its start (s), length (1/p), side, phi at the leg's start and SciPy's interpolant of (change of phi, v)
    over the time since the leg began.
    """

    def __init__(self, model: int, body: FloatArray, relative: float) -> None:
        self.model, self.body, self.relative = model, body, relative
        self.starts: list[float] = []
        self.steps: list[tuple[float, float, float, Curve | None]] = []
        self.events = np.empty((64, EVENT_COLUMNS))
        self.used = np.zeros(2)

    def recorded_events(self) -> FloatArray:
        """Return events so far, shape (n, 3): time s, signed rate rad/s, code."""
        return self.events[: int(self.used[1])]

    def record(self, start: float, offset: float, side: float, phi: float, curve: Curve | None) -> None:
        """Keep a step that begins at `start` s, `offset` (1/p) into its leg; no curve: at rest."""
        if len(self.starts) >= MOST_STEPS:
            raise MethodRefused(
                f"dop853 needs more than {MOST_STEPS} steps: it got to {start:.6g} s; give a shorter duration"
            )
        self.starts.append(start)
        self.steps.append((offset, side, phi, curve))

    def room(self) -> None:
        """Make room for the events of one step."""
        if self.used[1] + 4 >= len(self.events):
            self.events = np.concatenate([self.events, np.empty_like(self.events)])

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotation and angular velocity at `times`."""
        rotation, rate = np.zeros_like(times), np.zeros_like(times)
        p = float(self.body[P])
        rows = np.searchsorted(np.array(self.starts), times, side="right") - 1
        for i in range(times.size if self.steps else 0):
            k = max(int(rows[i]), 0)
            offset, side, phi, curve = self.steps[k]
            if curve is not None:
                moved, v = curve(offset + p * (float(times[i]) - self.starts[k]))
                rotation[i] = side * max(phi + float(moved), 0.0)
                rate[i] = side * float(v) * p
        return rotation, rate


def advance(legs: Legs, state: FloatArray, piece: FloatArray, end: float) -> int:
    """Advance `state` in place through one piece to `end` (s); codes as for `march`."""
    while state[TIME] < end:
        legs.room()
        if state[SIDE] == 0.0:
            if math.isinf(end):
                return REACHED
            legs.record(float(state[TIME]), 0.0, 0.0, 0.0, None)
            if not lift_off(legs.model, legs.body, state, piece, end, legs.events, legs.used):
                return REACHED
            continue
        if _leg(legs, state, piece, end) == FELL:
            return FELL
    return REACHED


def _leg(legs: Legs, state: FloatArray, piece: FloatArray, end: float) -> int:
    """Follow one flight to the end of the piece, to the contact or to pi/2."""
    model, body = legs.model, legs.body
    alpha, p, side = float(body[ALPHA]), float(body[P]), float(state[SIDE])
    start, phi0, psi0 = float(state[TIME]), float(state[PHI]), float(state[PSI])
    scale = side / float(body[GRAVITY])
    whole = p * (end - start)
    clear = 0.0
    if phi0 == 0.0:
        span = min(whole, LONGEST)
        clear = clear_of_contact(model, body, state, piece, span, greatest_bend(model, body, state, piece, span))
        if clear < 0.0:
            state[SIDE] = 0.0
            state[TIME] = math.nextafter(start, math.inf)
            return REACHED

    def slope(x: float, y: FloatArray) -> list[float]:
        f = scale * base_acceleration(piece, start + x / p)
        return [float(y[1]), acceleration(model, alpha, phi0 + float(y[0]), psi0 - float(y[0]), f)]

    first = min(clear, whole) if clear > 0.0 else None
    solver = cast(
        "Any",
        DOP853(
            slope,
            0.0,
            np.array([0.0, float(state[RATE])]),
            whole,
            max_step=LONGEST,
            first_step=first,
            rtol=legs.relative,
            atol=1e-3 * legs.relative * min(1.0, max(phi0, abs(float(state[RATE])), 1e-9)),
        ),
    )
    here = state.copy()
    while True:
        message = solver.step()
        if solver.status == "failed":
            raise MethodRefused(f"dop853 stops at {start + solver.t / p:.6g} s: {message}")
        before, after = float(solver.t_old), float(solver.t)
        curve = cast("Curve", solver.dense_output())
        legs.record(start + before / p, before, side, phi0, curve)
        here[TIME] = start + before / p
        moved_before, v_before = curve(before)
        here[PHI], here[PSI], here[RATE] = phi0 + moved_before, psi0 - moved_before, v_before
        bound = 1.05 * greatest_bend(model, body, here, piece, after - before) + 1e-300
        x = _first_fall(curve, phi0, 1.0, max(before, min(clear, after)), after, bound)
        top = _first_fall(curve, HALF_TURN - phi0, -1.0, before, after, bound) if x is None else None
        stop = next((found for found in (x, top) if found is not None), after)
        moved, v = (float(value) for value in curve(stop))
        state[PEAK] = max(state[PEAK], phi0 + moved, _top(curve, before, stop) + phi0)
        state[TIME] = end if stop == whole else min(start + stop / p, end)
        if x is not None:
            strike_base(model, body, state, piece, end, min(v, 0.0), legs.events, legs.used)
            return REACHED
        if top is not None:
            state[PHI], state[PSI], state[RATE] = HALF_TURN, centre(model, alpha) - HALF_TURN, v
            state[PEAK] = HALF_TURN
            note(legs.events, legs.used, float(state[TIME]), side * p * v, OVERTURNED)
            return FELL
        if solver.status == "finished":
            state[PHI], state[PSI], state[RATE] = phi0 + moved, psi0 - moved, v
            return REACHED


def _first_fall(curve: Curve, offset: float, sign: float, start: float, end: float, bound: float) -> float | None:
    """Return the first x in (start, end] where offset + sign (change of phi) is no longer above zero, or None."""

    def guard(x: float) -> float:
        return offset + sign * float(curve(x)[0])

    left, y_left, width = start, guard(start), end - start
    while left < end:
        right = min(end, left + width)
        h = right - left
        y_right = guard(right)
        if min(y_left, y_right) > 0.125 * bound * h * h:
            left, y_left, width = right, y_right, 2.0 * h
        elif y_right <= 0.0 < y_left and abs(float(curve(right)[1])) > bound * h:
            return root_between(guard, left, right)
        elif h <= 1e-13 * max(end, 1e-3) or y_left <= 0.0:
            return right
        else:
            width = 0.5 * h
    return None


def _top(curve: Curve, start: float, end: float) -> float:
    """Return the change of phi where the rate passes zero downwards on [start, end], or at the start."""
    if not float(curve(start)[1]) > 0.0 > float(curve(end)[1]):
        return float(curve(start)[0])

    def rate(x: float) -> float:
        return float(curve(x)[1])

    return float(curve(root_between(rate, start, end))[0])


def root_between(guard: Callable[[float], float], left: float, right: float) -> float:
    """Return where `guard` passes zero between `left` and `right`, by Brent's method."""
    find = cast("Callable[..., float]", brentq)
    return find(guard, left, right, xtol=1e-16, rtol=9e-16)
