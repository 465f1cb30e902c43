"""What a drive's object dictionary sets, in SI: read when operation is enabled, so that nothing changes under way."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from devices.cia402.homing import METHODS, HomingSettings

if TYPE_CHECKING:
    from devices.cia301.dictionary import ObjectStore
    from devices.cia402.machine import DriveOptions
    from devices.cia402.units import Units
    from devices.setpoints import SetpointLimits
    from excitation import Capacity

_UNLIMITED = 0xFFFFFFFF
_SLOW_DOWN_RAMP = (1, 5)
"""Option codes of 605A and 605E that use 6084; the others use 6085."""
_STAY = (5, 6)
OPTION_CODES = {0x605A: (1, 2, 5, 6), 0x605E: (1, 2)}
"""Values taken by the quick stop's and the fault reaction's option codes."""


class Limits(NamedTuple):
    """What set-points are held to: positions m, in the drive's own coordinate; velocity m/s; acceleration m/s2."""

    lower: float
    upper: float
    velocity: float
    acceleration: float


class Parameters:
    """The set-up of one drive.

    Parameters
    ----------
    objects : ObjectStore
    units : Units
    capacity : excitation.Capacity
        What the machine can do: objects narrow it and never widen it.
    options : DriveOptions
        Power-on values.
    cycle_time : float
        s.
    """

    def __init__(
        self, objects: ObjectStore, units: Units, capacity: Capacity, options: DriveOptions, cycle_time: float
    ) -> None:
        self._objects = objects
        self._units = units
        self._capacity = capacity
        objects.set(0x1006, round(1e6 * cycle_time))
        objects.set(0x6085, max(1, round(options.stop_deceleration / units.acceleration)))
        objects.set(0x6065, round(options.following_error / units.position))
        objects.set(0x6066, round(1e3 * options.following_time))
        objects.set(0x2010, options.patience)
        objects.set(0x2011, max(1, round(options.start_window / units.position)))

    @property
    def patience(self) -> int:
        """Cycles without SYNC or set-point that are bridged."""
        return self._objects.get(0x2010)

    @property
    def start_window(self) -> float:
        """Largest distance of the first set-point from the measured position, m."""
        return self._objects.get(0x2011) * self._units.position

    @property
    def following_window(self) -> float:
        """Largest following error, m."""
        counts = self._objects.get(0x6065)
        return math.inf if counts == _UNLIMITED else counts * self._units.position

    @property
    def following_time(self) -> float:
        """How long it may be exceeded, s."""
        return 1e-3 * self._objects.get(0x6066)

    @property
    def stays(self) -> bool:
        """Whether a quick stop ends with power."""
        return self._objects.get(0x605A) in _STAY

    def deceleration(self, option: int) -> float:
        """Return the ramp of the quick stop (605A) or of the fault reaction (605E), m/s2."""
        code = self._objects.get(option)
        return self._objects.get(0x6084 if code in _SLOW_DOWN_RAMP else 0x6085) * self._units.acceleration

    def limits(self, zero: float) -> Limits:
        """Return the limits for a drive whose own zero is at `zero`, m, of the machine's coordinate."""
        get, units, capacity = self._objects.get, self._units, self._capacity
        return Limits(
            max(-0.5 * capacity.stroke - zero, get(0x607D, 1) * units.position),
            min(0.5 * capacity.stroke - zero, get(0x607D, 2) * units.position),
            min(capacity.velocity, get(0x607F) * units.velocity),
            min(capacity.acceleration, get(0x60C5) * units.acceleration),
        )

    def homing(self, limits: SetpointLimits, overtravel: float) -> HomingSettings | None:
        """Return how to home within limits, never faster than what stops within `overtravel`, m; None by no method."""
        get, units = self._objects.get, self._units
        if (method := get(0x6098)) not in METHODS:
            return None
        acceleration = min(limits.top_acceleration, get(0x609A) * units.acceleration)
        top = min(limits.top_velocity, math.sqrt(2.0 * acceleration * overtravel))
        fast, slow = (min(top, get(0x6099, sub) * units.velocity) for sub in (1, 2))
        return HomingSettings(method, fast, slow, acceleration, limits.cycle_time)

    @property
    def home_offset(self) -> float:
        """Zero position less home position, m."""
        return self._objects.get(0x607C) * self._units.position
