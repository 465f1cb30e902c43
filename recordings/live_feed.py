"""The other end of a live view: collects cycles and gives them to a viewer in blocks."""

from __future__ import annotations

from typing import TYPE_CHECKING

from recordings.rerun_view import Scene, connect, hand_over
from recordings.run import Cycles
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
        self._scene = Scene(self._stream, geometry)
        self._scene.describe(metadata)

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
        self.safe += len(self._pending)
        self._pending.clear()
