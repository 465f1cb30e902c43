"""The one place where scale factors come from: the SI-unit objects 60A8, 60A9 and 60AA of the drive's EDS.

Each is coded as CiA 303-2 and 402-2 say: exponent of ten (signed), unit of the numerator, unit of the denominator, 00.
"""

from __future__ import annotations

from functools import lru_cache
from importlib.resources import files
from typing import NamedTuple

from devices.cia301.dictionary import ObjectStore
from devices.errors import EdsError

SERVO_DRIVE = files("devices.cia402").joinpath("servo_drive.eds").read_text(encoding="utf-8")
"""EDS of the servo drive that is emulated here; the host's too, unless it is given another one."""

_METRE, _SECOND, _SECOND_SQUARED = 0x01, 0x03, 0x57


class Units(NamedTuple):
    """What one count is: of positions m, of velocities m/s, of accelerations m/s2."""

    position: float
    velocity: float
    acceleration: float


@lru_cache(maxsize=16)
def units_of(eds: str) -> Units:
    """Return the units an EDS declares.

    Raises
    ------
    EdsError
        Where it declares none, or others than powers of ten of metres and seconds.

    Examples
    --------
    >>> units_of(SERVO_DRIVE)
    Units(position=1e-09, velocity=1e-06, acceleration=1e-06)
    """
    objects = ObjectStore(eds, 1)
    return Units(
        _unit(objects, 0x60A8, "position in m", 0),
        _unit(objects, 0x60A9, "velocity in m/s", _SECOND),
        _unit(objects, 0x60AA, "acceleration in m/s2", _SECOND_SQUARED),
    )


def _unit(objects: ObjectStore, index: int, what: str, denominator: int) -> float:
    try:
        code = objects.get(index)
    except KeyError:
        raise EdsError(f"EDS tells no unit of {what} (object {index:04X})") from None
    if code & 0x00FFFF00 != _METRE << 16 | denominator << 8:
        raise EdsError(f"EDS tells {code:08X} as unit of {what} (object {index:04X}); it must be a power of ten of it")
    exponent = int.from_bytes(bytes([code >> 24]), "little", signed=True)
    return float(f"1e{exponent}")
