"""The specimen's rotation sensor: an encoder on a CANopen node that answers every SYNC with the rotation.

TPDO1 carries one INT32 in microradians, positive when the specimen's top leans to +x.
"""

from __future__ import annotations

from importlib.resources import files
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.node import Device

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia301.node import Send

ROTATION_SENSOR = files("devices.sensors").joinpath("rotation.eds").read_text(encoding="utf-8")
"""EDS of the rotation sensor."""
ROTATION_UNIT = 1e-6
"""rad, one count of rotation."""


def decode_rotation(data: bytes) -> float:
    """Return the rotation, rad, that a rotation sensor's TPDO1 carries.

    Examples
    --------
    >>> decode_rotation(bytes.fromhex("40e20100"))
    0.123456
    """
    return frames.unpack_long(data, "rotation TPDO1") / round(1.0 / ROTATION_UNIT)


class RotationSensor(Device):
    """An emulated rotation sensor.

    Not imitated: the sensor's own dynamics and delay, wrap-around of a real encoder, a slipping coupling.

    Parameters
    ----------
    identifier : int
        CANopen node number.
    send : callable
        Takes identifier and bytes of each frame.
    rotation : callable
        Returns the specimen's true rotation now, rad.
    quantum : float
        Encoder step, rad; 0 for none. Default 0.1 mrad, a placeholder for the encoder's data sheet.
    noise : float
        Standard deviation of Gaussian noise before quantisation, rad.
    rng : numpy.random.Generator, optional
        Needed where `noise` is above 0.
    """

    def __init__(
        self,
        identifier: int,
        send: Send,
        rotation: Callable[[], float],
        *,
        quantum: float = 1e-4,
        noise: float = 0.0,
        rng: np.random.Generator | None = None,
        heartbeat_period: float = 0.1,
    ) -> None:
        if noise > 0.0 and rng is None:
            raise ValueError(f"rotation sensor with noise of {noise} rad needs a random generator")
        super().__init__(identifier, send, ROTATION_SENSOR, heartbeat_period=heartbeat_period)
        self._rotation = rotation
        self._quantum = quantum
        self._noise = noise
        self._rng = rng

    def sync(self, counter: int) -> None:  # noqa: ARG002 - whichever it is
        """Answer a SYNC."""
        if self.node.operational:
            self.measure()

    def measure(self) -> None:
        """Measure and send.

        Raises
        ------
        FrameError
            Where the specimen's rotation is no number.
        """
        reading = self._rotation()
        if self._rng is not None and self._noise > 0.0:
            reading += self._noise * self._rng.standard_normal()
        if self._quantum > 0.0:
            reading = round(reading / self._quantum) * self._quantum
        value = frames.counts(reading, ROTATION_UNIT, "rotation")
        self.node.send(frames.TPDO1 + self.node.identifier, frames.pack_long(value))
