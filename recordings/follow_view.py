"""Show a recording in Rerun while it is being written."""

from __future__ import annotations

from typing import TYPE_CHECKING

from recordings.errors import RecordingError
from recordings.rerun_blueprint import Shown
from recordings.rerun_scene import Scene
from recordings.rerun_view import connect, gravity_in, hand_over, table_time
from recordings.words import gap_event

if TYPE_CHECKING:
    from devices.clock import Clock
    from recordings.follow import Follower
    from recordings.run import Run
    from recordings.viewer import Viewer

LOOK_INTERVAL = 0.2
"""Time between two looks at the file, s."""


def follow(follower: Follower, viewer: Viewer, clock: Clock) -> int:
    """Send what is written, as it comes, until the recording is closed or the viewer is; return the cycles sent.

    Raises
    ------
    RecordingError
        The viewer is gone, or too slow, before it has everything; what is new is damaged.
    """
    view: _View | None = None
    while viewer.process.poll() is None:
        news = follower.news()
        if news is not None:
            view = view or _View(viewer.url, news)
            view.add(news)
        elif follower.ended:
            break
        else:
            clock.wait_until(clock.now() + LOOK_INTERVAL)
    if view is None:
        return 0
    if viewer.process.poll() is None:
        view.finish()
    return view.cycles


class _View:
    """One run in a viewer, made of pieces."""

    def __init__(self, url: str, first: Run) -> None:
        self.cycles = 0
        self._metadata: dict[str, dict[str, str]] = {}
        self._time = 0.0
        self._stream = connect(url, first.geometry, shown=Shown(topics=frozenset(first.series)))
        self._stream.send_recording_name(first.path.stem)
        self._scene = Scene(self._stream, first.geometry, gravity_in(first.metadata))

    def add(self, piece: Run) -> None:
        before = dict(self._metadata)
        for name, values in piece.metadata.items():
            self._metadata[name] = {**self._metadata.get(name, {}), **values}
        if self._metadata != before:
            self._scene.describe(self._metadata)
        self._scene.cycles(piece.cycles)
        for topic, series in piece.series.items():
            self._scene.series(topic, table_time(series, self._metadata), series.columns)
        self._scene.events(piece.events)
        if len(piece.cycles):
            self._time = float(piece.cycles.time[-1])
        self._scene.events(gap_event(gap, self._time) for gap in piece.missed)
        self.cycles += len(piece.cycles)

    def finish(self) -> None:
        try:
            hand_over(self._stream)
        except ConnectionError as error:
            raise RecordingError(str(error)) from None
