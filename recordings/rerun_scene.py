"""One run drawn in Rerun: table and block in 3D, lines over time, phase plane, events, documents."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from recordings.geometry import block_poses
from recordings.rerun_blueprint import (
    CYCLE_LINES,
    MEASURED,
    OPTIONAL_LINES,
    PREDICTED,
    TIMELINE,
    Line,
    Shown,
    blueprint,
)
from recordings.rerun_plane import PhasePlane
from recordings.words import about_text, clip_text

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from recordings.run import Cycles
    from twin.cycle import Event

POSE_STEP = 2e-3
"""Least time between two poses of a finished run, s: beyond that a long run is only slow to load."""
GRAVITY = 9.81
"""Where a recording does not say it, m/s2."""

GHOST = (*PREDICTED, 110)
TABLE = (105, 110, 120)
RAIL = (60, 63, 70)
_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}


class Scene:
    """One run in a Rerun recording stream, fed in blocks.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where it goes: a file, a viewer.
    geometry : Geometry or None
        Size of the block; without it there is no 3D.
    gravity : float
        m/s2.
    whole : bool
        Whether the run is finished and comes in one block.
    """

    def __init__(
        self, stream: rr.RecordingStream, geometry: Geometry | None, gravity: float = GRAVITY, *, whole: bool = False
    ) -> None:
        self._stream = stream
        self._geometry = geometry
        self._whole = whole
        self._topics: set[str] = set()
        for entity, line in CYCLE_LINES.items():
            self._look(entity, line)
        self._phase = None
        if geometry is not None:
            self._boxes(geometry)
            self._phase = PhasePlane(stream, geometry, gravity)

    def describe(self, metadata: Mapping[str, Mapping[str, str]], problems: Sequence[str] = ()) -> None:
        """Show what the run is, and its clip report, as documents."""
        for entity, text in (("about", about_text(metadata, problems)), ("clip", clip_text(metadata))):
            document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
            self._stream.log(entity, document, static=True, strict=True)

    def cycles(self, cycles: Cycles) -> None:
        """Add a block of cycles; those without a finite time are left out, values that are NaN leave a gap."""
        for entity, line in CYCLE_LINES.items():
            self._line(entity, cycles.time, getattr(cycles, line.column) * line.factor)
        if self._geometry is None or self._phase is None:
            return
        self._poses(cycles, self._geometry)
        kept = np.isfinite(cycles.time) & np.isfinite(cycles.predicted_rotation)
        kept &= np.isfinite(cycles.predicted_angular_velocity)
        draw = self._phase.path if self._whole else self._phase.extend
        draw(cycles.time[kept], cycles.predicted_rotation[kept], cycles.predicted_angular_velocity[kept])

    def series(self, topic: str, time: NDArray[np.float64], columns: Mapping[str, NDArray[Any]]) -> None:
        """Add messages of a topic that not every recording has; those without lines of their own are passed over.

        The first one of a run under way makes room for its plot.
        """
        lines = OPTIONAL_LINES.get(topic, {})
        if lines and topic not in self._topics:
            self._topics.add(topic)
            if not self._whole:
                shown = Shown(topics=frozenset(self._topics))
                self._stream.send_blueprint(blueprint(self._geometry, None, shown))
        for entity, line in lines.items():
            self._look(entity, line)
            self._line(entity, time, columns[line.column] * line.factor)

    def events(self, events: Iterable[Event]) -> None:
        """Add events to the text log."""
        rows = [event for event in events if np.isfinite(event.time)]
        columns = rr.TextLog.columns(
            text=[f"{event.time:8.3f} s  {event.name}: {event.message}" for event in rows],
            level=[_LEVELS[event.level] for event in rows],
        )
        self._send("events", np.array([event.time for event in rows]), columns)

    def _look(self, entity: str, line: Line) -> None:
        # The default averages where samples outnumber pixels, which would hide a single late cycle.
        look = rr.SeriesLines(
            colors=[line.colour],
            names=[line.label],
            widths=[line.width],
            aggregation_policy="Max" if entity == "lateness/cycle" else "Average",
        )
        self._stream.log(entity, look, static=True, strict=True)

    def _line(self, entity: str, time: NDArray[np.float64], values: NDArray[np.float64]) -> None:
        kept = np.isfinite(time) & np.isfinite(values)
        self._send(entity, time[kept], rr.Scalars.columns(scalars=values[kept]))

    def _poses(self, cycles: Cycles, geometry: Geometry) -> None:
        rows = self._pose_rows(cycles.time)
        time, position = cycles.time[rows], cycles.position[rows]
        kept = np.isfinite(time) & np.isfinite(position)
        base = np.zeros((int(kept.sum()), 3))
        base[:, 0] = position[kept]
        self._send("world/table", time[kept], rr.Transform3D.columns(translation=base))
        for entity, column in (("measured", cycles.rotation), ("predicted", cycles.predicted_rotation)):
            rotation = column[rows]
            kept = np.isfinite(time) & np.isfinite(rotation)
            poses = block_poses(rotation[kept], geometry.width)
            columns = rr.Transform3D.columns(translation=poses.translation, quaternion=poses.quaternion)
            self._send(f"world/table/{entity}", time[kept], columns)

    def _pose_rows(self, time: NDArray[np.float64]) -> NDArray[np.int64]:
        """Return the cycles whose pose is drawn, the last one always among them: the end is the end."""
        rows = np.arange(time.size)
        if not self._whole or time.size < 2:
            return rows
        step = float(np.median(np.diff(time)))
        every = max(1, round(POSE_STEP / step)) if step > 0.0 else 1
        return np.unique(np.append(rows[::every], rows[-1]))

    def _boxes(self, geometry: Geometry) -> None:
        width, height = geometry.width, geometry.height
        log = self._stream.log
        log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True, strict=True)
        # The outline of the table, the rail and the depth of the block are not recorded: drawn, not measured.
        rail = rr.Boxes3D(
            centers=[(0.0, 0.0, -0.3 * width)],
            half_sizes=[(5.0 * width, 0.5 * width, 0.1 * width)],
            colors=[RAIL],
            fill_mode="solid",
        )
        log("world/rail", rail, static=True, strict=True)
        table = rr.Boxes3D(
            centers=[(0.0, 0.0, -0.1 * width)],
            half_sizes=[(2.5 * width, 1.5 * width, 0.1 * width)],
            colors=[TABLE],
            fill_mode="solid",
        )
        log("world/table", table, static=True, strict=True)
        for entity, depth, colour in (("measured", 0.5, MEASURED), ("predicted", 0.55, GHOST)):
            block = rr.Boxes3D(
                centers=[(0.0, 0.0, 0.5 * height)],
                half_sizes=[(0.5 * width, depth * width, 0.5 * height)],
                colors=[colour],
                fill_mode="solid" if entity == "measured" else rr.components.FillMode.TransparentFillMajorWireframe,
            )
            log(f"world/table/{entity}", block, static=True, strict=True)

    def _send(self, entity: str, times: NDArray[np.float64], columns: rr.ComponentColumnList) -> None:
        if times.size:
            nanoseconds = np.rint(times * 1e9).astype("timedelta64[ns]")
            index = rr.TimeColumn(TIMELINE, duration=nanoseconds)
            self._stream.send_columns(entity, indexes=[index], columns=columns, strict=True)
