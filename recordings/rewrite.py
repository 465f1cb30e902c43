"""Write a recording that was made of another one: with other predictions, or other measurements."""

from __future__ import annotations

import heapq
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from recordings.geometry import METADATA_NAME as GEOMETRY_METADATA
from recordings.schema import CLOCK_METADATA, RECORDER_METADATA, SCHEMA_METADATA
from recordings.writer import RunWriter
from twin.cycle import Event
from twin.live_loop import PREDICTED

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from recordings.run import Cycles
    from twin.cycle import Missed
    from twin.rocking.track import BlockEvent

OF_THE_FILE = frozenset({SCHEMA_METADATA, CLOCK_METADATA, RECORDER_METADATA, GEOMETRY_METADATA, "recovery"})
"""Metadata a writer makes itself, or that belong to one file alone."""
PREDICTED_MARK = "predicted: "
"""How the message of an event of the predicted block begins."""


@dataclass(frozen=True)
class Contents:
    """What shall be in a file: as of `Run`; `metadata` without what a writer makes itself."""

    metadata: Mapping[str, Mapping[str, str]]
    geometry: Geometry | None
    cycles: Cycles
    events: tuple[Event, ...]
    missed: tuple[Missed, ...]


def write_recording(contents: Contents, path: Path) -> None:
    """Write a new recording, everything in the order of the host's clock.

    Raises
    ------
    RecordingError
        The file exists or cannot be written.
    """
    writer = RunWriter(path, contents.metadata, contents.geometry)
    try:
        events = sorted(contents.events, key=lambda event: event.host_time_ns)
        missed = sorted(contents.missed, key=lambda gap: gap.host_time_ns)
        streams = (
            ((record.host_time_ns, 0, record) for record in contents.cycles),
            ((gap.host_time_ns, 1, gap) for gap in missed),
            ((event.host_time_ns, 2, event) for event in events),
        )
        for _, kind, value in heapq.merge(*streams, key=lambda item: item[:2]):
            (writer.cycle, writer.missed, writer.event)[kind](value)  # pyright: ignore[reportArgumentType]
    finally:
        writer.finish()


def own_metadata(metadata: Mapping[str, Mapping[str, str]]) -> dict[str, dict[str, str]]:
    """Return the metadata of a run that may be written again."""
    return {name: dict(values) for name, values in metadata.items() if name not in OF_THE_FILE}


def with_predicted(events: Iterable[Event], predicted: Iterable[BlockEvent], cycles: Cycles) -> tuple[Event, ...]:
    """Return `events` with those of the predicted block replaced by `predicted`."""
    kept = [event for event in events if not event.message.startswith(PREDICTED_MARK)]
    hosts: NDArray[np.float64] = (cycles.host_time_ns - cycles.host_time_ns[0]).astype(np.float64)
    for event in predicted:
        # Differences of nanoseconds since 1970 keep their digits in a double only from a near origin.
        after = float(np.interp(event.time, cycles.time, hosts))
        host = int(cycles.host_time_ns[0]) + round(after)
        words = PREDICTED[event.name].format(rate=event.rate)
        kept.append(Event(event.time, host, "info", event.name, f"{PREDICTED_MARK}{words}"))
    return tuple(sorted(kept, key=lambda event: event.host_time_ns))
