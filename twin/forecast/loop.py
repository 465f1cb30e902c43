"""How a table follows its command: a gain, a delay, and the second-order lag of its closed position loop."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic.dataclasses import dataclass

from excitation.quantity import VALUE, quantity
from twin.forecast.compiled import compiled


@dataclass(frozen=True, config=VALUE)
class TableLoop:
    """What a table makes of the acceleration u it is told, u already times `gain` and `delay` late:

        a'' + 2 zeta w a' + w^2 a = w^2 u

    Parameters
    ----------
    delay : float
        Pure delay, s.
    gain : float
        Share of the planned motion that is commanded (staged arming).
    frequency : float or None
        Natural frequency w / (2 pi) of the closed loop, Hz; None: no lag beyond the delay.
    damping : float
        zeta, above 0.

    Examples
    --------
    >>> round(TableLoop(frequency=31.9, damping=0.78).total_delay, 6)
    0.007783
    """

    delay: Annotated[float, quantity("s", at_least=0.0)] = 0.0
    gain: Annotated[float, quantity()] = 1.0
    frequency: Annotated[float, quantity("Hz", above=0.0)] | None = None
    damping: Annotated[float, quantity(above=0.0)] = 1.0

    @property
    def angular_frequency(self) -> float:
        """w, rad/s; 0 without a lag."""
        return 0.0 if self.frequency is None else math.tau * self.frequency

    @property
    def total_delay(self) -> float:
        """How late the motion is on the whole, s: the delay and the mean of the lag's impulse response, 2 zeta / w."""
        return self.delay + (0.0 if self.frequency is None else 2.0 * self.damping / self.angular_frequency)


@compiled
def follow(w: float, zeta: float, a: float, da: float, u: float, du: float, h: float) -> tuple[float, float]:
    """Return a and a' of the loop after `h` s under u + du t, exactly.

    The particular solution is u + du t - 2 zeta du / w; what is left dies as exp(-zeta w t).
    """
    lag = 2.0 * zeta * du / w
    x = a - (u - lag)
    v = da - du
    root = w * math.sqrt(abs(1.0 - zeta * zeta))
    decay = math.exp(-zeta * w * h)
    if zeta < 1.0:
        c = math.cos(root * h)
        s = h if root * h < 1e-8 else math.sin(root * h) / root
    else:
        c = math.cosh(root * h)
        s = h if root * h < 1e-8 else math.sinh(root * h) / root
    new = decay * (x * c + (v + zeta * w * x) * s)
    rate = decay * (v * c - (w * w * x + zeta * w * v) * s)
    return new + u + du * h - lag, rate + du
