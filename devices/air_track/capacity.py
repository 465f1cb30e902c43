"""What the air track can do; the numbers and where they come from are in capacity.toml beside this file."""

from __future__ import annotations

from importlib.resources import files

from devices.air_track.settings import AirTrackMachine
from devices.capacity_file import load_capacity

MACHINE = AirTrackMachine
"""What the table `[machine]` of a capacity file is read as."""
CAPACITY = load_capacity(files("devices.air_track").joinpath("capacity.toml").read_text(encoding="utf-8"), MACHINE)
"""Placeholder numbers: 2 m, 1 m/s, 0.6 g, constant pulses of one sign."""
