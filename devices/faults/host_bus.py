"""The bus as a host meets it when something is wrong with its controller, or somebody else commands the table."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.buses import CanBus
from devices.errors import BusFailure

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.faults.foreign import ForeignMaster
    from devices.faults.schedule import Schedule
    from devices.faults.traffic import Frame

_FOREIGN_FRAME = (0x7E5, b"")


class HostBus(CanBus):
    """Stands between a host and the bus.

    Imitated: a controller that is off the bus; a receive queue full of foreign frames. A foreign master sends its
    frames between the host's set-point and the host's SYNC, where they do most harm.

    Parameters
    ----------
    bus : CanBus
        The real one, whose place it takes; it stays open.
    schedule : Schedule
    foreign : ForeignMaster, optional
    meanwhile : callable
        Called where the host gets nowhere: what is not the host lives on.
    """

    def __init__(
        self, bus: CanBus, schedule: Schedule, foreign: ForeignMaster | None, meanwhile: Callable[[], None]
    ) -> None:
        super().__init__(bus.raw, str(bus), echoing=bus.echoing)
        self._meanwhile = meanwhile
        self._schedule = schedule
        self._foreign = foreign
        self._flood: deque[Frame] = deque()

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame of the host, as far as the fault lets it."""
        self._check()
        if identifier == frames.SYNC:
            if self._foreign is not None:
                self._foreign.act()
            if (full := self._schedule.active("receive_queue_full")) is not None:
                self._flood = deque([_FOREIGN_FRAME] * int(full.magnitude))
        super().send(identifier, data)
        if self._foreign is not None:
            self._foreign.overhear(identifier, data)

    def receive(self, time_limit: float = 0.0) -> Frame | None:
        """Return the next frame for the host, as far as the fault lets it through."""
        self._check()
        if self._flood:
            return self._flood.popleft()
        frame = super().receive(time_limit)
        while frame is not None and self._schedule.active("receive_queue_full") is not None:
            frame = super().receive()
        return frame

    def close(self) -> None:
        """Nothing of ours is open: the bus belongs to who opened it."""

    def _check(self) -> None:
        if self._schedule.active("host_bus_off") is not None:
            self._meanwhile()
            raise BusFailure(f"{self} is bus-off: the host's CAN controller took itself off the bus after many errors")
