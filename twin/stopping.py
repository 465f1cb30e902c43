"""How gently a table stops when a run is broken off, so that the stop does not topple what stands on it."""

from __future__ import annotations

import math

from excitation import Capacity
from twin.scene import Scene

STOPPING_SHARE = 0.5
"""A stop stays under this share of g tan(alpha), so that it cannot rock a block that stands still."""


def stop_deceleration(scene: Scene, capacity: Capacity | None) -> float:
    """Return the deceleration of a quick stop, m/s2: half of g tan(alpha), or the table's acceleration where less.

    A drive takes a steeper one by itself where the stroke left is too short for it. It is object
    6085 of the drive, which the host writes as it opens the table; an emulated drive is given it from the start.

    Examples
    --------
    >>> from twin.scene import load_scene
    >>> from devices.quanser_st3.capacity import CAPACITY
    >>> round(stop_deceleration(load_scene("b6l_sine"), CAPACITY), 6)
    1.09
    """
    gentle = STOPPING_SHARE * scene.block.block().uplift_acceleration
    return gentle if capacity is None else min(gentle, capacity.acceleration)


def longest_stop(scene: Scene, capacity: Capacity) -> float:
    """Return the time no quick stop of the emulated drive exceeds, s: from the speed that takes the whole stroke.

    A released machine is waited for until friction and end stop have stopped it.
    """
    if capacity.machine is not None:
        return capacity.machine.longest_stop(capacity.velocity, capacity.stroke)
    return math.sqrt(2.0 * capacity.stroke / stop_deceleration(scene, capacity))
