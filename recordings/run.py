"""A run as it was read back from its recording."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from recordings.geometry import METADATA_NAME as GEOMETRY_METADATA
from recordings.geometry import Geometry
from recordings.schema import SCHEMA_METADATA, TOPICS, VERSION, WELL_KNOWN
from twin.cycle import CycleRecord

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from recordings.topic import Topic
    from twin.cycle import Event, Missed


@dataclass(frozen=True, eq=False)
class Cycles:
    """The executed cycles as arrays of one length, in the order of their numbers.

    Names and their order, units and signs are those of `twin.cycle.CycleRecord`; `cycle`, `host_time_ns` and `status`
    are int64, the others float64, bit for bit as they were written.
    """

    cycle: NDArray[np.int64]
    time: NDArray[np.float64]
    host_time_ns: NDArray[np.int64]
    lateness: NDArray[np.float64]
    target_position: NDArray[np.float64]
    position: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    rotation: NDArray[np.float64]
    predicted_rotation: NDArray[np.float64]
    predicted_angular_velocity: NDArray[np.float64]
    status: NDArray[np.int64]

    def __len__(self) -> int:
        return self.cycle.size

    def __iter__(self) -> Iterator[CycleRecord]:
        """Give the cycles one by one, as the live loop produced them."""
        columns = [getattr(self, column.name).tolist() for column in fields(self)]
        return (CycleRecord(*row) for row in zip(*columns, strict=True))

    def between(self, start: int, stop: int) -> Cycles:
        """Rows `start` to `stop` (excluded), as views."""
        return Cycles(**{column.name: getattr(self, column.name)[start:stop] for column in fields(self)})

    @classmethod
    def of(cls, records: list[CycleRecord]) -> Cycles:
        """Arrays of records that are still in memory."""
        whole = {"cycle", "host_time_ns", "status"}
        columns: dict[str, NDArray[Any]] = {
            column.name: np.array(
                [getattr(record, column.name) for record in records],
                dtype=np.int64 if column.name in whole else np.float64,
            )
            for column in fields(cls)
        }
        return cls(**columns)


@dataclass(frozen=True, eq=False)
class Series:
    """The messages of one optional topic as arrays of one length, in the order of the file.

    Attributes
    ----------
    topic : Topic
        Its fields say unit, meaning and choices of each column.
    sequence : ndarray of uint32
        Of a topic of the cycle, the cycle number modulo 2**32.
    host_time_ns : ndarray of int64
        Host's wall clock, ns since 1970 (UTC).
    table_time_ns : ndarray of int64
        `publish_time`: the table's clock as ns after the origin in metadata `clock`.
    columns : mapping of str to ndarray
        By the field's name in the file; float64, uint64, uint32, or uint8 codes of the field's choices.
    """

    topic: Topic
    sequence: NDArray[np.uint32]
    host_time_ns: NDArray[np.int64]
    table_time_ns: NDArray[np.int64]
    columns: Mapping[str, NDArray[Any]]

    def __len__(self) -> int:
        return self.sequence.size


@dataclass(frozen=True, eq=False)
class Run:
    """Everything a recording says.

    Attributes
    ----------
    path : Path
        The file.
    metadata : mapping of name to mapping of str to str
        Metadata records; where a name comes twice, the later values win.
    cycles : Cycles
        The executed cycles.
    events : tuple of Event
        In the order they were written.
    missed : tuple of Missed
        Gaps: cycles never executed.
    topics : mapping of str to int
        Messages found, by topic.
    complete : bool
        Whether the file was closed properly and is undamaged.
    problems : tuple of str
        Why it is not complete, each a clause.
    series : mapping of str to Series
        Optional topics that have messages, by topic: /forecast, /estimate, /can/frames.
    """

    path: Path
    metadata: Mapping[str, Mapping[str, str]]
    cycles: Cycles
    events: tuple[Event, ...]
    missed: tuple[Missed, ...]
    topics: Mapping[str, int]
    complete: bool
    problems: tuple[str, ...]
    series: Mapping[str, Series] = field(default_factory=dict[str, Series])

    @property
    def schema_version(self) -> tuple[int, int]:
        """Major and minor version of the schema it was written by; see `schema_version`."""
        return schema_version(self.metadata)

    @property
    def unknown(self) -> tuple[str, ...]:
        """Topics that this version does not know: counted in `topics`, not read."""
        known = {topic.name for topic in TOPICS} | set(WELL_KNOWN)
        return tuple(sorted(set(self.topics) - known))

    @property
    def geometry(self) -> Geometry | None:
        """Size of the block, None where the recording does not say; RecordingError where it says nonsense."""
        values = self.metadata.get(GEOMETRY_METADATA)
        return None if values is None else Geometry.from_metadata(values)


def schema_version(metadata: Mapping[str, Mapping[str, str]]) -> tuple[int, int]:
    """Major and minor version of the schema, of a recording's metadata; this version's own where they do not say."""
    said = metadata.get(SCHEMA_METADATA, {})
    major, minor = (said.get(part, "") for part in ("major", "minor"))
    return (int(major[:9]), int(minor[:9])) if major.isdecimal() and minor.isdecimal() else VERSION
