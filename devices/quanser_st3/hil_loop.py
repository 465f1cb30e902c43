"""The ST-III's position loop where the host closes it: encoder in, voltage out, once a cycle."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from devices.errors import LoopUnstable

if TYPE_CHECKING:
    from devices.quanser_st3.hil_settings import HilSettings


class HostLoop:
    """Proportional to the distance from the set-point, with damping on the measured velocity:

        current = M0 lead / (2 pi Kt) * (w0^2 (r - x) - 2 zeta0 w0 x')

    Parameters
    ----------
    settings : HilSettings
    cycle_time : float
        s.

    Raises
    ------
    LoopUnstable
        Where the empty table would not be held at that rate; a payload makes the loop slower.
    """

    def __init__(self, settings: HilSettings, cycle_time: float) -> None:
        s = settings
        w = math.tau * s.loop_frequency
        self._k, self._c = w * w, 2.0 * s.loop_damping * w
        self._check(cycle_time, s.loop_frequency)
        # V per m/s2: M a = 2 pi Kt i / lead.
        self._gain = s.moving_mass * s.screw_lead / (math.tau * s.torque_constant) / s.amperes_per_volt
        self.largest = min(s.output_limit, s.peak_current / abs(s.amperes_per_volt))

    def voltage(self, setpoint: float, position: float, velocity: float) -> float:
        """Return the output, V, limited by its range and by the motor's peak current."""
        asked = self._gain * (self._k * (setpoint - position) - self._c * velocity)
        return min(max(asked, -self.largest), self.largest)

    def _check(self, h: float, frequency: float) -> None:
        # Sampled: the output is held over a cycle, x' is the difference over the cycle before, and the output is a
        # whole cycle late, which is more than it should be. State: x, x', x a cycle ago, x''.
        k, c = self._k, self._c
        step = np.array(
            [[1.0, h, 0.0, 0.5 * h * h], [0.0, 1.0, 0.0, h], [1.0, 0.0, 0.0, 0.0], [-k - c / h, 0.0, c / h, 0.0]]
        )
        if (radius := float(np.abs(np.linalg.eigvals(step)).max())) >= 1.0:
            raise LoopUnstable(
                f"a position loop of {frequency:g} Hz is not stable at {1.0 / h:g} cycles a second with a cycle of "
                f"delay (it grows by {radius:.2f} each): give the scene a higher cycle_hz"
            )
