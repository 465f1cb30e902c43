"""ROORI1 on any CAN bus: a release device (CiA 401) and its sensors (CiA 404 and 406)."""

from __future__ import annotations

from functools import partial

from devices.released_driver import open_released
from devices.roori1.capacity import CAPACITY

open_table = partial(open_released, capacity=CAPACITY, air=False)
"""Connect to ROORI1; see `devices.released_driver.open_released`."""
