"""The Rerun file holds the run: every entity, on the table's clock, with a blueprint. Pictures are not tested."""

from __future__ import annotations

import math
import socket
import subprocess
import sys
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest
import rerun as rr
from rerun.chunk import RrdReader

from devices.clock import ManualClock
from recordings import RecordingError, RunWriter, follow_view, live_feed, read_run, viewer
from recordings.follow import Follower
from recordings.live_feed import LiveFeed
from recordings.map_point import MapPicture
from recordings.rerun_blueprint import with_a_label
from recordings.rerun_view import hand_over, to_rrd
from twin.cycle import Estimated, Event, Forecasted, Missed
from twin.rocking.block import Block

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import MakeRecords, WriteRun

    from recordings import Geometry

LINES = {
    "/rotation/measured": "rotation",
    "/rotation/predicted": "predicted_rotation",
    "/acceleration/measured": "acceleration",
}


def _columns(path: Path, entity: str) -> dict[str, list[object]]:
    """All rows of an entity, by component name and timeline."""
    columns: dict[str, list[object]] = {}
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == entity and not chunk.is_static:
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                column = batch.column(name)
                # Nanoseconds do not fit into datetime's microseconds.
                column = column.cast("int64") if name == "time" else column
                columns.setdefault(name, []).extend(column.to_pylist())
    return columns


def _values(path: Path, entity: str) -> np.ndarray:
    columns = _columns(path, entity)
    (name,) = [name for name in columns if "calars" in name]
    return np.array([row[0] for row in columns[name]])


def test_the_file_holds_the_run(write_run: WriteRun, tmp_path: Path) -> None:
    run = read_run(write_run())
    path = tmp_path / "run.rrd"
    to_rrd(run, path)
    for entity, column in LINES.items():
        np.testing.assert_array_equal(_values(path, entity), getattr(run.cycles, column))
    np.testing.assert_array_equal(_values(path, "/position/measured"), run.cycles.position * 1e3)
    entities = {chunk.entity_path for chunk in RrdReader(path).stream()}
    assert {"/world/table", "/world/table/measured", "/world/table/predicted", "/events", "/about", "/clip"} <= entities
    assert {"/phase/path", "/phase/now", "/phase/balance"} <= entities
    assert not [entity for entity in entities if entity.startswith(("/map", "/forecast"))]
    assert len(RrdReader(path).blueprints()) == 1
    logs = _columns(path, "/events")
    assert ["   0.043 s  missed: cycles 40 to 42 were not executed"] in logs["TextLog:text"]
    assert len(logs["time"]) == len(run.events) + 1
    times = _columns(path, "/lateness/cycle")["time"]
    assert times[:2] == [0, 1_000_000]


def _static(path: Path, entity: str, component: str) -> list[object]:
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == entity and chunk.is_static:
            batch = chunk.to_record_batch()
            for name in batch.schema.names:
                if name.endswith(component):
                    return batch.column(name).to_pylist()
    raise AssertionError(f"no {component} in {entity}")


def test_the_phase_plane_is_in_units_of_the_block(write_run: WriteRun, tmp_path: Path, geometry: Geometry) -> None:
    run = read_run(write_run())
    to_rrd(run, tmp_path / "run.rrd")
    ((strip,),) = _static(tmp_path / "run.rrd", "/phase/path", "strips")
    block = Block(geometry.width, geometry.height)
    alpha, p = block.slenderness, block.frequency_parameter
    # Every fifth millisecond; upwards is negative in a picture.
    theta, rate = run.cycles.predicted_rotation, run.cycles.predicted_angular_velocity
    np.testing.assert_allclose(strip[0], [theta[0] / alpha, -rate[0] / (p * alpha)], rtol=1e-6)
    np.testing.assert_allclose(strip[1], [theta[5] / alpha, -rate[5] / (p * alpha)], rtol=1e-6)
    # The balance line leaves the axis of rotation at alpha: there nothing moves.
    lines = np.array(_static(tmp_path / "run.rrd", "/phase/balance", "strips")[0][0])
    crossing = lines[np.argmin(np.abs(lines[:, 1]))]
    assert crossing[0] == pytest.approx(1.0, abs=0.02)


def test_a_map_is_drawn_with_the_run_on_it(write_run: WriteRun, tmp_path: Path) -> None:
    pixels = np.zeros((4, 3, 3), dtype=np.uint8)
    pixels[0, 0] = (1, 2, 3)
    rows, columns = np.linspace(1.0, 4.0, 4), np.linspace(1.0, 3.0, 3)
    picture = MapPicture(pixels, columns, rows, "omega / p", "a0", ["rocked"], (2.0, 1.0), "2, 3")
    to_rrd(read_run(write_run()), tmp_path / "run.rrd", picture)
    # Column 2, row 1 from below, in the middle of its pixel.
    assert _static(tmp_path / "run.rrd", "/map/run", "positions") == [[[2.5, 2.5]]]
    (buffer,) = _static(tmp_path / "run.rrd", "/map/outcomes", "buffer")
    assert bytes(buffer[0])[27:30] == bytes([1, 2, 3])
    assert "light blue" in _static(tmp_path / "run.rrd", "/map_colours", "text")[0][0]


def test_forecast_and_estimate_have_lines_where_they_are_recorded(tmp_path: Path, make_records: MakeRecords) -> None:
    forecast = Forecasted("rocked", 0.5, 0.25, math.nan, "overturned", -0.1, 0.75, 0.4, "continue", 0.0, 32)
    records = make_records(20)
    records[::2] = [
        replace(record, forecast=forecast, estimate=Estimated(0.01, 0.1, 0.93, 0.01)) for record in records[::2]
    ]
    writer = RunWriter(tmp_path / "run.mcap", {})
    for record in records:
        writer.cycle(record)
    writer.finish()
    path = tmp_path / "run.rrd"
    to_rrd(read_run(writer.path), path)
    assert _values(path, "/forecast/continue").tolist() == [0.25] * 10
    assert _values(path, "/forecast/stop").tolist() == [0.75] * 10
    assert _values(path, "/rotation/estimated").tolist() == [0.01] * 10
    assert _columns(path, "/forecast/continue")["time"] == [2_000_000 * k for k in range(10)]


@pytest.mark.parametrize(
    ("given", "expected"),
    [
        ((-0.09, 0.09), (-0.105, 0.105)),
        ((-0.02, 0.09), (-0.02, 0.105)),
        ((0.0, 0.0), (0.0, 0.0)),
        ((-3, 3.1), (-3, 3.1)),
    ],
)
def test_axes_reach_a_number_that_is_written_on_them(given: tuple[float, float], expected: tuple[float, float]) -> None:
    assert with_a_label(*given) == pytest.approx(expected)


def test_rerun_itself_verifies_the_file(write_run: WriteRun, tmp_path: Path) -> None:
    path = tmp_path / "run.rrd"
    to_rrd(read_run(write_run()), path)
    result = subprocess.run(
        [sys.executable, "-m", "rerun_cli", "rrd", "verify", str(path)], capture_output=True, text=True, check=False
    )
    assert result.returncode == 0, result.stderr
    assert "without error" in result.stdout + result.stderr


def test_rows_that_cannot_be_drawn_are_left_out(tmp_path: Path, make_records: MakeRecords, geometry: Geometry) -> None:
    records = make_records(4)
    records[1] = replace(records[1], rotation=math.nan)
    records[2] = replace(records[2], time=math.inf)
    writer = RunWriter(tmp_path / "run.mcap", {}, geometry)
    for record in records:
        writer.cycle(record)
    writer.finish()
    to_rrd(read_run(writer.path), tmp_path / "run.rrd")
    assert len(_values(tmp_path / "run.rrd", "/rotation/measured")) == 2
    assert len(_values(tmp_path / "run.rrd", "/rotation/predicted")) == 3


def test_a_run_without_geometry_has_plots_but_no_scene(tmp_path: Path, make_records: MakeRecords) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {})
    writer.cycle(make_records(1)[0])
    writer.finish()
    to_rrd(read_run(writer.path), tmp_path / "run.rrd")
    entities = {chunk.entity_path for chunk in RrdReader(tmp_path / "run.rrd").stream()}
    assert "/rotation/measured" in entities
    assert not [entity for entity in entities if entity.startswith("/world")]


def test_an_rrd_that_cannot_be_written_is_one_sentence(write_run: WriteRun, tmp_path: Path) -> None:
    run = read_run(write_run())
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match=r"run\.rrd cannot be written: "):
        to_rrd(run, tmp_path / "file" / "run.rrd")


def test_a_live_feed_sends_blocks(
    tmp_path: Path, make_records: MakeRecords, geometry: Geometry, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "live.rrd"

    def to_file(url: str, shape: Geometry | None) -> rr.RecordingStream:
        stream = rr.RecordingStream("test")
        stream.save(path)
        return stream

    monkeypatch.setattr(live_feed, "connect", to_file)
    feed = LiveFeed({"scene": {"name": "b6l"}}, geometry, url="a viewer")
    records = make_records(200)
    for record in records:
        feed.cycle(record)
        feed.tick(record.time)
    feed.missed(Missed(200, 201, 0))
    feed.event(Event(0.2, 0, "info", "rest", "the block came to rest"))
    assert 100 < feed.safe < 200
    feed.finish({"verdict": {"outcome": "ROCKED"}})
    assert feed.safe == 200
    assert len(_columns(path, "/events")["time"]) == 2
    np.testing.assert_array_equal(
        _values(path, "/rotation/predicted"), [record.predicted_rotation for record in records]
    )


def test_a_live_feed_makes_room_for_a_forecast(
    tmp_path: Path, make_records: MakeRecords, geometry: Geometry, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "live.rrd"
    layouts: list[rr.blueprint.Blueprint] = []

    def to_file(url: str, shape: Geometry | None) -> rr.RecordingStream:
        stream = rr.RecordingStream("test")
        stream.save(path)
        monkeypatch.setattr(stream, "send_blueprint", layouts.append)
        return stream

    monkeypatch.setattr(live_feed, "connect", to_file)
    feed = LiveFeed({}, geometry, url="a viewer")
    forecast = Forecasted("rocked", 0.5, 0.25, math.nan, "rocked", 0.5, 0.125, math.nan, "continue", 0.0, 32)
    for k, record in enumerate(make_records(300)):
        feed.cycle(replace(record, forecast=forecast) if k >= 150 else record)
        feed.tick(record.time)
    feed.finish()
    assert len(layouts) == 1
    assert _values(path, "/forecast/stop").tolist() == [0.125] * 150


class Open:
    """A viewer's process that runs on until `looks` times it was asked."""

    def __init__(self, looks: int = 10**6) -> None:
        self.looks = looks

    def poll(self) -> int | None:
        self.looks -= 1
        return None if self.looks >= 0 else 0


@pytest.mark.parametrize("looks", [10**6, 1])
def test_a_recording_is_followed_to_its_end_or_the_viewers(
    looks: int, tmp_path: Path, make_records: MakeRecords, geometry: Geometry, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What is written while it is looked at, on a clock whose every wait writes some more."""
    path = tmp_path / "follow.rrd"
    writer = RunWriter(tmp_path / "run.mcap", {"scene": {"name": "b6l"}}, geometry)
    records = make_records(1000)

    class Writing(ManualClock):
        def wait_until(self, moment: float) -> float:
            for record in records[:200]:
                writer.cycle(record)
                writer.tick(record.time)
            del records[:200]
            if not records:
                writer.finish()
            return super().wait_until(moment)

    def to_file(url: str, shape: Geometry | None, shown: object = None) -> rr.RecordingStream:
        stream = rr.RecordingStream("test")
        stream.save(path)
        return stream

    monkeypatch.setattr(follow_view, "connect", to_file)
    with Follower(writer.path) as follower:
        shown = follow_view.follow(follower, viewer.Viewer(Open(looks), "a viewer"), Writing())
        assert follower.ended is (looks > 1)
    if looks == 1:
        writer.finish()
        assert shown == 0
        return
    assert shown == 1000
    run = read_run(writer.path)
    np.testing.assert_array_equal(_values(path, "/rotation/measured"), run.cycles.rotation)
    assert len(_columns(path, "/world/table")["time"]) == 1000


def test_a_viewer_closed_in_the_meantime_is_a_connection_error() -> None:
    class Severed:
        connected = True

        def flush(self, *, timeout_sec: float) -> None:
            raise RuntimeError("gRPC connection severed")

        def disconnect(self) -> None:
            self.connected = False

    stream = Severed()
    with pytest.raises(ConnectionError, match="the viewer was closed"):
        hand_over(stream)
    assert not stream.connected


LISTEN = """
import socket, sys
host, port = sys.argv[sys.argv.index("--bind") + 1], int(sys.argv[sys.argv.index("--port") + 1])
with socket.create_server((host, port)) as server:
    server.accept()
    server.accept()
"""


def test_a_viewer_listens_on_the_loopback_only(monkeypatch: pytest.MonkeyPatch) -> None:
    """On a stand-in that listens where it is told, as the viewer does."""
    monkeypatch.setattr(viewer, "_program", lambda: [sys.executable, "-c", LISTEN])
    started = viewer.start_viewer(("--headless",))
    assert started.process.args[3:5] == ["--bind", "127.0.0.1"]
    assert started.process.args[-1] == "--headless"
    port = int(started.url.removeprefix("rerun+http://127.0.0.1:").removesuffix("/proxy"))
    socket.create_connection(("127.0.0.1", port), timeout=5.0).close()
    assert started.process.wait(10.0) == 0


def test_a_viewer_that_cannot_start_is_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "_program", lambda: [sys.executable, "-c", "raise SystemExit(3)"])
    with pytest.raises(RecordingError, match=r"ended at once \(exit code 3\): is there a display\?"):
        viewer.start_viewer()
