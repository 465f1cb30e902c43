"""A machine that does not do what its drive tells it, and switches that are pressed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:
    from devices.cia402.machine import Switches
    from devices.faults.schedule import Schedule

LOOSENING = 0.1
"""Time in which the loss of motion grows to its full share, s: a coupling that lets go, not a blow."""


class ServoMachine(Protocol):
    """A `devices.cia402.machine.Machine` with switches, whose power the drive controls and whose cycle can be set."""

    powered: bool

    def advance(self, setpoint: float) -> None: ...
    def measure_position(self) -> float: ...
    def measure_acceleration(self) -> float: ...
    def pace(self, cycle_time: float) -> None: ...
    @property
    def velocity(self) -> float: ...
    @property
    def switches(self) -> Switches: ...


class FaultyMachine:
    """Stands between a drive and its machine.

    Imitated: a coupling that slips, so that a share of the set-point's motion is lost (following_error); a limit switch
    that is pressed where none should be (limit_switch); the emergency stop (emergency_stop), which stays pressed.

    Parameters
    ----------
    inner : ServoMachine
    schedule : Schedule
    """

    def __init__(self, inner: ServoMachine, schedule: Schedule) -> None:
        self._inner = inner
        self._schedule = schedule
        self._asked: float | None = None
        self._lost = 0.0
        self._share = 0.0
        self._stop = False

    def advance(self, setpoint: float) -> None:
        """Live through one cycle while the set-point goes to `setpoint`, m, less what was lost."""
        schedule = self._schedule
        if (fault := schedule.active("following_error")) is not None and self._asked is not None:
            grown = self._share + fault.magnitude * schedule.cycle_time / LOOSENING
            self._share = min(fault.magnitude, grown)
            self._lost += self._share * (setpoint - self._asked)
        self._asked = setpoint
        self._inner.advance(setpoint - self._lost)

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        return self._inner.measure_position()

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2."""
        return self._inner.measure_acceleration()

    def pace(self, cycle_time: float) -> None:
        """Let every later `advance` take `cycle_time`, s."""
        self._inner.pace(cycle_time)

    @property
    def velocity(self) -> float:
        """m/s."""
        return self._inner.velocity

    @property
    def powered(self) -> bool:
        """Whether the drive pushes."""
        return self._inner.powered

    @powered.setter
    def powered(self, powered: bool) -> None:
        self._inner.powered = powered

    @property
    def switches(self) -> Switches:
        """The machine's switches, and those the fault presses."""
        seen = self._inner.switches
        if self._schedule.due("emergency_stop") is not None:
            self._stop = True
        if (pressed := self._schedule.active("limit_switch")) is not None:
            seen = seen._replace(**{"positive" if pressed.magnitude > 0.0 else "negative": True})
        return seen._replace(stop=True) if self._stop else seen
