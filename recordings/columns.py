"""Messages of the topics of ours as columns: one array for each field, whatever the layout in the file."""

from __future__ import annotations

import math
from functools import reduce
from typing import TYPE_CHECKING, Any

import numpy as np

from recordings.descriptors import parse_fields, recorded_fields
from recordings.records import at_every_byte
from recordings.topic import LARGEST_CODE, columns, keys

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.records import Messages
    from recordings.topic import Topic

STAMPS = [("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]
"""What stands before the payload of a message, after its channel."""
_CHANNEL_LENGTH = 2
_LEAST_ROOM = 1024
_STAMPS = np.dtype(STAMPS)

Table = dict[str, "NDArray[Any]"]
"""Columns of one length: the stamps, and the fields by their names in the file."""


class _Growing:
    """A one-dimensional array that grows in place: a list of blocks, joined at the end, would need the room twice."""

    def __init__(self, code: str) -> None:
        self._array = np.zeros(0, dtype=code)
        self._size = 0

    def append(self, values: NDArray[Any]) -> None:
        end = self._size + values.size
        if end > self._array.size:
            self._array.resize(end + end // 4 + _LEAST_ROOM, refcheck=False)
        self._array[self._size : end] = values
        self._size = end

    def take(self) -> NDArray[Any]:
        taken, self._array = self._array, np.zeros(0, dtype=self._array.dtype)
        taken.resize(self._size, refcheck=False)
        self._size = 0
        return taken


class Column:
    """The messages of one topic as columns.

    Parameters
    ----------
    topic : Topic
    stamps : tuple of str
        Which of `STAMPS` are kept beside the fields.

    Attributes
    ----------
    undecoded : int
        Messages that are none of this topic.
    """

    def __init__(self, topic: Topic, stamps: tuple[str, ...] = tuple(name for name, _ in STAMPS)) -> None:
        self.topic = topic
        self.stamps = stamps
        self.undecoded = 0
        codes = {name: code for name, code in STAMPS if name in stamps}
        codes |= {field.name: field.numpy_code for field in topic.fields}
        self._columns = {name: _Growing(code) for name, code in codes.items()}

    def append(self, table: Table) -> None:
        """Add rows at the end."""
        for name, values in table.items():
            self._columns[name].append(values)

    def take(self) -> Table:
        """Give all rows; they are here no more."""
        return {name: column.take() for name, column in self._columns.items()}


class Layout:
    """How the messages of one channel are laid out, by the file's own descriptors.

    Parameters
    ----------
    column : Column
        Where they go.
    schema_data : bytes
        The descriptors.
    whole : bool
        Whether each field of the schema must be among them, in its place, because nothing else proves that they are
        undamaged: the damage of a byte can leave a field out.

    Raises
    ------
    ValueError
        They say something else than the schema; why.
    """

    def __init__(self, column: Column, schema_data: bytes, *, whole: bool) -> None:
        self._column = column
        self._topic = column.topic
        recorded = recorded_fields(self._topic, schema_data)
        if whole and (not recorded.fixed or len(recorded.fields) < len(self._topic.fields)):
            raise ValueError("its descriptors are damaged")
        self._fixed = recorded.fixed
        self._names = {field.name for field in recorded.fields}
        self._keys = keys(recorded.fields)
        self._row = np.dtype(columns(recorded.fields))
        self._choices = [field.name for field in recorded.fields if field.kind == "enum"]

    def add(self, messages: Messages, chosen: NDArray[np.intp]) -> None:
        """Add the `chosen` ones of `messages` to the column."""
        heads = messages.starts[chosen] + _CHANNEL_LENGTH
        starts, ends = heads + _STAMPS.itemsize, messages.ends[chosen]
        regular = (ends - starts == self._row.itemsize) if self._fixed else np.zeros(starts.size, dtype=np.bool_)
        if np.all(regular):
            rows = at_every_byte(messages.plain, self._row)[starts]
        else:
            rows = np.zeros(starts.size, dtype=self._row)
            if np.any(regular):
                rows[regular] = at_every_byte(messages.plain, self._row)[starts[regular]]
        strange = ~regular
        for number, key in enumerate(self._keys, start=1):
            strange |= rows[f"key{number}"] != key
        for name in self._choices:
            strange |= rows[name] > LARGEST_CODE
        stamps = at_every_byte(messages.plain, _STAMPS)[heads]
        if np.any(strange):
            bounds = zip(starts[strange].tolist(), ends[strange].tolist(), strict=True)
            kept = self._normalise(rows, np.flatnonzero(strange), [messages.plain[start:end] for start, end in bounds])
            self._column.undecoded += int(np.sum(~kept))
            stamps, rows = stamps[kept], rows[kept]
        self._column.append({name: stamps[name] for name in self._column.stamps} | self._fields(rows))

    def _normalise(self, rows: NDArray[Any], places: NDArray[np.intp], payloads: list[bytes]) -> NDArray[np.bool_]:
        """Read messages by the protobuf library: another order of fields, zeros left out, fields nobody knows.

        What they say is put into `rows` at `places`; the answer says which of all rows are good.
        """
        kept = np.ones(rows.size, dtype=np.bool_)
        values: list[tuple[float | int, ...]] = []
        for place, payload in zip(places.tolist(), payloads, strict=True):
            try:
                found = parse_fields(self._topic, payload)
            except ValueError:
                kept[place] = False
                continue
            codes = [code for code, field in zip(found, self._topic.fields, strict=True) if field.choices]
            kept[place] = all(0 <= code <= LARGEST_CODE for code in codes)
            if kept[place]:
                values.append(found)
        places = places[kept[places]]
        for field, column in zip(self._topic.fields, zip(*values, strict=True), strict=False):
            if field.name in self._names:
                rows[field.name][places] = np.array(column, dtype=field.numpy_code)
        return kept

    def _fields(self, rows: NDArray[Any]) -> Table:
        table: Table = {}
        for field in self._topic.fields:
            if field.name in self._names:
                table[field.name] = rows[field.name]
            else:
                absent = math.nan if field.kind == "double" else 0
                table[field.name] = np.full(rows.size, absent, dtype=field.numpy_code)
        return table


def increases(numbers: NDArray[Any]) -> bool:
    """Whether each number is larger than the one before it."""
    return bool(np.all(numbers[1:] > numbers[:-1]))


def matched(tables: list[Table]) -> list[Table]:
    """Rows whose sequence is in every table, once, in increasing order of the last table's column `cycle`.

    Tables that are so already are given back as they are.
    """
    numbers = [table["sequence"] for table in tables]
    if all(np.array_equal(numbers[0], other) for other in numbers[1:]) and increases(tables[-1]["cycle"]):
        return tables
    # The end was cut between the messages of one cycle, a message is damaged, or another tool changed the order: keep
    # the cycles that are whole.
    whole: NDArray[Any] = reduce(np.intersect1d, numbers)
    firsts = [np.unique(number, return_index=True)[1] for number in numbers]
    rows = [first[np.isin(number[first], whole)] for number, first in zip(numbers, firsts, strict=True)]
    order = np.argsort(tables[-1]["cycle"][rows[-1]], kind="stable")
    return [
        {name: values[chosen[order]] for name, values in table.items()}
        for table, chosen in zip(tables, rows, strict=True)
    ]
