"""An overturning map written by `twin map`, as a picture, with the place of a recorded run on it."""

from __future__ import annotations

import json
import math
import zipfile
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import numpy as np
from numpy.lib.format import read_array, read_array_header_1_0, read_magic

from recordings.errors import RecordingError
from twin.map.grid import CONSTANT, COSINE, DOUBLE_PULSE, LASTING_SINE, SINE, axes_of
from twin.map.picture import COLOURS
from twin.rocking.block import Block

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

MOST_CELLS = 10_000_000
MOST_PIXELS = 600
"""Rows and columns of the picture; a finer map is thinned."""
COLOUR_NAMES = dict(
    zip(COLOURS, ("cream", "light blue", "dark red", "red", "orange", "yellow", "black", "white"), strict=True)
)
"""What people call the colours of a map."""
_NAMES = {
    "amplitudes": "a0 / (g tan alpha)",
    "frequencies": "omega / p",
    "durations": "duration [s]",
    "peak_velocities": "peak velocity [m/s]",
    "stop_gaps": "stop gap [m]",
}


@dataclass(frozen=True, eq=False)
class MapPicture:
    """What a map shows.

    Attributes
    ----------
    pixels : ndarray of uint8, shape (rows, columns, 3)
        Row 0 is the least.
    columns, rows : ndarray
        Their values.
    column_name, row_name : str
        What they are, with the unit.
    present : list of str
        What is on it, of `twin.map.picture.COLOURS`.
    point : (float, float) or None
        Column and row of the run, in pixels, not whole ones; None where it lies outside.
    point_text : str
        The run's own values.
    """

    pixels: NDArray[np.uint8]
    columns: NDArray[np.float64]
    rows: NDArray[np.float64]
    column_name: str
    row_name: str
    present: list[str]
    point: tuple[float, float] | None
    point_text: str

    @property
    def name(self) -> str:
        """What a window calls it."""
        place = "" if self.point is not None else " (this run lies outside)"
        return f"{self.row_name} over {self.column_name}{place}"

    @property
    def legend_text(self) -> str:
        """What the colours mean, and where the run is, as Markdown."""
        lines = [f"# {self.name}", "", "| colour | the block |", "|---|---|"]
        lines += [f"| {COLOUR_NAMES[outcome]} | {outcome} |" for outcome in self.present]
        return "\n".join(
            [*lines, "", f"This run: {self.row_name} {self.point_text.replace(', ', f', {self.column_name} ')}"]
        )

    def column_text(self, share: float) -> str:
        """Return the value at that share of the width."""
        return f"{float(self.columns[round(share * (self.columns.size - 1))]):.3g}"

    def row_text(self, share: float) -> str:
        """Return the value at that share of the height."""
        return f"{float(self.rows[round(share * (self.rows.size - 1))]):.3g}"


def map_with_run(path: Path, metadata: Mapping[str, Mapping[str, str]], gravity: float) -> MapPicture:
    """Read a map and find the run's place on it.

    Parameters
    ----------
    path : Path
        NPZ of `twin map --out`; nothing in it is unpickled.
    metadata : mapping
        The recording's: the excitation given, the block's size.
    gravity : float
        m/s2.

    Raises
    ------
    RecordingError
        One sentence: the file is no map, too large, or of another kind of pulse than the run's.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            arrays = {name.removesuffix(".npy"): _array(archive, name) for name in _wanted(archive)}
        question = cast("dict[str, Any]", json.loads(str(arrays["question"])))
        kind = str(question["kind"])
        row_key, column_key = axes_of(kind)
        rows, columns = arrays[row_key].astype(np.float64), arrays[column_key].astype(np.float64)
        pixels, present = _pixels(arrays)
        if pixels.shape[:2] != (rows.size, columns.size):
            raise ValueError(f"{pixels.shape[:2]} cells for {rows.size} rows and {columns.size} columns")
        block = Block(question["block"]["width_m"], question["block"]["height_m"], gravity=gravity)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {(error.strerror or str(error)).lower()}") from None
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, EOFError, IndexError) as error:
        raise RecordingError(f"{path} is no map of `twin map`: {' '.join(str(error).split())[:120]}") from None
    every = [slice(None, None, -(-count // MOST_PIXELS)) for count in (rows.size, columns.size)]
    values = _run_values(kind, metadata, block, path)
    thin_rows, thin_columns = rows[every[0]], columns[every[1]]
    place = (_place(thin_columns, values[1]), _place(thin_rows, values[0]))
    return MapPicture(
        pixels[every[0], every[1]],
        thin_columns,
        thin_rows,
        _NAMES[column_key],
        _NAMES[row_key],
        present,
        None if any(map(math.isnan, place)) else place,
        f"{values[0]:.3g}, {values[1]:.3g}",
    )


def _wanted(archive: zipfile.ZipFile) -> list[str]:
    known = {"outcome", "impacts", "outcomes", "question", *_NAMES}
    return [name for name in archive.namelist() if name.removesuffix(".npy") in known]


def _array(archive: zipfile.ZipFile, name: str) -> NDArray[Any]:
    """Return an array of an NPZ, once its header has said that it is no larger than a map may be."""
    with archive.open(name) as member:
        if read_magic(member) != (1, 0):
            raise ValueError(f"{name} is of another version")
        shape, _, kind = read_array_header_1_0(member)
        if kind.hasobject or kind.itemsize > 1_000_000 or math.prod(shape) > MOST_CELLS:
            raise ValueError(f"{name} is too large, or no array of numbers")
    with archive.open(name) as member:
        return read_array(member, allow_pickle=False)


def _pixels(arrays: dict[str, NDArray[Any]]) -> tuple[NDArray[np.uint8], list[str]]:
    names = [str(name) for name in arrays["outcomes"]]
    codes, impacts = arrays["outcome"], arrays["impacts"].astype(np.int64)
    found = np.full(codes.shape, len(COLOURS) - 1, dtype=np.int64)
    known = list(COLOURS)
    for code, name in enumerate(names):
        if name == "overturned":
            fallen = known.index("overturned without impact") + np.minimum(impacts, 3)
            found = np.where(codes == code, fallen, found)
        elif name in known:
            found = np.where(codes == code, known.index(name), found)
    colours = np.array([_colour(text) for text in COLOURS.values()], dtype=np.uint8)
    return colours[found], [known[k] for k in np.unique(found)]


def _colour(text: str) -> tuple[int, int, int]:
    return int(text[1:3], 16), int(text[3:5], 16), int(text[5:7], 16)


def _run_values(kind: str, metadata: Mapping[str, Mapping[str, str]], block: Block, path: Path) -> tuple[float, float]:
    """Return (row value, column value) of the run's pulse; raises RecordingError where it is of another kind."""
    try:
        given = cast("dict[str, Any] | None", json.loads(metadata["excitation"]["given"]))
    except (KeyError, ValueError):
        raise RecordingError("the recording does not say which pulse was given: it has no place on a map") from None
    parameters: dict[str, float] = {} if given is None else given["parameters"]
    is_of = None if given is None else given["type"]
    lift, p = block.uplift_acceleration, block.frequency_parameter
    kinds = {SINE: "SineWave", LASTING_SINE: "SineWave", COSINE: "CosineWave", CONSTANT: "ConstantPulse"}
    try:
        if is_of == kinds.get(kind) and kind != CONSTANT:
            return abs(parameters["amplitude"]) / lift, 2.0 * math.pi * parameters["frequency"] / p
        if is_of == kinds.get(kind):
            return abs(parameters["amplitude"]) / lift, parameters["duration"]
        if is_of == "DoublePulse" and kind == DOUBLE_PULSE:
            return abs(parameters["peak_velocity"]), parameters["stop_gap"]
    except (KeyError, TypeError):
        raise RecordingError("the recording's pulse lacks its parameters: it has no place on a map") from None
    name = "nothing" if given is None else given.get("kind", is_of)
    raise RecordingError(f"{path} is a map of {kind} pulses; the run was shaken by {name}")


def _place(values: NDArray[np.float64], value: float) -> float:
    """Return where `value` lies among rising values, in steps; NaN outside by more than half a step."""
    if values.size < 2:
        return 0.0
    place = float(np.interp(value, values, np.arange(values.size), left=np.nan, right=np.nan))
    if math.isnan(place):
        low, high = values[0] - 0.5 * (values[1] - values[0]), values[-1] + 0.5 * (values[-1] - values[-2])
        if low <= value <= high:
            return 0.0 if value < values[0] else values.size - 1.0
    return place
