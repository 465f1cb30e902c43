"""How the host reads a sensor: which node, which data sheet, what its TPDO1 means."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from devices.sensors.displacements import rotation_from
from devices.sensors.measuring import ACCELERATION_INPUT, DISPLACEMENT_INPUTS, POSITION_ENCODER, decode
from devices.sensors.rotation import ROTATION_SENSOR, decode_rotation
from devices.sensors.scale import METRE_PER_SECOND_SQUARED, counts_per_unit


@dataclass(frozen=True, slots=True)
class SensorReading:
    """One sensor node as the host reads it.

    Attributes
    ----------
    node : int
        CANopen node number.
    what : str
        What messages call it.
    eds : str
        Text of its electronic data sheet.
    value : callable
        Bytes of its TPDO1 -> reading, SI units; raises `FrameError`.
    """

    node: int
    what: str
    eds: str
    value: Callable[[bytes], float]


def base_position(node: int) -> SensorReading:
    """Return how the base's position is read, m (CiA 406)."""
    scale = counts_per_unit(POSITION_ENCODER)
    return SensorReading(node, "position encoder", POSITION_ENCODER, lambda data: decode(data, scale)[0])


def base_acceleration(node: int) -> SensorReading:
    """Return how the base's acceleration is read, m/s2 (CiA 404)."""
    scale = counts_per_unit(ACCELERATION_INPUT, METRE_PER_SECOND_SQUARED)
    return SensorReading(node, "acceleration input", ACCELERATION_INPUT, lambda data: decode(data, scale)[0])


def rotation_by_encoder(node: int) -> SensorReading:
    """Return how the block's rotation is read from an encoder, rad (CiA 406)."""
    return SensorReading(node, "rotation sensor", ROTATION_SENSOR, decode_rotation)


def rotation_by_displacements(node: int, distance: float) -> SensorReading:
    """Return how the block's rotation is read from two displacement sensors `distance`, m, apart, rad (CiA 404).

    NaN where a beam misses the block: a fallen one is not seen.
    """
    scale = counts_per_unit(DISPLACEMENT_INPUTS)

    def value(data: bytes) -> float:
        lower, upper = decode(data, scale, channels=2)
        return rotation_from(lower, upper, distance)

    return SensorReading(node, "displacement inputs", DISPLACEMENT_INPUTS, value)
