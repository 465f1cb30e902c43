"""A recording that is being written is read as it grows, cycle by cycle, and nothing twice."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from recordings import Geometry, RecordingError, RunWriter, read_run
from recordings.follow import Follower
from twin.cycle import Event

if TYPE_CHECKING:
    from conftest import MakeRecords


def test_what_is_written_is_read_once_and_in_order(tmp_path: Path, make_records: MakeRecords) -> None:
    path = tmp_path / "run.mcap"
    records = make_records(1000)
    writer = RunWriter(path, {"scene": {"name": "b6l"}}, Geometry(0.06, 0.27))
    seen: list[int] = []
    events: list[str] = []
    with Follower(path) as follower:
        for k, record in enumerate(records):
            writer.cycle(record)
            writer.tick(record.time)
            if k == 500:
                writer.event(Event(0.5, record.host_time_ns, "info", "phase", "half"))
            if k % 37 == 0 and (news := follower.news()) is not None:
                assert news.geometry == Geometry(0.06, 0.27)
                assert news.metadata["scene"] == {"name": "b6l"}
                seen += news.cycles.cycle.tolist()
                events += [event.message for event in news.events]
                # What is behind is what a crash would lose: 0.05 s.
                assert k - len(seen) <= 60
        assert not follower.ended
        writer.finish({"result": {"predicted": "rocked"}})
        last: dict[str, str] = {}
        while (news := follower.news()) is not None:
            seen += news.cycles.cycle.tolist()
            last |= news.metadata.get("result", {})
        assert follower.ended
    assert seen == list(range(1000))
    assert events == ["half"]
    assert last == {"predicted": "rocked"}


def test_a_long_recording_is_caught_up_with_in_pieces(
    tmp_path: Path, make_records: MakeRecords, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("recordings.follow.MOST_AT_ONCE", 20_000)
    writer = RunWriter(tmp_path / "run.mcap", {})
    for record in make_records(2000):
        writer.cycle(record)
        writer.tick(record.time)
    writer.finish()
    pieces = []
    with Follower(writer.path) as follower:
        while (news := follower.news()) is not None:
            pieces.append(news)
    assert len(pieces) > 5
    together = np.concatenate([piece.cycles.predicted_rotation for piece in pieces])
    np.testing.assert_array_equal(together, read_run(writer.path).cycles.predicted_rotation)


def test_files_that_are_no_recording(tmp_path: Path) -> None:
    path = tmp_path / "no.mcap"
    path.write_bytes(b"time,rotation\n0,0\n")
    with pytest.raises(RecordingError, match="is not an MCAP file"), Follower(path):
        pass
    with pytest.raises(RecordingError, match=r"none\.mcap cannot be read"), Follower(tmp_path / "none.mcap"):
        pass


def test_damage_is_said(tmp_path: Path, make_records: MakeRecords) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {})
    for record in make_records(200):
        writer.cycle(record)
        writer.tick(record.time)
    writer.finish()
    data = writer.path.read_bytes()
    writer.path.write_bytes(data[: len(data) // 2] + bytes(2000))
    with Follower(writer.path) as follower, pytest.raises(RecordingError, match="is damaged after"):
        list(iter(follower.news, None))
