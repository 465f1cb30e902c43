"""The ST-III's position loop while nothing saturates: its frequency response, and its state advanced exactly.

    x'' + 2 zeta w x' + w^2 x = w^2 r

with r the set-point, linear over each step, so that the matrix exponential of the step is exact.
"""

from __future__ import annotations

import cmath
import math
from dataclasses import dataclass

import numpy as np
from scipy.linalg import expm  # pyright: ignore[reportUnknownVariableType]


@dataclass(frozen=True, slots=True)
class LinearLoop:
    """Position over set-point, in the linear regime: w^2 exp(-s d) / (s^2 + 2 zeta w s + w^2).

    Parameters
    ----------
    angular_frequency : float
        w, rad/s.
    damping : float
        zeta.
    transport_delay : float
        d, s.

    Examples
    --------
    >>> loop = LinearLoop(200.0, 0.78, 1e-3)
    >>> round(abs(loop.response(10.0)), 3), round(loop.delay, 5)
    (0.975, 0.0088)
    """

    angular_frequency: float
    damping: float
    transport_delay: float = 0.0

    @property
    def delay(self) -> float:
        """How far a slow motion comes behind its set-point, s: 2 zeta / w + d."""
        return 2.0 * self.damping / self.angular_frequency + self.transport_delay

    def response(self, frequency: float) -> complex:
        """Return position over set-point, which is also acceleration over asked acceleration, at `frequency`, Hz."""
        ratio = math.tau * frequency / self.angular_frequency
        lag = cmath.exp(-1j * math.tau * frequency * self.transport_delay)
        return lag / complex(1.0 - ratio * ratio, 2.0 * self.damping * ratio)

    def exponential(self, step: float) -> list[list[float]]:
        """Return what `step`, s, does to (x, x', r, r'), r' constant; the delay is not in it."""
        k, c = self.angular_frequency**2, 2.0 * self.damping * self.angular_frequency
        generator = np.array([[0, 1, 0, 0], [-k, -c, k, 0], [0, 0, 0, 1], [0, 0, 0, 0]], float)
        return np.asarray(expm(generator * step), float).tolist()


class LinearStep:
    """One step of a fixed length, done exactly.

    Parameters
    ----------
    loop : LinearLoop
    duration : float
        s.
    """

    def __init__(self, loop: LinearLoop, duration: float) -> None:
        self.duration = duration
        z = loop.exponential(duration)
        self._xx, self._xv, _, slope_x = z[0]
        self._vx, self._vv, _, slope_v = z[1]
        self._xe, self._ve = slope_x / duration, slope_v / duration

    def advance(self, position: float, velocity: float, start: float, end: float) -> tuple[float, float]:
        """Return position, m, and velocity, m/s, after the step, the set-point going from `start` to `end`, m."""
        # About the set-point at the start, so that a table at rest stays there to the last bit.
        x, change = position - start, end - start
        return (
            start + (self._xx * x + self._xv * velocity + self._xe * change),
            self._vx * x + self._vv * velocity + self._ve * change,
        )
