"""What one count of a sensor's process value is, in SI units: told by the EDS of the sensor, in its profile's objects.

| profile | value | scale |
|---|---|---|
| CiA 404, analogue input | 9130:k | 6132:k decimal digits of the unit 6131:k (coded as CiA 303-2 says) |
| CiA 406, linear encoder | 6004 | 6005:1 steps of 1 nm |
| CiA 410, inclinometer | 6110 | 6000 steps of 0.001 degree |
"""

from __future__ import annotations

import math
from functools import lru_cache

from devices.cia301.dictionary import ObjectStore
from devices.errors import EdsError

METRE, METRE_PER_SECOND_SQUARED = 0x00010000, 0x00015700
"""Unit codes of object 6131 (CiA 303-2: prefix, numerator, denominator, 00)."""

_ANALOGUE, _ENCODER, _INCLINOMETER = 0x0194, 0x0196, 0x019A
_NANOMETRE, _MILLIDEGREE = 1e-9, math.radians(1e-3)


@lru_cache(maxsize=16)
def counts_per_unit(eds: str, unit: int = METRE) -> float:
    """Return how many counts one m, m/s2 or rad is.

    Parameters
    ----------
    eds : str
        Text of the electronic data sheet.
    unit : int
        What an analogue input must be in: `METRE` or `METRE_PER_SECOND_SQUARED`.

    Raises
    ------
    EdsError
        Where the profile is none of these, or an analogue input is in another unit.
    """
    objects = ObjectStore(eds, 1)
    profile = objects.get(0x1000) & 0xFFFF
    try:
        if profile == _ANALOGUE:
            if (told := objects.get(0x6131, 1)) != unit:
                raise EdsError(f"EDS tells {told:08X} as unit of its inputs (object 6131); it must be {unit:08X}")
            return 10.0 ** objects.get(0x6132, 1)
        if profile == _ENCODER:
            return 1.0 / (objects.get(0x6005, 1) * _NANOMETRE)
        if profile == _INCLINOMETER:
            return 1.0 / (objects.get(0x6000) * _MILLIDEGREE)
    except KeyError as error:
        raise EdsError(f"EDS does not tell what one count is: {error.args[0]}") from None
    raise EdsError(f"EDS of profile {profile} tells no position, acceleration or tilt")
