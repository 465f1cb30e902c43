"""Which column is what: `time=t[ms] displacement=x[mm] rotation=phi[deg]`."""

from __future__ import annotations

import math
import re
import shlex
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from recordings.errors import RecordingError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.import_table import TextTable

UNITS: dict[str, dict[str, float]] = {
    "time": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "min": 60.0},
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "in": 0.0254},
    "acceleration": {
        "m/s2": 1.0,
        "m/s²": 1.0,
        "m/s^2": 1.0,
        "cm/s2": 1e-2,
        "gal": 1e-2,
        "mm/s2": 1e-3,
        "g": math.nan,
    },
    "angle": {"rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
}
"""Units by what they measure, with their size in SI; g is the scene's."""
QUANTITIES = {"time": "time", "displacement": "length", "acceleration": "acceleration", "rotation": "angle"}
"""What a column can be, beside the coordinates of points."""
RATE = "rate"
"""`rate=500[Hz]` stands for a time column."""
MOVING = {"x": ("x", "x"), "z": ("z", "z"), "dx": ("x", "dx"), "dz": ("z", "dz")}
"""Columns of a point: coordinates, or displacements from `x0` and `z0`."""
FIXED = ("x0", "z0")
BASE = "base"
"""A point whose name begins so is on the table."""

_ENTRY = re.compile(r"([A-Za-z0-9_]+(?:\.[A-Za-z0-9]+)?)=(.*)\[([^\[\]]+)\]", re.DOTALL)
_UNIT_IN_HEAD = re.compile(r"(.*?)\s*[\[(]\s*([^\[\]()]*?)\s*[\])]", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Entry:
    """One entry: what it is (`time`, or `p1.x`), the column's name (or a number), and the unit."""

    what: str
    column: str
    unit: str


def parse_map(texts: list[str]) -> dict[str, Entry]:
    """Return the entries of a column map, by what they are.

    Entries are separated by spaces; a column's name with spaces stands in quotes, as in ``time="Stage time"[s]``.
    Columns may be given by their place, ``#1`` the first.

    Raises
    ------
    RecordingError
        One sentence: an entry that cannot be read, twice the same, an unknown quantity or unit.

    >>> parse_map(['time=t[ms] rotation="phi 1"[deg]'])["rotation"]
    Entry(what='rotation', column='phi 1', unit='deg')
    """
    found: dict[str, Entry] = {}
    for text in texts:
        try:
            words = shlex.split(text)
        except ValueError as error:
            raise RecordingError(f"--map {text!r} cannot be read: {str(error).lower()}") from None
        for word in words:
            match = _ENTRY.fullmatch(word)
            if match is None:
                raise RecordingError(f"--map: {word!r} is not WHAT=COLUMN[UNIT], as in time=t[ms]")
            entry = Entry(match[1], match[2].strip(), match[3].strip())
            kind = _kind(entry.what)
            if entry.unit not in UNITS[kind]:
                known = ", ".join(UNITS[kind])
                raise RecordingError(f"--map: {entry.what} is in {entry.unit!r}; known units of {kind} are {known}")
            if entry.what in found:
                raise RecordingError(f"--map: {entry.what} is given twice")
            found[entry.what] = entry
    if ("time" in found) == (RATE in found):
        raise RecordingError("--map: give time=COLUMN[UNIT], or rate=NUMBER[Hz] where there is no time column")
    return found


def points_of(entries: dict[str, Entry]) -> dict[str, dict[str, Entry]]:
    """Return the points of a map: name -> its entries by axis; raises RecordingError where one is not whole."""
    points: dict[str, dict[str, Entry]] = {}
    for what, entry in entries.items():
        name, dot, axis = what.partition(".")
        if dot:
            points.setdefault(name, {})[axis] = entry
    for name, axes in points.items():
        whole = ({"x", "z"}, {"dx", "dz", "x0", "z0"})
        if set(axes) not in whole and not (name.startswith(BASE) and set(axes) in ({"x"}, {"dx"})):
            raise RecordingError(
                f"--map: point {name} has {', '.join(sorted(axes))}; a point wants x and z, or dx, dz, x0 and z0"
            )
    return points


def column_of(entry: Entry, table: TextTable, name: str, gravity: float) -> NDArray[np.float64]:
    """Return an entry's column in SI; raises RecordingError where the table has none, or two, or another unit."""
    place = _place(entry, table, name)
    for head in table.names[place]:
        stated = _UNIT_IN_HEAD.fullmatch(head)
        if stated and stated[2] in UNITS[_kind(entry.what)] and _size(entry, stated[2]) != _size(entry, entry.unit):
            raise RecordingError(f"--map: {entry.what} is in {entry.unit}, but {name} calls its column {head!r}")
    return table.values[:, place] * factor(entry, gravity)


def number_of(entry: Entry) -> float:
    """Return a number given in the map itself, in SI; raises RecordingError."""
    try:
        value = float(entry.column)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise RecordingError(f"--map: {entry.what} is {entry.column!r}; it must be a number")
    return value * UNITS[_kind(entry.what)][entry.unit]


def factor(entry: Entry, gravity: float) -> float:
    """Return the size of an entry's unit in SI; `gravity` is 1 g, m/s2."""
    return gravity if entry.unit == "g" else UNITS[_kind(entry.what)][entry.unit]


def _size(entry: Entry, unit: str) -> float:
    size = UNITS[_kind(entry.what)][unit]
    return -1.0 if math.isnan(size) else size


def _kind(what: str) -> str:
    name, dot, axis = what.partition(".")
    if what == RATE:
        return "frequency"
    if not dot and name in QUANTITIES:
        return QUANTITIES[name]
    if dot and (axis in MOVING or axis in FIXED):
        return "length"
    known = f"{', '.join(QUANTITIES)}, {RATE}, and for points NAME.x, NAME.z, NAME.dx, NAME.dz, NAME.x0, NAME.z0"
    raise RecordingError(f"--map: there is no {what!r}; known are {known}")


def _place(entry: Entry, table: TextTable, name: str) -> int:
    width = len(table.names)
    if entry.column.startswith("#") and entry.column[1:].isdecimal():
        place = int(entry.column[1:6])
        if not 1 <= place <= width:
            raise RecordingError(f"--map: {entry.what} is column {entry.column}; {name} has {width}")
        return place - 1
    wanted = entry.column.casefold()
    for same in (_exactly, _without_unit):
        found = [k for k, heads in enumerate(table.names) if any(same(head).casefold() == wanted for head in heads)]
        if len(found) == 1:
            return found[0]
        if found:
            raise RecordingError(
                f"--map: {name} has {len(found)} columns named {entry.column!r}: give its place, as #2"
            )
    shown = ", ".join(repr(heads[0]) for heads in table.names[:12] if heads) or "no names"
    more = ", ..." if width > 12 else ""
    raise RecordingError(f"--map: {name} has no column {entry.column!r}; it has {width}: {shown}{more}")


def _exactly(head: str) -> str:
    return head.strip()


def _without_unit(head: str) -> str:
    found = _UNIT_IN_HEAD.fullmatch(head)
    return (found[1] if found else head).strip()
