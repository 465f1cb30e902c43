"""An inclinometer on the block: the tilt at rest, and at rest only.

It has no horizon; it feels the specific force, true acceleration less gravity's, and calls its direction the vertical.
On a base that accelerates with a, and fixed at the corner about which the block turns, that is

    reading = theta - atan2(a, g)

and anywhere else on a rocking block the accelerations of the rocking itself are added. At 0.26 g it is off by 0.25 rad,
more than the slenderness of block B6L: good for levelling before a run, useless during one.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.sensors.measuring import INCLINOMETER, MeasuringDevice

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.node import Send


def apparent_tilt(rotation: float, base_acceleration: float, gravity: float = 9.81) -> float:
    """Return what an inclinometer at the block's corner calls its tilt, rad.

    Parameters
    ----------
    rotation : float
        True tilt theta, rad.
    base_acceleration, gravity : float
        a and g, m/s2.

    Examples
    --------
    >>> round(apparent_tilt(0.0, 0.26 * 9.81), 4)
    -0.2544
    """
    return rotation - math.atan2(base_acceleration, gravity)


def inclinometer_on(
    identifier: int, send: Send, rotation: Callable[[], float], base_acceleration: Callable[[], float]
) -> MeasuringDevice:
    """Return the node of an inclinometer on the block (CiA 410)."""
    return MeasuringDevice(identifier, send, INCLINOMETER, lambda: (apparent_tilt(rotation(), base_acceleration()),))
