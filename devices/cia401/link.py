"""The host's side of a released machine's cycle: outputs and SYNC out, inputs and readings of that SYNC in."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from devices.cia301 import frames
from devices.cia301.host import Host
from devices.cia401.release import Input, Output, pack_outputs, unpack_inputs
from devices.errors import DeviceTimeout, FrameError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.cia301.buses import CanBus
    from devices.clock import Clock
    from devices.sensors.reading import SensorReading


class Feedback(NamedTuple):
    """What the nodes latched at one SYNC: inputs, position m, acceleration m/s2, rotation rad.

    NaN without a sensor; where only the inputs were asked for, NaN wherever an answer did not come or made no sense.
    """

    inputs: Input
    position: float
    acceleration: float
    rotation: float


class ReleaseLink(Host):
    """A release device and its sensors, seen from the host.

    Parameters
    ----------
    bus : CanBus
    release_node : int
    sensors : sequence of SensorReading
        Position, acceleration and, where there is one, rotation, in this order.
    others : sequence of int
        Nodes that send nothing in the cycle.
    clock : Clock
    idle : callable, optional
        Called while waiting; nodes that live on this thread are serviced in it. With it nothing blocks.
    time_limit : float
        For all answers to one SYNC, s.
    node : int
        The host's own number.
    """

    def __init__(
        self,
        bus: CanBus,
        release_node: int,
        sensors: Sequence[SensorReading],
        others: Sequence[int],
        clock: Clock,
        idle: Callable[[], None] | None,
        time_limit: float,
        node: int,
    ) -> None:
        self._answers = {frames.TPDO1 + release_node: "inputs"}
        self._answers |= {frames.TPDO1 + sensor.node: sensor.what for sensor in sensors}
        self._outputs = frames.RPDO1 + release_node
        nodes = [release_node, *(sensor.node for sensor in sensors), *others]
        super().__init__(bus, nodes, clock, idle, node=node, answers=list(self._answers), own=[self._outputs])
        self._sensors = sensors
        self._time_limit = time_limit
        self._order = list(self._answers)

    def cycle(self, counter: int, outputs: Output | None, spare: float | None = None) -> Feedback:
        """Send outputs, if any, and SYNC; return the answers.

        With `spare` only the inputs are required: everything else is waited for no longer than `spare` s.

        Raises
        ------
        DeviceTimeout
            Where a required answer is missing; it says which.
        FrameError
            Where it makes no sense.
        """
        self.beat()
        if outputs is not None:
            self.bus.send(self._outputs, pack_outputs(outputs))
        self.bus.send(frames.SYNC, frames.pack_sync(counter))
        answers = self.collect(self._time_limit, spare)
        required = self._order if spare is None else self._order[:1]
        missing = [self._answers[identifier] for identifier in required if identifier not in answers]
        if missing:
            what = " and ".join(missing)
            raise DeviceTimeout(f"no {what} came within {self._time_limit:g} s of the SYNC on {self.bus}")
        values = [math.nan, math.nan, math.nan]
        for k, sensor in enumerate(self._sensors):
            data = answers.get(frames.TPDO1 + sensor.node)
            try:
                values[k] = math.nan if data is None else sensor.value(data)
            except FrameError:
                if spare is None:
                    raise
                self.counts.malformed += 1
        return Feedback(unpack_inputs(answers[self._order[0]]), *values)
