"""The host's side of the cycle: one SYNC out, the answers of that SYNC in, within a time limit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from devices.cia301 import frames
from devices.cia301.host import Host
from devices.cia402.frames import pack_target, unpack_actual
from devices.errors import DeviceTimeout, FrameError
from devices.sensors.rotation import decode_rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.buses import CanBus
    from devices.cia402.units import Units
    from devices.clock import Clock


class Feedback(NamedTuple):
    """What the nodes latched at one SYNC: position m, acceleration m/s2, rotation rad (NaN without a sensor).

    Where only the drive's statusword and position were asked for, acceleration too is NaN where it did not come.
    """

    statusword: int
    position: float
    acceleration: float
    rotation: float


class Link(Host):
    """One drive and perhaps one rotation sensor, seen from the host.

    Parameters
    ----------
    bus : CanBus
    drive_node : int
    sensor_node : int, optional
    clock : Clock
    idle : callable, optional
        Called while waiting; nodes that live on this thread are serviced in it. With it nothing blocks.
    time_limit : float
        For all answers to one SYNC, s.
    units : Units
        Of the drive's process data.
    node : int
        The host's own number.
    """

    def __init__(
        self,
        bus: CanBus,
        drive_node: int,
        sensor_node: int | None,
        clock: Clock,
        idle: Callable[[], None] | None,
        time_limit: float,
        units: Units,
        node: int = frames.HOST_NODE,
    ) -> None:
        self._answers = {
            frames.TPDO1 + drive_node: "statusword and position",
            frames.TPDO2 + drive_node: "acceleration",
        }
        if sensor_node is not None:
            self._answers[frames.TPDO1 + sensor_node] = "rotation"
        self._target = frames.RPDO1 + drive_node
        nodes = [drive_node] if sensor_node is None else [drive_node, sensor_node]
        super().__init__(bus, nodes, clock, idle, node=node, answers=list(self._answers), own=[self._target])
        self._time_limit = time_limit
        self._units = units
        self._order = list(self._answers)
        # Of every answer but the first, in their order.
        self._decoders = (self._acceleration, decode_rotation)

    @property
    def emergency(self) -> frames.Emergency | None:
        """The drive's first emergency since its last error reset."""
        return self.emergencies.get(self.nodes[0])

    def cycle(self, counter: int, command: tuple[int, int] | None, spare: float | None = None) -> Feedback:
        """Send controlword and target, counts, if any, and SYNC; return the answers.

        With `spare` only the drive's statusword and position are required: everything else is waited for no longer than
        `spare` s, and is NaN where it does not come or makes no sense.

        Raises
        ------
        DeviceTimeout
            Where a required answer is missing; it says which.
        FrameError
            Where it makes no sense.
        """
        self.beat()
        if command is not None:
            self.bus.send(self._target, pack_target(*command))
        self.bus.send(frames.SYNC, frames.pack_sync(counter))
        foreign = self.counts.foreign
        answers = self.collect(self._time_limit, spare)
        required = self._order if spare is None else self._order[:1]
        missing = [self._answers[identifier] for identifier in required if identifier not in answers]
        if missing:
            what = " and ".join(missing)
            others = f", but {n} frames of others" if (n := self.counts.foreign - foreign) > 0 else ""
            raise DeviceTimeout(f"no {what} came within {self._time_limit:g} s of the SYNC on {self.bus}{others}")
        statusword, position = unpack_actual(answers[self._order[0]])
        values = [math.nan, math.nan]
        for i, (identifier, decode) in enumerate(zip(self._order[1:], self._decoders, strict=False)):
            try:
                if identifier in answers:
                    values[i] = decode(answers[identifier])
            except FrameError:
                if spare is None:
                    raise
                self.counts.malformed += 1
        return Feedback(statusword, position * self._units.position, *values)

    def _acceleration(self, data: bytes) -> float:
        return frames.unpack_long(data, "TPDO2") * self._units.acceleration
