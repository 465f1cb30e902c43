"""What a drive that pushes watches: following error, limit switches, the emergency stop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from devices.cia402.machine import Switches
    from devices.cia402.parameters import Parameters

TOO_FAR, EMERGENCY_STOP, LIMIT_SWITCH = 0x8611, 0x9000, 0xFF10
"""Emergency codes (CiA 402, CiA 301, and one of ours)."""


class Supervision:
    """Judges one cycle after another.

    Attributes
    ----------
    astray : int
        Cycles in a row in which the following error was outside its window.
    """

    def __init__(self) -> None:
        self.astray = 0
        self._window = math.inf
        self._patience = 0

    def start(self, parameters: Parameters, cycle_time: float) -> None:
        """Take window and time-out over, as operation is enabled."""
        self.astray = 0
        self._window = parameters.following_window
        self._patience = round(parameters.following_time / cycle_time)

    def complaint(self, error: float, velocity: float, switches: Switches, *, homing: bool) -> int | None:
        """Return an emergency code, or None where all is well.

        Parameters
        ----------
        error : float
            Set-point less measured position, m.
        velocity : float
            Of the set-point, m/s: a limit switch stops what goes further into it, and lets go what comes out.
        switches : Switches
        homing : bool
            Whether a limit switch is what is looked for.
        """
        self.astray = self.astray + 1 if abs(error) > self._window else 0
        if switches.stop:
            return EMERGENCY_STOP
        if not homing and ((switches.positive and velocity > 0.0) or (switches.negative and velocity < 0.0)):
            return LIMIT_SWITCH
        return TOO_FAR if self.astray > self._patience else None
