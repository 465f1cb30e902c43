"""How tables are written: CSV and Parquet by pyarrow, MATLAB's level 5 by scipy."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np

from recordings.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from recordings.export import Table

ABOUT_KEY = b"shake_table_twin"
"""Key of the Parquet files' metadata under which the JSON about the recording is."""
LARGEST_MAT = 2**31 - 1
"""Bytes of one variable in a MATLAB level 5 file."""


class Writer(NamedTuple):
    """One format: which files it makes of a path and further tables, and how it writes them."""

    files: Callable[[Path, Sequence[str]], list[Path]]
    write: Callable[[Sequence[Table], str, Sequence[Path]], None]


def _beside(path: Path, names: Sequence[str]) -> list[Path]:
    """Return the main file, and one for each further table."""
    return [path, *(path.with_name(f"{path.stem}.{name}{path.suffix}") for name in names)]


def _with_about(path: Path, names: Sequence[str]) -> list[Path]:
    """Return the same, and a file about the recording: a CSV cannot hold it."""
    return [*_beside(path, names), path.with_name(f"{path.stem}.about.json")]


def _alone(path: Path, names: Sequence[str]) -> list[Path]:  # noqa: ARG001 - the same call for every format
    return [path]


def _csv(tables: Sequence[Table], about: str, files: Sequence[Path]) -> None:
    """Write numbers with every digit they have, and nothing where there is no number."""
    from pyarrow import csv  # pyright: ignore[reportMissingTypeStubs]

    for table, file in zip(tables, files[:-1], strict=True):
        cast("Any", csv).write_csv(_arrow(table, about=None), file)
    files[-1].write_text(about, encoding="utf-8")


def _parquet(tables: Sequence[Table], about: str, files: Sequence[Path]) -> None:
    """Write columns with unit and meaning as metadata of the fields, and what is about the recording as the file's."""
    from pyarrow import parquet  # pyright: ignore[reportMissingTypeStubs]

    for table, file in zip(tables, files, strict=True):
        cast("Any", parquet).write_table(_arrow(table, about=about), file, compression="zstd")


def _arrow(table: Table, *, about: str | None) -> Any:
    import pyarrow  # pyright: ignore[reportMissingTypeStubs]

    arrow = cast("Any", pyarrow)
    arrays = [
        # In text a number that is none is an empty field.
        arrow.array(column.values, from_pandas=about is None and column.values.dtype.kind == "f")
        for column in table.columns
    ]
    fields = [
        arrow.field(column.name, array.type, metadata={"unit": column.unit, "text": column.text})
        for column, array in zip(table.columns, arrays, strict=True)
    ]
    metadata = None if about is None else {ABOUT_KEY: about.encode()}
    return arrow.Table.from_arrays(arrays, schema=arrow.schema(fields, metadata=metadata))


def _mat(tables: Sequence[Table], about: str, files: Sequence[Path]) -> None:
    """Write a struct for each table, `units` with the same fields, and `about` as JSON (`jsondecode(about)`)."""
    import scipy.io  # pyright: ignore[reportMissingTypeStubs]

    content: dict[str, Any] = {"about": about, "units": {}}
    for table in tables:
        columns = {column.name: _matlab(column.values) for column in table.columns}
        size = sum(column.values.nbytes for column in table.columns)
        if size > LARGEST_MAT:
            raise RecordingError(
                f"{files[0]} is not written: {table.name} has {size / 2**30:.1f} GiB; a .mat file takes 2 GiB, "
                "Parquet has no such limit"
            )
        content[table.name] = columns
        content["units"][table.name] = {column.name: column.unit for column in table.columns}
    with files[0].open("wb") as file:
        cast("Any", scipy.io).savemat(file, content, long_field_names=True, do_compression=True, oned_as="column")


def _matlab(values: np.ndarray) -> np.ndarray:
    """Return texts as a cell array: MATLAB's character arrays would pad them to one length."""
    return values.astype(np.object_) if values.dtype.kind == "U" else values


WRITERS = {"csv": Writer(_with_about, _csv), "parquet": Writer(_beside, _parquet), "mat": Writer(_alone, _mat)}
"""The formats, by name and ending."""
