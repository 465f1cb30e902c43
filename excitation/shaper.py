"""What a released machine does to its base: shaped changes of speed, and sliding with friction."""

from __future__ import annotations

import math
from typing import Annotated, Literal, TypeAlias

from pydantic import BaseModel, Field

from excitation.pieces import Span, steady
from excitation.quantity import VALUE, quantity

Shape: TypeAlias = Literal["half sine", "rectangular", "triangular"]

PEAK_OVER_MEAN: dict[Shape, float] = {"half sine": 0.5 * math.pi, "rectangular": 1.0, "triangular": 2.0}
"""Peak acceleration over mean acceleration of each shape."""


class PulseShaper(BaseModel):
    """A piece of soft material, or a spring, between two bodies that meet: it spreads the blow over a fixed time.

    The time does not depend on the speed, as for a linear spring (half a period). Every shape is symmetric in time, so
    the mean speed is halfway between the speeds before and after.

    Attributes
    ----------
    duration : float
        s, above 0; `duration_s` in a file.
    shape : {"half sine", "rectangular", "triangular"}
        Of the acceleration over time.

    Examples
    --------
    >>> shaper = PulseShaper(duration=0.01, shape="triangular")
    >>> round(shaper.peak(0.3), 9)
    60.0
    """

    model_config = {**VALUE, "frozen": True}

    duration: Annotated[float, quantity("s", above=0.0, at_most=60.0)] = Field(validation_alias="duration_s")
    shape: Shape = "half sine"

    def __str__(self) -> str:
        return f"{self.duration:g} s, {self.shape}"

    def change(self, change: float) -> list[Span]:
        """Return the spans that change the speed by `change`, m/s, of either sign."""
        duration, peak = self.duration, self.peak(change)
        if self.shape == "rectangular":
            return [steady(duration, peak)]
        if self.shape == "triangular":
            half, slope = 0.5 * duration, 2.0 * peak / duration
            return [steady(half, 0.0, slope), steady(half, peak, -slope)]
        return [(duration, 0.0, 0.0, peak, math.pi / duration, 0.0)]

    def peak(self, change: float) -> float:
        """Return the largest acceleration, m/s2, signed as `change`, m/s."""
        return PEAK_OVER_MEAN[self.shape] * change / self.duration

    def travel(self, before: float, after: float) -> float:
        """Return how far the base moves while its speed goes from `before` to `after`, m/s; m."""
        return 0.5 * (before + after) * self.duration


class EndStop(PulseShaper):
    """A stop with a shaper on it, from which the base rebounds.

    Attributes
    ----------
    rebound : float
        e, from 0 to 1: speed after over speed before, with the sense turned. 0 holds the base, as a catch does.
    """

    rebound: Annotated[float, quantity(at_least=0.0, at_most=1.0)] = 0.0

    def __str__(self) -> str:
        return f"{super().__str__()}, rebound {self.rebound:g}"

    def stop(self, velocity: float) -> list[Span]:
        """Return the spans that turn `velocity`, m/s, into -e times it."""
        return self.change(-(1.0 + self.rebound) * velocity)


def slide(velocity: float, deceleration: float, distance: float) -> tuple[float, float]:
    """Return how long a base slides with Coulomb friction, s, and its speed then, m/s.

    It ends at rest where friction stops it before `distance`: v^2 = v0^2 - 2 f x, t = 2 x / (v0 + v).

    Parameters
    ----------
    velocity : float
        v0, m/s, at least 0.
    deceleration : float
        f, m/s2, above 0.
    distance : float
        m, at least 0; infinite where nothing stands in the way.

    Examples
    --------
    >>> slide(2.0, 1.0, 1.5)
    (1.0, 1.0)
    >>> slide(2.0, 1.0, 3.0)
    (2.0, 0.0)
    """
    square = velocity * velocity - 2.0 * deceleration * distance
    if square <= 0.0:
        return velocity / deceleration, 0.0
    after = math.sqrt(square)
    return 2.0 * distance / (velocity + after), after
