"""The other end of a live view: collects cycles and gives them to a viewer in blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from recordings.foreseen import foresight_of
from recordings.rerun_blueprint import OPTIONAL_LINES
from recordings.rerun_fan import Fan
from recordings.rerun_scene import Scene
from recordings.rerun_view import connect, gravity_in, hand_over
from recordings.run import Cycles
from recordings.schema import TOPICS
from recordings.viewer import start_viewer
from recordings.words import gap_event

if TYPE_CHECKING:
    from collections.abc import Mapping

    from recordings.geometry import Geometry
    from twin.cycle import CycleRecord, Event, Missed

BLOCK_INTERVAL = 0.05
"""Time between two blocks, s."""


class LiveFeed:
    """Feeds a viewer from the other end of a `Spool`: a consumer that sends a block of cycles 20 times a second.

    Parameters
    ----------
    metadata, geometry
        As of `Scene`.
    url : str or None
        Address of a viewer that runs already; None starts one.
    """

    def __init__(
        self, metadata: Mapping[str, Mapping[str, str]], geometry: Geometry | None, url: str | None = None
    ) -> None:
        self.safe = 0
        self._metadata = dict(metadata)
        self._time = 0.0
        self._pending: list[CycleRecord] = []
        self._sent_at = 0.0
        self._stream = connect(url or start_viewer().url, geometry)
        self._scene = Scene(self._stream, geometry, gravity_in(metadata))
        self._scene.describe(metadata)
        seen = foresight_of(metadata)
        self._fan = None if seen is None or geometry is None else Fan(self._stream, seen, geometry)

    def cycle(self, record: CycleRecord) -> None:
        """Keep a cycle for the next block."""
        self._pending.append(record)
        self._time = record.time

    def missed(self, missed: Missed) -> None:
        """Show a gap as text, at the time of the last cycle before it."""
        self._scene.events([gap_event(missed, self._time)])

    def event(self, event: Event) -> None:
        """Show an event at once."""
        self._scene.events([event])

    def tick(self, now: float) -> None:
        """Send what is pending, where the last block is old enough; `now` is any monotonic clock, s."""
        if self._pending and now - self._sent_at >= BLOCK_INTERVAL:
            self._send()
            self._sent_at = now

    def finish(self, metadata: Mapping[str, Mapping[str, str]] | None = None) -> None:
        """Send the rest; the viewer stays open. ConnectionError where it was closed in the meantime."""
        self._send()
        if metadata:
            self._scene.describe({**self._metadata, **metadata})
        hand_over(self._stream)

    def _send(self) -> None:
        self._scene.cycles(Cycles.of(self._pending))
        for topic, part in (("/forecast", "forecast"), ("/estimate", "estimate")):
            self._optional(topic, part)
        if self._fan is not None:
            for record in self._pending:
                self._fan.follow(record.time, record.acceleration, record.rotation)
        self.safe += len(self._pending)
        self._pending.clear()

    def _optional(self, topic: str, part: str) -> None:
        """Send what only some cycles have, as far as it has lines of its own."""
        rows = [(record.time, value) for record in self._pending if (value := getattr(record, part)) is not None]
        sources = {field.name: field.source for known in TOPICS if known.name == topic for field in known.fields}
        wanted = {line.column for line in OPTIONAL_LINES[topic].values()}
        if rows:
            columns = {name: np.array([getattr(value, sources[name]) for _, value in rows]) for name in wanted}
            self._scene.series(topic, np.array([time for time, _ in rows]), columns)
