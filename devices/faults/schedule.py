"""When faults begin and end: by cycles of the table's clock, told by whatever clock drives the run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.clock import Clock
    from devices.faults.fault import Fault

# A cycle begins at its time or a rounding before it.
_ROUNDING = 1e-6


class Schedule:
    """The faults of one run, and the time.

    The table's clock starts with `start`, in the instant the run's first cycle begins; before it nothing is active, so
    that no fault disturbs connecting and positioning. A fault is active from the first cycle that does not begin before
    its time.

    Parameters
    ----------
    faults : sequence of Fault
    clock : Clock
        The one the run goes by.
    cycle_time : float
        s.

    Attributes
    ----------
    announce : callable
        Called with each fault as it begins, and its time on the table's clock, s.
    """

    def __init__(self, faults: Sequence[Fault], clock: Clock, cycle_time: float) -> None:
        self.faults = tuple(faults)
        self.clock = clock
        self.cycle_time = cycle_time
        self.announce: Callable[[Fault, float], None] = _unheard
        self._start = math.nan
        self._pending = set(self.faults)
        self._announced: set[Fault] = set()

    def start(self) -> None:
        """Let the table's clock begin now, unless it has begun."""
        if not self.running:
            self._start = self.clock.now()

    @property
    def running(self) -> bool:
        """Whether the table's clock has begun."""
        return not math.isnan(self._start)

    @property
    def cycle(self) -> int:
        """Number of the cycle whose time it is; -1 before the first."""
        if not self.running:
            return -1
        return math.floor((self.clock.now() - self._start) / self.cycle_time + _ROUNDING)

    def active(self, name: str) -> Fault | None:
        """Return the fault of that name that lasts now, the first one where there are several."""
        for fault in self.faults:
            if fault.name == name and self._first(fault) <= self.cycle < self._end(fault):
                self._say(fault)
                return fault
        return None

    def due(self, name: str) -> Fault | None:
        """Return a fault of that name whose time has come, once."""
        for fault in self.faults:
            if fault.name == name and fault in self._pending and self.cycle >= self._first(fault):
                self._pending.discard(fault)
                self._say(fault)
                return fault
        return None

    def look(self) -> None:
        """Announce what has begun, whether or not it has done anything yet."""
        for fault in self.faults:
            if self.cycle >= self._first(fault):
                self._say(fault)

    def has(self, *names: str) -> bool:
        """Whether there is any fault of these names."""
        return any(fault.name in names for fault in self.faults)

    def stand_still(self, duration: float, meanwhile: Callable[[], None]) -> None:
        """Let `duration`, s, pass for whoever calls; `meanwhile` is called once a cycle time, for the others."""
        begun, h = self.clock.now(), self.cycle_time
        for k in range(1, math.ceil(duration / h) + 1):
            self.clock.wait_until(begun + min(k * h, duration))
            meanwhile()

    def _first(self, fault: Fault) -> int:
        return math.ceil(fault.at / self.cycle_time - _ROUNDING)

    def _end(self, fault: Fault) -> float:
        if math.isinf(fault.duration):
            return math.inf
        return self._first(fault) + max(1, round(fault.duration / self.cycle_time))

    def _say(self, fault: Fault) -> None:
        if fault not in self._announced:
            self._announced.add(fault)
            self.announce(fault, self.cycle * self.cycle_time)


def _unheard(fault: Fault, time: float) -> None:
    """Tell nobody."""
