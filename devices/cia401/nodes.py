"""The nodes of a released machine before its cycles: who they are, what their PDOs carry, heartbeats, tilt at rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.cia301.commissioning import check_identity, check_pdos, describe_node, set_heartbeats
from devices.cia301.sdo_client import Sdo
from devices.cia401.release import RELEASE_OUTPUT, Input
from devices.sensors.measuring import INCLINOMETER
from devices.sensors.scale import counts_per_unit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from devices.cia401.link import ReleaseLink
    from devices.sample import Description
    from devices.sensors.reading import SensorReading

SDO_LIMIT = 0.2
"""For each answer, s."""
_RELEASE_DEVICE, _INCLINOMETER = "release device", "inclinometer"


class ReleasedNodes:
    """Release device, sensors and perhaps an inclinometer, by SDO.

    Parameters
    ----------
    link : ReleaseLink
    name : str
        What messages call the machine.
    release_node : int
    sensors : sequence of SensorReading
    inclinometer_node : int or None
    tries : int
        How often a lost answer is asked for again.
    """

    def __init__(
        self,
        link: ReleaseLink,
        name: str,
        release_node: int,
        sensors: Sequence[SensorReading],
        inclinometer_node: int | None,
        tries: int,
    ) -> None:
        sheets = [(release_node, RELEASE_OUTPUT, _RELEASE_DEVICE)]
        sheets += [(sensor.node, sensor.eds, sensor.what) for sensor in sensors]
        if inclinometer_node is not None:
            sheets.append((inclinometer_node, INCLINOMETER, _INCLINOMETER))
        self._link = link
        self._nodes = [
            (Sdo(link, node, eds, name, time_limit=SDO_LIMIT, tries=tries), eds, what) for node, eds, what in sheets
        ]
        self._inclinometer = self._nodes[-1][0] if inclinometer_node is not None else None

    def check(self) -> None:
        """Compare every node with its data sheet; DeviceMismatch or DeviceTimeout where it is another one, or none."""
        for sdo, eds, _ in self._nodes:
            check_identity(sdo, eds)
            check_pdos(sdo, eds)

    def commission(self) -> None:
        """Write everything that is to be set, and start the nodes; nothing moves."""
        link = self._link
        for sdo, _, _ in self._nodes:
            set_heartbeats(sdo, link.node)
            link.watch(sdo.node)
        link.start()
        link.drain()
        link.restarted = None

    def describe(self, inputs: Input) -> tuple[Description, ...]:
        """Ask every node who it is; the machine's `inputs` are what the release device is in."""
        states = {
            _RELEASE_DEVICE: " and ".join(str(bit.name).lower() for bit in inputs) or "not held",
            _INCLINOMETER: f"block tilted by {math.degrees(self.tilt()):+.3f} deg",
        }
        return tuple(describe_node(sdo, what, state=states.get(what, "operational")) for sdo, _, what in self._nodes)

    def tilt(self) -> float:
        """Return what the inclinometer says, rad; NaN without one."""
        if self._inclinometer is None:
            return math.nan
        return self._inclinometer.read(0x6110) / counts_per_unit(INCLINOMETER)
