"""The bus as an emulator's nodes meet it when something is wrong with it."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from devices.cia301.buses import CanBus
from devices.cia301.frames import HEARTBEAT, HOST_NODE, SYNC
from devices.faults.traffic import BadLine

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.faults.schedule import Schedule
    from devices.faults.traffic import Frame

_HOST_HEARTBEAT = HEARTBEAT + HOST_NODE
# Frames that are swallowed must not hold the caller.
_SWALLOWED_AT_ONCE = 1000


class NodeBus(CanBus):
    """Stands between an emulator's nodes and the bus.

    Imitated: lost and late SYNC; frames dropped, duplicated, reordered and corrupted, both ways; a node that is silent;
    heartbeats that end; a CAN controller that is off the bus. A line that is cut is cut for all nodes of the emulator
    where it is the drive's; another node is only not heard.

    Parameters
    ----------
    bus : CanBus
        The real one, whose place it takes; it stays open.
    schedule : Schedule
    rng : numpy.random.Generator
    drive_node : int
        CANopen node that moves the table.
    each : callable
        Called before every look for a frame: lets what is due begin.
    """

    def __init__(
        self, bus: CanBus, schedule: Schedule, rng: np.random.Generator, drive_node: int, each: Callable[[], None]
    ) -> None:
        super().__init__(bus.raw, str(bus), echoing=bus.echoing)
        self._schedule = schedule
        self._drive_node = drive_node
        self._each = each
        self._incoming, self._outgoing = (BadLine(schedule, generator) for generator in rng.spawn(2))
        self._waiting: deque[Frame] = deque()
        self._sync_to_lose = 0
        self._off = False
        self.gone = False
        """Whether nothing goes through any more: the emulator's process was killed."""
        self.recovered: Callable[[], object] = _nothing
        """Called when the controller is on the bus again."""
        self.synced: Callable[[], object] = _nothing
        """Called with every SYNC on the bus, whether the nodes hear it or not."""

    def send(self, identifier: int, data: bytes) -> None:
        """Send one frame of a node, as far as the fault lets it."""
        node = identifier & 0x7F
        silent, quiet = self._schedule.active("node_silent"), self._schedule.active("heartbeat_lost")
        if self._cut() or (silent is not None and node == silent.magnitude):
            return
        if quiet is not None and node == quiet.magnitude and identifier - node == HEARTBEAT:
            return
        for frame in self._outgoing.carry((identifier, data)):
            super().send(*frame)

    def receive(self, time_limit: float = 0.0) -> Frame | None:
        """Return the next frame for the nodes, as far as the fault lets it through."""
        self._each()
        for frame in self._outgoing.flush():
            super().send(*frame)
        for _ in range(_SWALLOWED_AT_ONCE):
            if self._waiting:
                return self._waiting.popleft()
            frame = super().receive(time_limit)
            time_limit = 0.0
            self._waiting.extend(self._incoming.flush() if frame is None else self._let_through(frame))
            if frame is None and not self._waiting:
                return None
        return None

    def look(self) -> None:
        """Notice a recovery from bus-off."""
        before, self._off = self._off, self._schedule.active("bus_off") is not None
        if before and not self._off:
            self.recovered()

    def close(self) -> None:
        """Nothing of ours is open: the bus belongs to who opened it."""

    def _let_through(self, frame: Frame) -> list[Frame]:
        schedule = self._schedule
        if frame[0] == SYNC:
            self.synced()
        if self._cut():
            return []
        if frame[0] == SYNC:
            if (lost := schedule.due("sync_lost")) is not None:
                self._sync_to_lose += int(lost.magnitude)
            if self._sync_to_lose > 0:
                self._sync_to_lose -= 1
                return []
            if (late := schedule.due("sync_late")) is not None:
                schedule.stand_still(late.magnitude, self._each)
        if frame[0] == _HOST_HEARTBEAT and schedule.active("host_heartbeat_lost") is not None:
            return []
        return self._incoming.carry(frame)

    def _cut(self) -> bool:
        silent = self._schedule.active("node_silent")
        drive_silent = silent is not None and silent.magnitude == self._drive_node
        return self.gone or drive_silent or self._schedule.active("bus_off") is not None


def _nothing() -> None:
    """Nobody wants to know."""
