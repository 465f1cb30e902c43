"""What ROORI1 can do; the numbers and where they come from are in capacity.toml beside this file."""

from __future__ import annotations

from importlib.resources import files

from devices.capacity_file import load_capacity
from devices.roori1.settings import Roori1Machine

MACHINE = Roori1Machine
"""What the table `[machine]` of a capacity file is read as."""
CAPACITY = load_capacity(files("devices.roori1").joinpath("capacity.toml").read_text(encoding="utf-8"), MACHINE)
"""Double pulses of 0.076 to 0.617 m/s over gaps of 2.5 to 35 mm, as published; shapes and times are assumptions."""
