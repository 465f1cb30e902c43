"""What goes wrong in the host itself: it stands still, it is told a wrong set-point, its operator stops it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.clock import Clock
    from devices.faults.fault import Fault
    from devices.faults.schedule import Schedule


class StallingClock:
    """The clock of a live loop: it begins the table's clock, and lets the host stand still where that is due.

    Parameters
    ----------
    schedule : Schedule
        Faults used: host_stall, host_killed.
    meanwhile : callable
        Called once a cycle time while the host stands still: what is not the host lives on.
    killed : callable
        Ends the host.
    """

    def __init__(self, schedule: Schedule, meanwhile: Callable[[], None], killed: Callable[[], None]) -> None:
        self._schedule = schedule
        self._inner: Clock = schedule.clock
        self._meanwhile = meanwhile
        self._killed = killed

    def now(self) -> float:
        """Return the time, s; the first call begins the table's clock."""
        self._schedule.start()
        return self._inner.now()

    def wait_until(self, moment: float) -> float:
        """Wait for `moment`, s, and for as long as the host stands still; return the lateness, s."""
        self._inner.wait_until(moment)
        self._schedule.look()
        if self._schedule.due("host_killed") is not None:
            self._killed()
        if (stall := self._schedule.due("host_stall")) is not None:
            self._schedule.stand_still(stall.magnitude, self._meanwhile)
        return max(0.0, self._inner.now() - moment)


def with_jump(set_points: Sequence[float], faults: Sequence[Fault], cycle_time: float) -> list[float]:
    """Return the set-points, m, with the jump of every setpoint_in_exchange in the one cycle it is for.

    Examples
    --------
    >>> from devices.faults.catalogue import parse_fault
    >>> with_jump([0.0, 0.0, 0.0], [parse_fault("setpoint_in_exchange@0.001:0.5")], 1e-3)
    [0.0, 0.5, 0.0]
    """
    jumping = list(set_points)
    for fault in faults:
        cycle = math.ceil(fault.at / cycle_time - 1e-6)
        if fault.name == "setpoint_in_exchange" and cycle < len(jumping):
            jumping[cycle] += fault.magnitude
    return jumping
