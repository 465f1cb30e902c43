"""Show a run in Rerun: table and block in 3D, prediction beside measurement, signals over time, events, metadata.

The one module that imports rerun (half a second): import it only where it is used. Everything goes to Rerun in blocks
of columns. Timeline: `time`, the table's clock.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.errors import RecordingError
from recordings.geometry import block_poses
from recordings.viewer import start_viewer
from recordings.words import document_text, gap_event
from twin.cycle import Event

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Iterable, Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from recordings.run import Cycles, Run

APPLICATION = "shake_table_twin"
TIMELINE = "time"
FLUSH_LIMIT = 10.0
"""Most time to wait for a viewer to take the last block, s."""

_MEASURED = (70, 140, 255)
_PREDICTED = (255, 150, 40)
_GHOST = (*_PREDICTED, 110)
_TARGET = (150, 150, 150)
_TABLE = (105, 110, 120)
_RAIL = (60, 63, 70)
_LATENESS = (200, 120, 220)
_LEVELS = {"info": "INFO", "warning": "WARN", "error": "ERROR"}


class _Line(NamedTuple):
    """A line of a plot: column of Cycles, factor to the unit in the view's name, label, colour and width in points."""

    column: str
    factor: float
    label: str
    colour: tuple[int, int, int]
    width: float


# Lines are drawn in the order of their paths: the wide one first, so that the other stays visible where they agree.
_SERIES = {
    "rotation/measured": _Line("rotation", 1.0, "measured", _MEASURED, 3.0),
    "rotation/predicted": _Line("predicted_rotation", 1.0, "predicted", _PREDICTED, 1.5),
    "acceleration/measured": _Line("acceleration", 1.0, "measured", _MEASURED, 1.5),
    "position/commanded": _Line("target_position", 1e3, "set-point", _TARGET, 3.5),
    "position/measured": _Line("position", 1e3, "measured", _MEASURED, 1.5),
    "lateness/cycle": _Line("lateness", 1e3, "lateness", _LATENESS, 1.5),
}
_VIEWS = {
    "rotation": "Rotation of the block [rad]",
    "acceleration": "Base acceleration [m/s²]",
    "position": "Base position [mm]",
    "lateness": "Lateness of the cycle [ms]",
}


def blueprint(geometry: Geometry | None, cycles: Cycles | None = None) -> rrb.Blueprint:
    """Lay the window out: 3D and texts on the left, signals over time on the right.

    Where `cycles` are known already, the plots begin at their range; otherwise Rerun finds it as they come.
    """
    reach = max(geometry.height, 2.0 * geometry.width) if geometry else 0.3
    scene = rrb.Spatial3DView(
        origin="/world",
        name="Table and block (blue: measured, orange: predicted)",
        background=(24, 26, 32),
        eye_controls=rrb.EyeControls3D(
            position=(0.4 * reach, -1.9 * reach, 0.9 * reach), look_target=(0.0, 0.0, 0.4 * reach), eye_up=(0, 0, 1)
        ),
        line_grid=rrb.LineGrid3D(visible=False),
    )
    plots = [
        rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=name,
            axis_y=_range(entity, cycles) if cycles else None,
            axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        )
        for entity, name in _VIEWS.items()
    ]
    texts = rrb.Tabs(
        rrb.TextLogView(
            origin="/events",
            name="Events",
            columns=rrb.TextLogColumns(text_log_columns=["LogLevel", "Body"]),
        ),
        rrb.TextDocumentView(origin="/about", name="About this run"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(rrb.Vertical(scene, texts, row_shares=[3, 2]), rrb.Vertical(*plots, row_shares=[4, 4, 3, 2])),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed"),
        collapse_panels=True,
    )


def _range(view: str, cycles: Cycles) -> rrb.ScalarAxis | None:
    """Range of all lines of a view with a margin; None where they are constant or have no value."""
    lines = [line for entity, line in _SERIES.items() if entity.startswith(f"{view}/")]
    values = np.concatenate([getattr(cycles, line.column) * line.factor for line in lines])
    values = values[np.isfinite(values)]
    span = float(np.ptp(values)) if values.size else 0.0
    if not 0.0 < span < np.inf:
        return None
    return rrb.ScalarAxis(range=(float(values.min()) - 0.05 * span, float(values.max()) + 0.05 * span))


class Scene:
    """One run in a Rerun recording stream, fed in blocks.

    Parameters
    ----------
    stream : rerun.RecordingStream
        Where it goes: a file, a viewer.
    geometry : Geometry or None
        Size of the block; without it there is no 3D.
    """

    def __init__(self, stream: rr.RecordingStream, geometry: Geometry | None) -> None:
        self._stream = stream
        self._geometry = geometry
        for entity, line in _SERIES.items():
            # The default averages where samples outnumber pixels, which would hide a single late cycle.
            look = rr.SeriesLines(
                colors=[line.colour],
                names=[line.label],
                widths=[line.width],
                aggregation_policy="Max" if entity == "lateness/cycle" else "Average",
            )
            stream.log(entity, look, static=True, strict=True)
        if geometry is not None:
            self._boxes(geometry)

    def describe(self, metadata: Mapping[str, Mapping[str, str]]) -> None:
        """Show the metadata as a document."""
        document = rr.TextDocument(document_text(metadata), media_type=rr.MediaType.MARKDOWN)
        self._stream.log("about", document, static=True, strict=True)

    def cycles(self, cycles: Cycles) -> None:
        """Add a block of cycles; those without a finite time are left out, values that are NaN leave a gap."""
        for entity, line in _SERIES.items():
            values: NDArray[np.float64] = getattr(cycles, line.column) * line.factor
            kept = np.isfinite(cycles.time) & np.isfinite(values)
            self._send(entity, cycles.time[kept], rr.Scalars.columns(scalars=values[kept]))
        if self._geometry is None:
            return
        kept = np.isfinite(cycles.time) & np.isfinite(cycles.position)
        base = np.zeros((int(kept.sum()), 3))
        base[:, 0] = cycles.position[kept]
        self._send("world/table", cycles.time[kept], rr.Transform3D.columns(translation=base))
        for entity, rotation in (("measured", cycles.rotation), ("predicted", cycles.predicted_rotation)):
            kept = np.isfinite(cycles.time) & np.isfinite(rotation)
            poses = block_poses(rotation[kept], self._geometry.width)
            columns = rr.Transform3D.columns(translation=poses.translation, quaternion=poses.quaternion)
            self._send(f"world/table/{entity}", cycles.time[kept], columns)

    def events(self, events: Iterable[Event]) -> None:
        """Add events to the text log."""
        rows = [event for event in events if np.isfinite(event.time)]
        columns = rr.TextLog.columns(
            text=[f"{event.name}: {event.message}" for event in rows],
            level=[_LEVELS[event.level] for event in rows],
        )
        self._send("events", np.array([event.time for event in rows]), columns)

    def _boxes(self, geometry: Geometry) -> None:
        width, height = geometry.width, geometry.height
        log = self._stream.log
        log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True, strict=True)
        # The outline of the table, the rail and the depth of the block are not recorded: drawn, not measured.
        rail = rr.Boxes3D(
            centers=[(0.0, 0.0, -0.3 * width)],
            half_sizes=[(5.0 * width, 0.5 * width, 0.1 * width)],
            colors=[_RAIL],
            fill_mode="solid",
        )
        log("world/rail", rail, static=True, strict=True)
        table = rr.Boxes3D(
            centers=[(0.0, 0.0, -0.1 * width)],
            half_sizes=[(2.5 * width, 1.5 * width, 0.1 * width)],
            colors=[_TABLE],
            fill_mode="solid",
        )
        log("world/table", table, static=True, strict=True)
        for entity, depth, colour in (("measured", 0.5, _MEASURED), ("predicted", 0.55, _GHOST)):
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


def _fill(stream: rr.RecordingStream, run: Run) -> None:
    stream.send_recording_name(run.path.stem)
    scene = Scene(stream, run.geometry)
    scene.describe(run.metadata)
    scene.cycles(run.cycles)
    scene.events(run.events)
    if len(run.cycles):
        hosts, times = run.cycles.host_time_ns, run.cycles.time
        scene.events(gap_event(gap, float(np.interp(gap.host_time_ns, hosts, times))) for gap in run.missed)


def to_rrd(run: Run, path: Path) -> None:
    """Write `run` as a new Rerun file with its blueprint.

    Raises
    ------
    RecordingError
        The file exists, has another ending than .rrd, or cannot be written.
    """
    if path.suffix.lower() != ".rrd":
        raise RecordingError(f"{path} is not written: a Rerun file ends in .rrd")
    if path.is_file():
        raise RecordingError(f"{path} exists already and is not overwritten")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.open("xb").close()
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {error.strerror}") from None
    try:
        stream = rr.RecordingStream(APPLICATION)
        stream.save(path, default_blueprint=blueprint(run.geometry, run.cycles))
        _fill(stream, run)
        stream.flush()
        stream.disconnect()
    except (OSError, RuntimeError, ValueError) as error:
        # Rerun's writer is a thread of its own and says "shut down prematurely" where the disk is full.
        raise RecordingError(f"{path} could not be written whole: {' '.join(str(error).split())}") from None


def open_viewer(run: Run, arguments: Sequence[str] = ()) -> subprocess.Popen[bytes]:
    """Open `run` in a Rerun viewer of its own, which listens on 127.0.0.1 only, and return its process.

    `arguments` are more arguments of the `rerun` command. The viewer stays open when this process ends.

    Raises
    ------
    RecordingError
        The viewer cannot start (no display, no graphics driver), or was closed at once.
    """
    viewer = start_viewer(arguments)
    stream = connect(viewer.url, run.geometry, run.cycles)
    _fill(stream, run)
    try:
        hand_over(stream)
    except ConnectionError as error:
        raise RecordingError(str(error)) from None
    return viewer.process


def connect(url: str, geometry: Geometry | None, cycles: Cycles | None = None) -> rr.RecordingStream:
    """Open a stream to a running viewer and lay its window out."""
    stream = rr.RecordingStream(APPLICATION)
    stream.connect_grpc(url, default_blueprint=blueprint(geometry, cycles))
    return stream


def hand_over(stream: rr.RecordingStream) -> None:
    """Wait until the viewer has everything, then let go of it; ConnectionError where it is gone or too slow."""
    try:
        stream.flush(timeout_sec=FLUSH_LIMIT)
    except (RuntimeError, ValueError):
        raise ConnectionError("the viewer was closed, or is too slow, before it had the whole run") from None
    finally:
        stream.disconnect()
