"""Show a run in Rerun: table and block in 3D, prediction beside measurement, signals over time, events, metadata.

This module, those named `rerun_...` and `view_picture` import rerun (half a second): import them only where they are
used. Everything goes to Rerun in blocks of columns. Timeline: `time`, the table's clock.
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from recordings.errors import RecordingError
from recordings.foreseen import foresight_of
from recordings.rerun_blueprint import Shown, blueprint
from recordings.rerun_fan import Fan
from recordings.rerun_plane import draw_map
from recordings.rerun_scene import GRAVITY, Scene
from recordings.viewer import start_viewer
from recordings.words import gap_event

if TYPE_CHECKING:
    import subprocess
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from recordings.map_point import MapPicture
    from recordings.run import Cycles, Run, Series

APPLICATION = "shake_table_twin"
FLUSH_LIMIT = 10.0
"""Most time to wait for a viewer to take the last block, s."""


def gravity_in(metadata: Mapping[str, Mapping[str, str]]) -> float:
    """Return the gravity of a recording's scene, m/s2; `GRAVITY` where it says none."""
    try:
        scene = json.loads(metadata.get("scene", {}).get("json", ""))
        return float(scene["block"]["gravity_m_s2"])
    except (ValueError, KeyError, TypeError):
        return GRAVITY


def shown_of(run: Run, map_picture: MapPicture | None = None, *, panels: bool = True) -> Shown:
    """Return what a window on `run` has."""
    if map_picture is None:
        return Shown(topics=frozenset(run.series), panels=panels)
    rows, columns = map_picture.pixels.shape[:2]
    return Shown(frozenset(run.series), (rows, columns), f"Overturning map: {map_picture.name}", panels)


def fill(stream: rr.RecordingStream, run: Run, map_picture: MapPicture | None = None) -> None:
    """Send a whole run."""
    stream.send_recording_name(run.path.stem)
    scene = Scene(stream, run.geometry, gravity_in(run.metadata), whole=True)
    scene.describe(run.metadata, run.problems)
    scene.cycles(run.cycles)
    for topic, series in run.series.items():
        scene.series(topic, table_time(series, run.metadata), series.columns)
    if run.geometry is not None and len(run.cycles) and (seen := foresight_of(run.metadata)) is not None:
        Fan(stream, seen, run.geometry).follow_all(run.cycles.time, run.cycles.acceleration, run.cycles.rotation)
    scene.events(run.events)
    if len(run.cycles):
        hosts, times = run.cycles.host_time_ns, run.cycles.time
        scene.events(gap_event(gap, float(np.interp(gap.host_time_ns, hosts, times))) for gap in run.missed)
    if map_picture is not None:
        draw_map(stream, map_picture)


def table_time(series: Series, metadata: Mapping[str, Mapping[str, str]]) -> NDArray[np.float64]:
    """Return the times of a series on the table's clock, s, by the origin in a recording's metadata."""
    text = metadata.get("clock", {}).get("origin_ns", "")
    origin = int(text) if text.isdecimal() else 0
    return (series.table_time_ns - origin).astype(np.float64) * 1e-9


def to_rrd(run: Run, path: Path, map_picture: MapPicture | None = None) -> None:
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
        stream.save(path, default_blueprint=blueprint(run.geometry, run.cycles, shown_of(run, map_picture)))
        fill(stream, run, map_picture)
        stream.flush()
        stream.disconnect()
    except (OSError, RuntimeError, ValueError) as error:
        # Rerun's writer is a thread of its own and says "shut down prematurely" where the disk is full.
        raise RecordingError(f"{path} could not be written whole: {' '.join(str(error).split())}") from None


def open_viewer(
    run: Run, arguments: Sequence[str] = (), map_picture: MapPicture | None = None
) -> subprocess.Popen[bytes]:
    """Open `run` in a Rerun viewer of its own, which listens on 127.0.0.1 only, and return its process.

    `arguments` are more arguments of the `rerun` command. The viewer stays open when this process ends.

    Raises
    ------
    RecordingError
        The viewer cannot start (no display, no graphics driver), or was closed at once.
    """
    viewer = start_viewer(arguments)
    send_run(viewer.url, run, map_picture)
    return viewer.process


def send_run(url: str, run: Run, map_picture: MapPicture | None = None, *, panels: bool = True) -> None:
    """Send `run` to a viewer that runs already; raises RecordingError where it is gone before it has all."""
    stream = connect(url, run.geometry, run.cycles, shown_of(run, map_picture, panels=panels))
    fill(stream, run, map_picture)
    try:
        hand_over(stream)
    except ConnectionError as error:
        raise RecordingError(str(error)) from None


def connect(
    url: str, geometry: Geometry | None, cycles: Cycles | None = None, shown: Shown | None = None
) -> rr.RecordingStream:
    """Open a stream to a running viewer and lay its window out."""
    stream = rr.RecordingStream(APPLICATION)
    stream.connect_grpc(url, default_blueprint=blueprint(geometry, cycles, shown))
    return stream


def hand_over(stream: rr.RecordingStream) -> None:
    """Wait until the viewer has everything, then let go of it; ConnectionError where it is gone or too slow."""
    try:
        stream.flush(timeout_sec=FLUSH_LIMIT)
    except (RuntimeError, ValueError):
        raise ConnectionError("the viewer was closed, or is too slow, before it had the whole run") from None
    finally:
        stream.disconnect()
