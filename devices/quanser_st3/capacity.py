"""What the ST-III can do; the numbers and where they come from are in capacity.toml beside this file."""

from __future__ import annotations

from importlib.resources import files

from devices.capacity_file import load_capacity

CAPACITY = load_capacity(files("devices.quanser_st3").joinpath("capacity.toml").read_text(encoding="utf-8"))
"""Placeholder numbers: 0.216 m of stroke, 0.664 m/s, 9.81 m/s2 with 100 kg, 10 Hz."""
