"""A run as it was read back from its recording."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Any

import numpy as np

from recordings.geometry import METADATA_NAME as GEOMETRY_METADATA
from recordings.geometry import Geometry
from twin.cycle import CycleRecord

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from twin.cycle import Event, Missed


@dataclass(frozen=True, eq=False)
class Cycles:
    """The executed cycles as arrays of one length, in the order of their numbers.

    Names, units and signs are those of `twin.cycle.CycleRecord`; `cycle`, `host_time_ns` and `status` are int64, the
    others float64, bit for bit as they were written.
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
        columns = [getattr(self, field.name).tolist() for field in fields(CycleRecord)]
        return (CycleRecord(*row) for row in zip(*columns, strict=True))

    def between(self, start: int, stop: int) -> Cycles:
        """Rows `start` to `stop` (excluded), as views."""
        return Cycles(**{field.name: getattr(self, field.name)[start:stop] for field in fields(self)})

    @classmethod
    def of(cls, records: list[CycleRecord]) -> Cycles:
        """Arrays of records that are still in memory."""
        whole = {"cycle", "host_time_ns", "status"}
        columns: dict[str, NDArray[Any]] = {
            field.name: np.array(
                [getattr(record, field.name) for record in records],
                dtype=np.int64 if field.name in whole else np.float64,
            )
            for field in fields(cls)
        }
        return cls(**columns)


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
    """

    path: Path
    metadata: Mapping[str, Mapping[str, str]]
    cycles: Cycles
    events: tuple[Event, ...]
    missed: tuple[Missed, ...]
    topics: Mapping[str, int]
    complete: bool
    problems: tuple[str, ...]

    @property
    def geometry(self) -> Geometry | None:
        """Size of the block, None where the recording does not say; RecordingError where it says nonsense."""
        values = self.metadata.get(GEOMETRY_METADATA)
        return None if values is None else Geometry.from_metadata(values)
