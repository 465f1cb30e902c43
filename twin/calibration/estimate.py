"""A number with its uncertainty."""

from __future__ import annotations

import math
from dataclasses import dataclass

NORMAL = 1.959963984540054
"""Half width of a 95 % interval, in standard deviations of a normal variable."""


@dataclass(frozen=True)
class Estimate:
    """A value, its standard deviation, and its 95 % interval, in SI units (rad)."""

    value: float
    error: float
    low: float
    high: float

    @classmethod
    def plain(cls, value: float, error: float, quantile: float = NORMAL) -> Estimate:
        """Return one whose interval is `quantile` deviations to both sides."""
        return cls(value, error, value - quantile * error, value + quantile * error)

    @classmethod
    def positive(cls, value: float, relative: float, quantile: float = NORMAL) -> Estimate:
        """Return one whose logarithm has the deviation `relative`; its interval never reaches zero."""
        reach = min(quantile * relative, 50.0)
        return cls(value, value * relative, value * math.exp(-reach), value * math.exp(reach))

    def as_data(self) -> dict[str, float]:
        """Return it for JSON."""
        return {"value": self.value, "standard_deviation": self.error, "low": self.low, "high": self.high}
