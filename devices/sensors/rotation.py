"""The specimen's rotation sensor: an encoder on a CANopen node that answers every SYNC with the rotation.

TPDO1 carries one INT32 in microradians, positive when the specimen's top leans to +x.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.cia402 import frames
from devices.cia402.node import Node

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy as np

    from devices.cia402.node import Send


def decode_rotation(data: bytes) -> float:
    """Return the rotation, rad, that a rotation sensor's TPDO1 carries.

    Examples
    --------
    >>> decode_rotation(bytes.fromhex("40e20100"))
    0.123456
    """
    return frames.unpack_long(data, "rotation TPDO1") / round(1.0 / frames.ROTATION_UNIT)


class RotationSensor:
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
        self.node = Node(identifier, send, heartbeat_period)
        self.refused_frames = 0
        self._rotation = rotation
        self._quantum = quantum
        self._noise = noise
        self._rng = rng

    def boot(self) -> None:
        """Power on."""
        self.node.boot()

    def receive(self, identifier: int, data: bytes) -> None:
        """Take one frame from the bus; malformed ones are counted in `refused_frames`."""
        try:
            if identifier == frames.SYNC:
                frames.unpack_sync(data)
            elif identifier == frames.NMT:
                self.node.command(data, self)
        except frames.FrameError:
            self.refused_frames += 1
            return
        if identifier == frames.SYNC and self.node.operational:
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
        value = frames.counts(reading, frames.ROTATION_UNIT, "rotation")
        self.node.send(frames.TPDO1 + self.node.identifier, frames.pack_long(value))

    def leave_operational(self) -> None:
        """Nothing to stop."""
