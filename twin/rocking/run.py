"""One run of the solver from Python: parameters in, recorded steps and events out."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import CAME_TO_REST, FELL, FULL, STUCK, march_through
from twin.rocking.series import scratch
from twin.rocking.state import DOUBT, EVENT_COLUMNS, PEAK, PHI, PSI, RATE, SIDE, STATE_SIZE, STEP_COLUMNS, TIME, WORST

MOST_STEPS = 400_000
STILL_BASE = np.array([[0.0, math.inf, 0.0, 0.0, 0.0, 0.0, 0.0]])
NOTHING_STEPS = np.zeros((0, STEP_COLUMNS))
NOTHING_EVENTS = np.zeros((0, EVENT_COLUMNS))


def parameters(block: Block, restitution: float, tolerance: float = 1e-15, stride: float = 1.0) -> FloatArray:
    """Return what the compiled code needs of a block: alpha, p, g, eta, g tan(alpha), local tolerance, step factor."""
    return np.array(
        [
            block.slenderness,
            block.frequency_parameter,
            block.gravity,
            restitution,
            block.uplift_acceleration,
            tolerance,
            stride,
        ]
    )


def local_tolerance(tolerance: float) -> float:
    """Return the truncation allowed per step, rad, for an error `tolerance` along the run; never below rounding."""
    return max(1e-5 * tolerance, 1e-15)


def initial_state(body: FloatArray, rotation: float = 0.0, angular_velocity: float = 0.0) -> FloatArray:
    """Return the solver's state for a rotation (rad) and a rate (rad/s), both signed, at time 0."""
    state = np.zeros(STATE_SIZE)
    state[PHI] = abs(rotation)
    state[PSI] = body[0] - abs(rotation)
    state[PEAK] = abs(rotation)
    if rotation != 0.0:
        state[SIDE] = math.copysign(1.0, rotation)
    elif angular_velocity != 0.0:
        state[SIDE] = math.copysign(1.0, angular_velocity)
    state[RATE] = state[SIDE] * angular_velocity / body[1]
    return state


def signed(body: FloatArray, state: FloatArray) -> tuple[float, float]:
    """Return rotation (rad) and angular velocity (rad/s) of a state, both signed."""
    return float(state[SIDE] * state[PHI]), float(state[SIDE] * state[RATE] * body[1])


@dataclass(slots=True)
class Run:
    """A state being advanced, and what it leaves behind.

    `steps` and `events` grow as needed when `record` is set; otherwise nothing is kept but the state.
    """

    body: FloatArray
    state: FloatArray
    record: bool = True
    code: int = 0
    _steps: FloatArray = field(default_factory=lambda: NOTHING_STEPS)
    _events: FloatArray = field(default_factory=lambda: NOTHING_EVENTS)
    _used: FloatArray = field(default_factory=lambda: np.zeros(3))
    _scratch: tuple[FloatArray, FloatArray, FloatArray] = field(default_factory=scratch)

    def __post_init__(self) -> None:
        if self.record:
            # Rows are written whole before they are read.
            self._steps = np.empty((64, STEP_COLUMNS))
            self._events = np.empty((64, EVENT_COLUMNS))

    @property
    def steps(self) -> FloatArray:
        """Recorded steps, shape (n, STEP_COLUMNS): start s, length 1/p, side, coefficients of |theta|."""
        return self._steps[: int(self._used[0])]

    @property
    def events(self) -> FloatArray:
        """Recorded events, shape (n, 3): time s, rate rad/s, code."""
        return self._events[: int(self._used[1])]

    @property
    def doubtful(self) -> bool:
        """Whether an error as large as rounding could have changed the course of events so far."""
        return bool(self.state[DOUBT] != 0.0)

    @property
    def worst_error(self) -> float:
        """Largest standard deviation of the rotation's computed error so far, rad."""
        return float(self.state[WORST])

    def advance(self, pieces: FloatArray, end: float = math.inf) -> int:
        """Go through `pieces` up to time `end`; return the compiled code's reason for stopping."""
        self._used[2] = 0.0
        while True:
            self.code = march_through(
                self.body, self.state, pieces, end, self._steps, self._events, self._used, *self._scratch
            )
            if self.code != FULL:
                return self.code
            if self._steps.shape[0] >= MOST_STEPS:
                self.code = STUCK
                return self.code
            self._steps = np.concatenate([self._steps, np.empty_like(self._steps)])
            self._events = np.concatenate([self._events, np.empty_like(self._events)])

    def advance_free(self, end: float = math.inf) -> int:
        """Go on over a still base."""
        return self.advance(STILL_BASE, end)

    @property
    def fallen(self) -> bool:
        """Whether the block has reached pi/2."""
        return self.code == FELL

    @property
    def resting(self) -> bool:
        """Whether the block stands still now."""
        return self.code == CAME_TO_REST or bool(self.state[SIDE] == 0.0)

    @property
    def time(self) -> float:
        """Time reached, s."""
        return float(self.state[TIME])


# The ellipse is an estimate of first order: a thousand of its deviations are looked at twice.
SAFETY = 1e3
