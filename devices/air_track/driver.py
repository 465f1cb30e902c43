"""The air track on any CAN bus: a release device (CiA 401) and its sensors (CiA 404 and 406)."""

from __future__ import annotations

from functools import partial

from devices.air_track.capacity import CAPACITY
from devices.released_driver import open_released

open_table = partial(open_released, capacity=CAPACITY, air=True)
"""Connect to an air track; see `devices.released_driver.open_released`."""
