"""Emulated sensors that answer every SYNC with process values: position, acceleration, displacements, tilt.

Each value is asked of the machine, scaled as the EDS says (`devices.sensors.scale`), and sent as INT32 in TPDO1.
"""

from __future__ import annotations

import math
from importlib.resources import files
from struct import Struct
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.node import Device
from devices.errors import FrameError
from devices.sensors.scale import METRE, METRE_PER_SECOND_SQUARED, counts_per_unit

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from devices.cia301.node import Send


def _eds(name: str) -> str:
    return files("devices.sensors").joinpath(f"{name}.eds").read_text(encoding="utf-8")


POSITION_ENCODER = _eds("position")
"""EDS of the base's position encoder (CiA 406)."""
ACCELERATION_INPUT = _eds("acceleration")
"""EDS of the base's acceleration input (CiA 404)."""
DISPLACEMENT_INPUTS = _eds("displacements")
"""EDS of two displacement inputs (CiA 404)."""
INCLINOMETER = _eds("inclinometer")
"""EDS of an inclinometer (CiA 410)."""

_LONGS = {1: Struct("<i"), 2: Struct("<ii")}
_LEAST, _GREATEST = -(2**31), 2**31 - 1


class MeasuringDevice(Device):
    """A sensor node of one or two channels.

    Not imitated: the sensor's own dynamics and delay, its faults (`devices.faults`).

    Parameters
    ----------
    identifier : int
        CANopen node number.
    send : callable
        Takes identifier and bytes of each frame.
    eds : str
        One of the data sheets above.
    measure : callable
        Returns the reading of each channel now, SI units; NaN where the sensor sees nothing.
    unit : int
        See `counts_per_unit`.
    """

    def __init__(
        self,
        identifier: int,
        send: Send,
        eds: str,
        measure: Callable[[], Sequence[float]],
        *,
        unit: int = METRE,
        heartbeat_period: float = 0.1,
    ) -> None:
        super().__init__(identifier, send, eds, heartbeat_period=heartbeat_period)
        self._scale = counts_per_unit(eds, unit)
        self._measure = measure
        objects = self.node.objects
        # CiA 301: bit 31 of the identifier switches a PDO off.
        self._sends = not objects.get(0x1800, 1) >> 31
        # The first channel's object is the first that TPDO1 maps (1A00:1: index, sub-index, length).
        for channel in range(objects.get(0x1A00)):
            entry = objects.get(0x1A00, channel + 1)
            objects.on_read(entry >> 16, lambda k=channel: self._counts()[k], entry >> 8 & 0xFF)

    def sync(self, counter: int) -> None:  # noqa: ARG002 - whichever it is
        """Answer a SYNC."""
        if self._sends and self.node.operational:
            counts = self._counts()
            self.node.send(frames.TPDO1 + self.node.identifier, _LONGS[len(counts)].pack(*counts))

    def _counts(self) -> list[int]:
        """Return the readings in counts; the least number stands for none."""
        return [
            _LEAST if math.isnan(value) else min(max(round(value * self._scale), _LEAST + 1), _GREATEST)
            for value in self._measure()
        ]


def decode(data: bytes, scale: float, channels: int = 1) -> tuple[float, ...]:
    """Return the readings of a sensor's TPDO1 in SI units; NaN where it saw nothing.

    Parameters
    ----------
    data : bytes
    scale : float
        `counts_per_unit` of its EDS.
    channels : int
        1 or 2.

    Raises
    ------
    FrameError
        Where the frame has another length.

    Examples
    --------
    >>> decode(bytes.fromhex("40e20100"), 1e6)
    (0.123456,)
    """
    layout = _LONGS[channels]
    if len(data) != layout.size:
        raise FrameError(f"sensor TPDO1 has {len(data)} bytes; it must have {layout.size}")
    return tuple(math.nan if counts == _LEAST else counts / scale for counts in layout.unpack(data))


def position_encoder(identifier: int, send: Send, position: Callable[[], float]) -> MeasuringDevice:
    """Return the node that measures the base's position, m (CiA 406)."""
    return MeasuringDevice(identifier, send, POSITION_ENCODER, lambda: (position(),))


def acceleration_input(identifier: int, send: Send, acceleration: Callable[[], float]) -> MeasuringDevice:
    """Return the node that measures the base's acceleration, m/s2 (CiA 404)."""
    return MeasuringDevice(
        identifier, send, ACCELERATION_INPUT, lambda: (acceleration(),), unit=METRE_PER_SECOND_SQUARED
    )
