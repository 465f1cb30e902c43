"""What a simulation answers: the outcome, the events, and the motion at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING, overload

import numpy as np
from numpy.typing import ArrayLike

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN
from twin.rocking.methods.problem import Solution

if TYPE_CHECKING:
    from excitation import Pulse
    from twin.rocking.validity import Validity


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
    block : Block
    restitution : float
        Ratio of angular velocities after and before an impact, as used.
    method, model : str
        What solved which equation; see `simulate`.
    pulse : Pulse or None
        The base motion.
    model_reason : str
        Which model was taken and why, in one sentence.
    """

    block: Block
    restitution: float
    method: str
    model: str
    _solution: Solution = field(repr=False)
    pulse: Pulse | None = field(default=None, repr=False)
    model_reason: str = field(default="", repr=False)

    @property
    def outcome(self) -> Outcome:
        """STAYED (never lifted), ROCKED, OVERTURNED (|rotation| reaches pi/2) or UNDECIDED.

        UNDECIDED: the computed error, or one rounding of an input, changes whether it overturns. The motion given is
        then one of several possible ones.
        """
        if self._solution.overturned is None:
            return Outcome.UNDECIDED
        if self._solution.overturned:
            return Outcome.OVERTURNED
        return Outcome.STAYED if self._solution.uplift_time is None else Outcome.ROCKED

    @property
    def uplift_time(self) -> float | None:
        """First time the block leaves the base, s; 0 where it starts tilted or turning; None where it never does."""
        return self._solution.uplift_time

    @property
    def impact_times(self) -> FloatArray:
        """Times of the impacts, s, down to a rate of 1e-6 p; the endless sequence after them ends at `rest_time`."""
        return self._solution.impact_times

    @property
    def impact_rates(self) -> FloatArray:
        """Angular velocity just before each impact, rad/s, signed."""
        return self._solution.impact_rates

    @property
    def rest_time(self) -> float | None:
        """When the block, having rocked, comes to rest for good, s: the limit of all its impacts."""
        return self._solution.rest_time

    @property
    def overturning_time(self) -> float | None:
        """When |rotation| reaches pi/2, s; None where it does not, or not before the run ends."""
        return self._solution.overturning_time if self.outcome is Outcome.OVERTURNED else None

    @property
    def peak_rotation(self) -> float:
        """Largest |rotation|, rad; pi/2 where it overturned."""
        return self._solution.peak

    @property
    def rotation_error(self) -> float:
        """Estimate of the largest error of the rotation along the run, rad.

        Against the exact answer of the same model's equation: what a simpler equation leaves out is not in it (see
        `model_reason`). For the default method eight deviations of the error carried with the solution. Where it
        exceeds the tolerance asked for, the problem, not the method, sets the limit.
        """
        return self._solution.error

    @property
    def end_time(self) -> float:
        """Last time the motion is known for, s; infinite where the block rests or lies.

        Before the duration asked for where that takes more than 100 000 impacts.
        """
        return self._solution.end_time

    @property
    def direction(self) -> int:
        """+1 or -1: the side the block overturns to; 0 where it does not, or not before the run ends."""
        return self._solution.side if self.outcome is Outcome.OVERTURNED else 0

    def validity(self, *, friction: float | None = None) -> Validity:
        """Return what the run asks of the contact, and when it slides (of a coefficient `friction`) or lifts off."""
        # The one module needs the other's type.
        from twin.rocking.validity import validity

        return validity(self, self.pulse, friction=friction)

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
        return self._evaluate(t, 0)

    @overload
    def angular_velocity(self, t: float) -> float: ...
    @overload
    def angular_velocity(self, t: ArrayLike) -> FloatArray | float: ...
    def angular_velocity(self, t: ArrayLike) -> FloatArray | float:
        """Return d(theta)/dt, rad/s, right-continuous at an impact; arguments as for `rotation`."""
        return self._evaluate(t, 1)

    def _evaluate(self, t: ArrayLike, which: int) -> FloatArray | float:
        times = np.asarray(t, dtype=np.float64)
        if not bool(np.all((times >= 0.0) & (times <= self.end_time))):
            known = f"0 to {self.end_time:.6g} s"
            raise ValueError(
                f"the motion is known from {known}; asked for {np.min(times):.6g} to {np.max(times):.6g} s"
            )
        solution = self._solution
        flat = times.reshape(-1)
        result = np.zeros_like(flat)
        last = math.inf
        if solution.overturning_time is not None:
            last = solution.overturning_time
            if which == 0:
                result[flat >= last] = solution.side * HALF_TURN
        elif solution.resting and solution.rest_time is not None:
            last = solution.rest_time
        inside = flat < last
        if np.any(inside):
            result[inside] = solution.history.evaluate(flat[inside])[which]
        return float(result[0]) if times.ndim == 0 else result.reshape(times.shape)
