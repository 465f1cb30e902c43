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

from recordings import RecordingError, RunWriter, live_feed, read_run, viewer
from recordings.live_feed import LiveFeed
from recordings.rerun_view import hand_over, to_rrd
from recordings.words import document_text
from twin.cycle import Event, Missed

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
    assert {"/world/table", "/world/table/measured", "/world/table/predicted", "/events", "/about"} <= entities
    assert len(RrdReader(path).blueprints()) == 1
    logs = _columns(path, "/events")
    assert ["missed: cycles 40 to 42 were not executed"] in logs["TextLog:text"]
    assert len(logs["time"]) == len(run.events) + 1
    times = _columns(path, "/lateness/cycle")["time"]
    assert times[:2] == [0, 1_000_000]


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


def test_metadata_as_text() -> None:
    text = document_text({"scene": {"name": "b6l", "toml": "[block]\nwidth_mm = 60\n"}})
    assert text == "## scene\n* name: b6l\n* toml:\n```\n[block]\nwidth_mm = 60\n```\n"


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
