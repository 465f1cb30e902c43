"""What is said of the emulated table: numbers of the user's own, and what they do not allow."""

from __future__ import annotations

from devices.own_table import OwnNumbers
from excitation import Capacity
from twin.scene import Scene

_HEAD = "emulator   "


def emulator_lines(numbers: OwnNumbers | None, scene: Scene, capacity: Capacity) -> list[str]:
    """Return the numbers that are not the device's own with their sources, and what falls short of the capacity."""
    if numbers is None:
        return []
    rows = numbers.described()
    own = [key for key, (attribute, _) in numbers.keys.items() if attribute in numbers.own]
    lines = [f"{_HEAD}{key} = {rows[key][0]:.6g} [{rows[key][1]}]" for key in own]
    # A sentence of its own each: nothing is clipped for it, the table will simply not do it.
    return lines + [f"WARNING    {note}" for note in numbers.notes(capacity, scene.block.mass_kg or 0.0)]


def emulator_data(numbers: OwnNumbers | None) -> dict[str, str]:
    """Return every number with its source, for the recording."""
    return (
        {} if numbers is None else {key: f"{value} [{source}]" for key, (value, source) in numbers.described().items()}
    )
