"""An incremental position encoder: the true position in whole steps."""

from __future__ import annotations

import math


class Encoder:
    """Reads a position, m, or a rotation, rad, in whole steps.

    Not imitated: the time the counter takes, missed counts.

    Parameters
    ----------
    step : float
        Of one count, in the unit of what is read; 0 for none.

    Raises
    ------
    ValueError
        A step that is not a finite number of at least 0.

    Examples
    --------
    >>> Encoder(0.25).read(0.4)
    0.5
    """

    def __init__(self, step: float) -> None:
        if not (math.isfinite(step) and step >= 0.0):
            raise ValueError(f"encoder step is {step}; it must be finite and at least 0")
        self.step = step

    def read(self, true: float) -> float:
        """Return what the encoder says where the truth is `true`."""
        return round(true / self.step) * self.step if self.step > 0.0 else true
