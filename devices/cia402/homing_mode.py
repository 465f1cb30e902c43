"""Mode 6 of an emulated drive: from controlword to statusword, around one `Homing` at a time."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia402 import states
from devices.cia402.homing import Homing, Phase

if TYPE_CHECKING:
    from devices.cia402.machine import Switches
    from devices.cia402.parameters import Parameters
    from devices.setpoints import SetpointLimits

# Share of the stroke beyond either end of it in which a limit switch is looked for, and in which homing can stop.
_OVERTRAVEL = 0.05
# Distance inside the software limits at which homing may end, m.
_MARGIN = 0.5e-3


class HomingMode:
    """Begins, breaks off and judges homing; positions are the machine's own, m.

    Parameters
    ----------
    parameters : Parameters
    stroke : float
        Of the capacity, m.

    Attributes
    ----------
    active : bool
        Whether the set-point is led by homing.
    """

    def __init__(self, parameters: Parameters, stroke: float) -> None:
        self._parameters = parameters
        self._stroke = stroke
        self.active = False
        self._homing: Homing | None = None
        self._start_bit = False
        self._attained = self._failed = False
        self._silent = 0

    @property
    def acceleration(self) -> float:
        """What brings it to rest before it is too far, m/s2; 0 while it is not active."""
        return 0.0 if self._homing is None else self._homing.acceleration

    @property
    def flags(self) -> int:
        """The mode's own bits of the statusword."""
        word = 0 if self.active else states.TARGET_REACHED
        word |= states.HOMING_ATTAINED if self._attained else 0
        return word | (states.HOMING_ERROR if self._failed else 0)

    @property
    def deserted(self) -> bool:
        """Whether SYNC has been missing for longer than the drive's patience."""
        return self._silent > self._parameters.patience

    def enter(self) -> None:
        """The mode was chosen, or left."""
        self.end()
        self._attained = self._failed = self._start_bit = False

    def end(self) -> None:
        """Something else leads the set-point from here: homing is over."""
        self._homing, self.active = None, False

    def command(self, controlword: int, position: float, limits: SetpointLimits, *, standstill: bool) -> None:
        """Begin at the rising edge of bit 4, from rest at `position`; break off where it falls, or by halt."""
        start = bool(controlword & states.HOMING_START)
        rising, self._start_bit = start and not self._start_bit, start
        if self._homing is not None:
            if not start or controlword & states.HALT:
                self._homing.fail()
        elif rising and standstill:
            overtravel = _OVERTRAVEL * self._stroke
            settings = self._parameters.homing(limits, overtravel)
            self._attained, self._failed, self._silent = False, settings is None, 0
            if settings is not None:
                furthest = 0.5 * self._stroke + overtravel
                self._homing = Homing(settings, position, -furthest, furthest, self._inside)
                self.active = True

    def step(self, switches: Switches, measured: float, *, synced: bool) -> tuple[float, float]:
        """Return where the set-point is at the end of this cycle and its velocity, m/s; only while `active`."""
        homing = self._homing
        if homing is None:
            raise RuntimeError("homing is stepped while it is not active")
        self._silent = 0 if synced else self._silent + 1
        return homing.step(switches, measured), homing.velocity

    def conclude(self) -> float | None:
        """Return the new zero, m, where homing has just been attained, and judge it where it is over."""
        homing = self._homing
        if homing is None or not homing.over:
            return None
        self.end()
        self._attained = homing.phase is Phase.ATTAINED
        # A start bit that fell has interrupted it, which is no error.
        self._failed = not self._attained and self._start_bit
        # CiA 402: the zero position is the home position plus the home offset.
        return homing.edge + self._parameters.home_offset if self._attained and homing.edge is not None else None

    def _inside(self, edge: float) -> float:
        """Return how far from a switch's edge the software limits begin once that is the home."""
        home = -self._parameters.home_offset
        limits = self._parameters.limits(edge - home)
        return max(0.0, home - limits.upper + _MARGIN, limits.lower + _MARGIN - home)
