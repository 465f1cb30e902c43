"""Another master on the table's bus: a second host, a service tool, a stray script."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.frames import HOST_NODE, NmtState
from devices.cia402.frames import pack_target, unpack_target
from devices.cia402.states import ENABLE_OPERATION
from devices.cia402.units import SERVO_DRIVE, units_of

if TYPE_CHECKING:
    from devices.cia301.buses import CanBus
    from devices.faults.schedule import Schedule

NAMES = ("second_master", "foreign_nmt", "host_number_taken", "setpoint_on_bus", "error_frames")
"""The faults for which there is one."""
_BEAT = 0.1


class ForeignMaster:
    """A bus end of its own, and the set-points it overheard.

    Parameters
    ----------
    bus : CanBus
        A third end; it stays open.
    schedule : Schedule
    drive_node : int
        CANopen node that moves the table.
    """

    def __init__(self, bus: CanBus, schedule: Schedule, drive_node: int) -> None:
        self._bus = bus
        self._schedule = schedule
        self._identifier = frames.RPDO1 + drive_node
        self._unit = units_of(SERVO_DRIVE).position
        self._overheard = pack_target(ENABLE_OPERATION, 0)
        self._syncs = 0
        self._beat_due = 0.0

    def overhear(self, identifier: int, data: bytes) -> None:
        """Take a frame of the host's; set-points of a servo drive are remembered."""
        if identifier == self._identifier and len(data) == len(self._overheard):
            self._overheard = data

    def act(self) -> None:
        """Send what is due between the host's set-point and its SYNC."""
        schedule, send = self._schedule, self._bus.send
        # Read by nobody, a queue fills up, and then it holds whoever sends.
        while self._bus.receive() is not None:
            pass
        if (fault := schedule.due("foreign_nmt")) is not None:
            send(frames.NMT, bytes([int(fault.magnitude), 0]))
        if (fault := schedule.due("setpoint_on_bus")) is not None:
            controlword, target = unpack_target(self._overheard)
            send(self._identifier, pack_target(controlword, target + round(fault.magnitude / self._unit)))
        if (fault := schedule.active("second_master")) is not None:
            self._syncs += 1
            send(self._identifier, pack_target(ENABLE_OPERATION, round(fault.magnitude / self._unit)))
            send(frames.SYNC, frames.pack_sync(frames.sync_counter(self._syncs)))
        if (fault := schedule.active("error_frames")) is not None:
            for _ in range(int(fault.magnitude)):
                self._bus.send_error()
        now = schedule.clock.now()
        if schedule.active("host_number_taken") is not None and now >= self._beat_due:
            self._beat_due = now + _BEAT
            send(frames.HEARTBEAT + HOST_NODE, frames.pack_heartbeat(NmtState.OPERATIONAL))
