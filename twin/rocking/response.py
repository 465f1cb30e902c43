"""What a simulation answers: the outcome, the events, and the motion at any time."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from typing import overload

import numpy as np
from numpy.typing import ArrayLike

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN


class Outcome(Enum):
    """How a run ends for the block."""

    STAYED = "stayed"
    ROCKED = "rocked"
    OVERTURNED = "overturned"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Response:
    """The block's answer to a base motion.

    Attributes
    ----------
    outcome : Outcome
        STAYED (never lifted), ROCKED, OVERTURNED (|rotation| reaches pi/2), or UNDECIDED: the computed error, or one
        rounding of an input, changes whether it overturns. The motion given is then one of several possible ones.
    uplift_time : float or None
        First time the block leaves the base, s; 0 where it starts tilted or turning; None where it never does.
    impact_times, impact_rates : ndarray, shape (n,)
        Times of the impacts, s, and the angular velocity just before each, rad/s, signed. Impacts are listed down to a
        rate of 1e-6 p; the endless sequence after them ends at `rest_time`.
    rest_time : float or None
        When the block, having rocked, comes to rest for good, s: the limit of all its impacts.
    overturning_time : float or None
        When |rotation| reaches pi/2, s.
    peak_rotation : float
        Largest |rotation|, rad; pi/2 where it overturned.
    rotation_error : float
        Estimate of the largest error of the rotation along the run, rad: eight deviations of the error carried with
        the solution. Where it exceeds the tolerance asked for, the problem, not the method, sets the limit.
    end_time : float
        Last time the motion is known for, s; infinite where the block rests or lies.
    """

    block: Block
    restitution: float
    outcome: Outcome
    uplift_time: float | None
    impact_times: FloatArray
    impact_rates: FloatArray
    rest_time: float | None
    overturning_time: float | None
    peak_rotation: float
    rotation_error: float
    end_time: float
    _steps: FloatArray = field(repr=False)
    _final: tuple[float, float] = field(repr=False)

    @property
    def direction(self) -> int:
        """+1 or -1: the side the block overturns to; 0 where it does not."""
        if self.outcome is not Outcome.OVERTURNED:
            return 0
        return 1 if self._final[1] > 0.0 else -1

    @overload
    def rotation(self, t: float) -> float: ...
    @overload
    def rotation(self, t: ArrayLike) -> FloatArray | float: ...
    def rotation(self, t: ArrayLike) -> FloatArray | float:
        """Return theta(t), rad, for a time or an array of times in s; 0 at rest, +-pi/2 once overturned.

        Raises
        ------
        ValueError
            For a time before 0 or after `end_time`.
        """
        return self._evaluate(t, derivative=False)

    @overload
    def angular_velocity(self, t: float) -> float: ...
    @overload
    def angular_velocity(self, t: ArrayLike) -> FloatArray | float: ...
    def angular_velocity(self, t: ArrayLike) -> FloatArray | float:
        """Return d(theta)/dt, rad/s, right-continuous at an impact; arguments as for `rotation`."""
        return self._evaluate(t, derivative=True)

    def _evaluate(self, t: ArrayLike, *, derivative: bool) -> FloatArray | float:
        times = np.asarray(t, dtype=np.float64)
        if not bool(np.all((times >= 0.0) & (times <= self.end_time))):
            known = f"0 to {self.end_time:.6g} s"
            raise ValueError(
                f"the motion is known from {known}; asked for {np.min(times):.6g} to {np.max(times):.6g} s"
            )
        flat = times.reshape(-1)
        result = np.zeros_like(flat)
        p = self.block.frequency_parameter
        last, final_side = self._final
        after = flat >= last
        if self.outcome is Outcome.OVERTURNED or final_side != 0.0:
            result[after] = 0.0 if derivative else final_side * HALF_TURN
        inside = np.nonzero(~after)[0]
        if inside.size and self._steps.shape[0]:
            rows = np.searchsorted(self._steps[:, 0], flat[inside], side="right") - 1
            steps = self._steps[rows]
            x = np.clip(p * (flat[inside] - steps[:, 0]), 0.0, steps[:, 1])
            c = steps[:, 3:]
            n = c.shape[1] - 1
            y = c[:, n] * n if derivative else c[:, n].copy()
            for k in range(n - 1, 0 if derivative else -1, -1):
                y = y * x + (k * c[:, k] if derivative else c[:, k])
            result[inside] = steps[:, 2] * y * (p if derivative else 1.0)
        return float(result[0]) if times.ndim == 0 else result.reshape(times.shape)
