"""The double pulse of ROORI-1: a blow that sets the base going, a gap, and a second blow that stops it."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, model_validator
from pydantic.dataclasses import dataclass

from excitation.pieces import Array, assemble, steady
from excitation.pulse import Pulse
from excitation.quantity import VALUE, checked, quantity, refusal
from excitation.speed_change import change_time, speed_change


@dataclass(frozen=True, config=VALUE)
class DoublePulse(Pulse):
    """Up to `peak_velocity`, coast until the base has travelled `stop_gap` in all, then back to -rebound peak_velocity.

    The second pulse begins where the base meets the stopper, at x = stop_gap; while the shaper yields the base travels
    on, so the greatest displacement exceeds the gap by the shaper's own travel, peak_velocity^2 / (2
    pulse_acceleration) for rectangular pulses. With a `rebound` the base is left moving backwards and needs a brake.

    Parameters
    ----------
    peak_velocity : float
        v, m/s, above 0.
    stop_gap : float
        Travel at which the second pulse begins, m, above 0.
    rebound : float
        e, from 0 to 1: velocity after the second pulse over the one before it, with the sign turned.
    pulse_acceleration : float
        Largest acceleration of both pulses, m/s2, above 0. The device's own is not published: 100 is an assumption.
    jerk : float or None
        Largest slope of the acceleration, m/s3, above 0: the pulses become trapezoids of the same change of speed.
        None makes rectangles.

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`: a value out of its bounds, or a peak velocity that cannot be reached within the gap.

    Examples
    --------
    >>> pulse = DoublePulse(0.5, 0.02)
    >>> round(pulse.duration, 9), round(pulse.net_displacement, 9), abs(pulse.final_velocity) < 1e-12
    (0.0475, 0.02125, True)
    """

    # A frozen field answers exactly as the cached property it stands for.
    peak_velocity: Annotated[float, quantity("m/s", above=0.0)] = Field()  # pyright: ignore[reportIncompatibleVariableOverride]
    stop_gap: Annotated[float, quantity("m", above=0.0)] = Field()
    rebound: Annotated[float, quantity(at_least=0.0, at_most=1.0)] = 0.0
    pulse_acceleration: Annotated[float, quantity("m/s2", above=0.0)] = 100.0
    jerk: Annotated[float, quantity("m/s3", above=0.0, at_most=1e9)] | None = None

    @model_validator(mode="after")
    def _reaches_its_velocity(self) -> DoublePulse:
        if self.run_up > self.stop_gap:
            raise refusal(
                f"double pulse needs {self.run_up:.6g} m to reach {self.peak_velocity:.6g} m/s; "
                f"its stop gap is {self.stop_gap:.6g} m"
            )
        return self

    @property
    def family(self) -> str:
        """What a capacity's `kinds` call it."""
        return "double pulse"

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return "double pulse"

    @property
    def run_up(self) -> float:
        """Travel during the first pulse, m."""
        return run_up(self.peak_velocity, self.pulse_acceleration, self.jerk)

    def scaled(self, factor: float) -> DoublePulse:
        """Return the pulse with velocity, acceleration and jerk times `factor` (above 0).

        Both pulses keep their lengths and the gap its own, so only the coast between them changes.
        """
        factor = checked("factor", factor, above=0.0)
        return DoublePulse(
            self.peak_velocity * factor,
            self.stop_gap,
            self.rebound,
            self.pulse_acceleration * factor,
            None if self.jerk is None else self.jerk * factor,
        )

    def _rows(self) -> Array:
        v = self.peak_velocity
        first = speed_change(v, self.pulse_acceleration, self.jerk)
        second = speed_change(-(1.0 + self.rebound) * v, self.pulse_acceleration, self.jerk)
        return assemble([*first, steady((self.stop_gap - self.run_up) / v), *second])


def run_up(velocity: float, acceleration: float, jerk: float | None) -> float:
    """Return the travel, m, in which the base reaches `velocity` (m/s) from rest by `speed_change`."""
    return 0.5 * velocity * change_time(velocity, acceleration, jerk)
