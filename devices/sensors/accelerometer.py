"""An accelerometer: noise, bias and range."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np


class Accelerometer:
    """Reads an acceleration with Gaussian noise and a constant bias, cut off at its range.

    Not imitated: the sensor's own bandwidth, cross-axis sensitivity, temperature.

    Parameters
    ----------
    rng : numpy.random.Generator
        Of the noise: equal seeds, equal readings.
    noise : float
        Standard deviation of one reading, m/s2.
    bias : float
        m/s2.
    largest : float
        Largest reading of either sign, m/s2.

    Examples
    --------
    >>> import numpy as np
    >>> Accelerometer(np.random.default_rng(1), noise=0.0, bias=0.1, largest=20.0).read(-30.0)
    -20.0
    """

    def __init__(self, rng: np.random.Generator, *, noise: float, bias: float, largest: float) -> None:
        if not (0.0 <= noise < math.inf and math.isfinite(bias) and largest > 0.0):
            raise ValueError(f"accelerometer has noise {noise}, bias {bias} and range {largest} m/s2")
        self.bias = bias
        self.largest = largest
        self._noise = _normals(rng, noise)

    def read(self, true: float) -> float:
        """Return what the accelerometer says, m/s2, where the truth is `true`, m/s2."""
        return min(max(true + self.bias + next(self._noise), -self.largest), self.largest)


def _normals(rng: np.random.Generator, scale: float) -> Iterator[float]:
    """Yield Gaussian numbers; drawn in blocks, since one draw costs as much as a whole frame."""
    while True:
        yield from (scale * rng.standard_normal(1024)).tolist()
