"""A recording as the tables other tools read: CSV, Parquet, MATLAB. Every signal, units in the columns' names."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from recordings.errors import RecordingError
from recordings.export_formats import WRITERS
from recordings.schema import CYCLE_TOPICS, CYCLE_UNITS

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from recordings.run import Run, Series

CYCLES = "cycles"
"""The main table: one row a cycle. It takes the file's own name, the others get theirs added."""
_HOST_TEXT = "host's wall clock when the sample arrived, since 1970 (UTC)"


class Column(NamedTuple):
    """A column: its name ends with its unit; `unit` as text, "1" for counts; `text` says what it is."""

    name: str
    values: NDArray[Any]
    unit: str
    text: str


@dataclass(frozen=True)
class Table:
    """Columns of one length."""

    name: str
    columns: tuple[Column, ...]


def export(run: Run, path: Path, kind: str) -> list[Path]:
    """Write a recording for other tools and return the files made.

    Parameters
    ----------
    run : Run
    path : Path
        The main file. CSV and Parquet put every further table (events, gaps, forecast, ...) beside it, as
        NAME.events.csv; what the recording says of itself is in NAME.about.json, and in the metadata of each Parquet
        file. MATLAB has all in one.
    kind : {"csv", "parquet", "mat"}

    Raises
    ------
    RecordingError
        A file is there already or cannot be written, or the recording is too large for the format.
    """
    write = WRITERS[kind]
    tables = tables_of(run)
    files = write.files(path, [table.name for table in tables if table.name != CYCLES])
    for file in files:
        if file.exists():
            raise RecordingError(f"{file} exists already and is not overwritten")
    made: list[Path] = []
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write.write(tables, about(run, tables), files)
        made = files
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
    finally:
        if not made:
            for file in files:
                file.unlink(missing_ok=True)
    return made


def tables_of(run: Run) -> list[Table]:
    """Return all tables of a recording that have rows, the cycles first, which are always there."""
    tables = [_cycles(run)]
    tables += [_series(series, _origin(run.metadata)) for series in run.series.values()]
    if run.events:
        tables.append(_events(run))
    if run.missed:
        tables.append(_missed(run))
    return tables


def about(run: Run, tables: Sequence[Table]) -> str:
    """Return what the recording says of itself, as JSON: metadata, problems, and each column's unit and meaning."""
    columns = {
        table.name: {column.name: {"unit": column.unit, "text": column.text} for column in table.columns}
        for table in tables
    }
    return json.dumps(
        {
            "file": run.path.name,
            "complete": run.complete,
            "problems": list(run.problems),
            "columns": columns,
            "metadata": {name: dict(values) for name, values in run.metadata.items()},
        },
        indent=1,
        ensure_ascii=False,
    )


def with_unit(name: str, unit: str) -> str:
    """Return a column's name with its unit at the end.

    >>> with_unit("acceleration", "m/s2"), with_unit("host_time_ns", "ns"), with_unit("cycle", "1")
    ('acceleration_m_s2', 'host_time_ns', 'cycle')
    """
    ending = "" if unit == "1" else "_" + unit.replace("/", "_")
    return name if name.endswith(ending) else name + ending


def _cycles(run: Run) -> Table:
    texts = {field.source: field.text for topic in CYCLE_TOPICS for field in topic.fields}
    texts["host_time_ns"] = _HOST_TEXT
    columns = [
        Column(with_unit(name, unit), getattr(run.cycles, name), unit, texts[name])
        for name, unit in CYCLE_UNITS.items()
    ]
    # Time first, as every plotting program expects.
    return Table(CYCLES, tuple(sorted(columns, key=lambda column: (column.name != "time_s", column.name != "cycle"))))


def _series(series: Series, origin: int) -> Table:
    time = (series.table_time_ns - origin) * 1e-9
    columns = [
        Column("time_s", time, "s", "table's clock, rounded to 1 ns"),
        Column("host_time_ns", series.host_time_ns, "ns", _HOST_TEXT),
    ]
    for field in series.topic.fields:
        values = series.columns[field.name]
        if field.choices is not None:
            names = np.array([*field.choices.names, "unknown code"], dtype=np.str_)
            values = names[np.minimum(values, len(field.choices.names))]
        columns.append(Column(field.name, values, field.unit, field.text))
    return Table(series.topic.name.strip("/").replace("/", "_"), tuple(columns))


def _events(run: Run) -> Table:
    columns = (
        Column("time_s", np.array([event.time for event in run.events]), "s", "table's clock"),
        Column(
            "host_time_ns", np.array([event.host_time_ns for event in run.events], dtype=np.int64), "ns", _HOST_TEXT
        ),
        Column("level", np.array([event.level for event in run.events]), "1", "info, warning or error"),
        Column("name", np.array([event.name for event in run.events]), "1", "what happened, in short"),
        Column("message", np.array([event.message for event in run.events]), "1", "what happened"),
    )
    return Table("events", columns)


def _missed(run: Run) -> Table:
    columns = (
        Column("first", np.array([gap.first for gap in run.missed], dtype=np.uint64), "1", "first missed cycle number"),
        Column("last", np.array([gap.last for gap in run.missed], dtype=np.uint64), "1", "last missed cycle number"),
        Column("host_time_ns", np.array([gap.host_time_ns for gap in run.missed], dtype=np.int64), "ns", _HOST_TEXT),
    )
    return Table("missed", columns)


def _origin(metadata: Mapping[str, Mapping[str, str]]) -> int:
    text = metadata.get("clock", {}).get("origin_ns", "0")
    return int(text) if text.isdecimal() else 0
