"""A finished map as NPZ and as CSV, streamed: neither is ever in memory as a whole."""

from __future__ import annotations

import csv
import json
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib.format import write_array, write_array_header_1_0

from twin.errors import InputError
from twin.map.blocks import OUTCOMES
from twin.map.grid import axes_of
from twin.map.store import MapStore, asked

# The same map gives the same bytes, whenever it is written.
_NO_DATE = (1980, 1, 1, 0, 0, 0)
HEADS = {
    "amplitudes": "amplitude",
    "frequencies": "frequency",
    "durations": "duration_s",
    "peak_velocities": "peak_velocity_m_s",
    "stop_gaps": "stop_gap_m",
    "overturning_time": "overturning_time_s",
    "peak_rotation": "peak_rotation_rad",
}
"""Heads of a CSV's columns, where they are not the layer's name."""
NAMES = tuple("impossible" if outcome is None else outcome.value for outcome in OUTCOMES)


def export(store: MapStore, path: Path) -> None:
    """Write the finished map where `path` says and as its ending says (.npz or .csv).

    The NPZ holds `outcome` (indices of `outcomes`), `impacts`, `direction` and what else was asked, all of the shape
    (rows, columns), the two axes under their names, and `question` as JSON. `numpy.load` reads it without pickles.

    Raises
    ------
    InputError
        Where the ending is unknown or the file cannot be written.
    """
    write = {".npz": _npz, ".csv": _csv}.get(path.suffix.lower())
    if write is None:
        raise InputError(f"--out {path}: a map ends in .npz or .csv")
    beside = path.with_name(path.name + ".tmp")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write(store, beside)
        beside.replace(path)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _npz(store: MapStore, path: Path) -> None:
    grid = store.question.grid
    rows, columns = axes_of(grid.kind)
    small = {
        rows: grid.rows,
        columns: grid.columns,
        "outcomes": np.array(NAMES),
        "question": np.array(json.dumps(asked(store.question))),
    }
    with zipfile.ZipFile(path, "w", allowZip64=True) as archive:
        for name, place in store.layers.items():
            with archive.open(_member(name), "w", force_zip64=True) as member:
                head = {"descr": place.dtype.str, "fortran_order": False, "shape": grid.shape}
                write_array_header_1_0(member, head)
                for numbers in store.chunks(name):
                    member.write(numbers.tobytes())
        for name, values in small.items():
            with archive.open(_member(name), "w") as member:
                write_array(member, values, allow_pickle=False)


def _member(name: str) -> zipfile.ZipInfo:
    member = zipfile.ZipInfo(f"{name}.npy", _NO_DATE)
    member.compress_type = zipfile.ZIP_DEFLATED
    return member


def _csv(store: MapStore, path: Path) -> None:
    """Write one line a cell; numbers with every digit they have, nothing where there is no number."""
    grid = store.question.grid
    names = list(store.layers)
    with path.open("w", encoding="utf-8", newline="") as file:
        table = csv.writer(file, lineterminator="\n")
        table.writerow([HEADS.get(name, name) for name in (*axes_of(grid.kind), *names)])
        cell = 0
        for parts in zip(*(store.chunks(name) for name in names), strict=True):
            layers: list[list[Any]] = [part.tolist() for part in parts]
            for values in zip(*layers, strict=True):
                row, column = divmod(cell, len(grid.columns))
                numbers = ["" if math.isnan(value) else value for value in values[1:]]
                table.writerow([float(grid.rows[row]), float(grid.columns[column]), NAMES[values[0]], *numbers])
                cell += 1
