"""Axes of a map as the command line spells them: START:STOP:COUNT, with a unit at the end or none."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray

MOST_CELLS = 10**9


def read_axis(flag: str, text: str, units: Mapping[str, float]) -> FloatArray:
    """Return the values of an axis, evenly spaced, in the unit of factor 1.

    Parameters
    ----------
    flag : str
        What the axis is called, for the message.
    text : str
        START:STOP:COUNT, or one number; a unit may follow, as in 0.1:1:50g.
    units : mapping
        Unit -> factor by which its numbers are multiplied; "" is none.

    Raises
    ------
    InputError
        One sentence.

    Examples
    --------
    >>> read_axis("--gap", "5:20:4mm", {"": 1.0, "mm": 0.001})
    array([0.005, 0.01 , 0.015, 0.02 ])
    """
    unit = max((unit for unit in units if text.endswith(unit)), key=len)
    parts = text.removesuffix(unit).split(":")
    known = ", ".join(repr(name) for name in units if name) or "none"
    try:
        numbers = [float(part) for part in parts]
        count = int(parts[2]) if len(parts) == 3 else 1
    except ValueError:
        numbers, count = [], 0
    if len(numbers) not in (1, 3) or not all(math.isfinite(number) for number in numbers):
        raise InputError(f"{flag} is {text!r}; give START:STOP:COUNT or one number, units: {known}")
    if not 1 <= count <= MOST_CELLS:
        raise InputError(f"{flag} asks {count} values; it can have 1 to {MOST_CELLS}")
    first, last = numbers[0], numbers[1] if len(numbers) == 3 else numbers[0]
    return units[unit] * np.linspace(first, last, count)


def amplitude_units(block: Block) -> dict[str, float]:
    """Return the units of an amplitude, in g tan(alpha): none, g, m/s2."""
    lift = block.uplift_acceleration
    return {"": 1.0, "g": block.gravity / lift, "m/s2": 1.0 / lift}


def frequency_units(block: Block) -> dict[str, float]:
    """Return the units of a frequency, in p: none, Hz, rad/s."""
    p = block.frequency_parameter
    return {"": 1.0, "Hz": 2.0 * math.pi / p, "rad/s": 1.0 / p}


def length_units(block: Block) -> dict[str, float]:
    """Return the units of a constant pulse's length, in s: none (in 1/p), s, ms."""
    return {"": 1.0 / block.frequency_parameter, "s": 1.0, "ms": 1e-3}


VELOCITY_UNITS = {"": 1.0, "m/s": 1.0, "mm/s": 1e-3}
GAP_UNITS = {"": 1.0, "m": 1.0, "mm": 1e-3}
