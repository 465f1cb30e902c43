"""Sensors that lie: they stand between a plant and its real sensors."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from devices.faults.schedule import Schedule


class Sensor(Protocol):
    """What a plant reads."""

    def read(self, true: float) -> float:
        """Return the reading where the truth is `true`."""
        ...


class FaultyEncoder:
    """An encoder that may jump or freeze.

    Parameters
    ----------
    inner : Sensor
        The encoder itself; it is read every time, so that its noise stays the same.
    schedule : Schedule
        Faults used: encoder_glitch, encoder_frozen.
    """

    def __init__(self, inner: Sensor, schedule: Schedule) -> None:
        self._inner = inner
        self._schedule = schedule
        self._last = 0.0

    def read(self, true: float) -> float:
        """Return the reading, m, or what the fault makes of it."""
        reading = self._inner.read(true)
        if self._schedule.active("encoder_frozen") is not None:
            return self._last
        self._last = reading
        glitch = self._schedule.active("encoder_glitch")
        return reading if glitch is None else reading + glitch.magnitude


class FaultyAccelerometer:
    """An accelerometer that may stick, saturate or be biased.

    Parameters
    ----------
    inner : Sensor
        The accelerometer itself; it is read every time, so that its noise stays the same.
    schedule : Schedule
        Faults used: accelerometer_stuck, accelerometer_saturated, accelerometer_biased.
    """

    def __init__(self, inner: Sensor, schedule: Schedule) -> None:
        self._inner = inner
        self._schedule = schedule
        self._last = 0.0

    def read(self, true: float) -> float:
        """Return the reading, m/s2, or what the fault makes of it."""
        reading = self._inner.read(true)
        active = self._schedule.active
        if (saturated := active("accelerometer_saturated")) is not None:
            return saturated.magnitude
        if active("accelerometer_stuck") is not None:
            return self._last
        biased = active("accelerometer_biased")
        self._last = reading if biased is None else reading + biased.magnitude
        return self._last
