"""The recorder process: nothing lost, nothing blocks, every value accounted for."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import replace
from multiprocessing import Pipe
from types import SimpleNamespace
from typing import TYPE_CHECKING

import pytest

from recordings import Recorder, RecordingError, RunWriter, read_run
from recordings.consumer import Frame, consume, pack_cycle, pack_event, pack_missed, unpack

if TYPE_CHECKING:
    from pathlib import Path

    from conftest import MakeRecords

    from recordings import Geometry
    from twin.cycle import CycleRecord, Event, Missed


class Listing:
    """A sink that keeps what it gets."""

    def __init__(self) -> None:
        self.values: list[object] = []
        self.cycle = self.missed = self.event = self.values.append


def test_packing_keeps_everything(make_records: MakeRecords, events: tuple[Event, ...], gap: Missed) -> None:
    records, sink = make_records(3), Listing()
    packed = [*map(pack_cycle, records), pack_missed(gap), *map(pack_event, events)]
    assert unpack(b"".join(packed), sink) == 7
    assert sink.values == [*records, gap, *events]


def test_a_run_through_the_process(
    tmp_path: Path, make_records: MakeRecords, events: tuple[Event, ...], gap: Missed, geometry: Geometry
) -> None:
    records = make_records(4000)
    recorder = Recorder(tmp_path / "run.mcap", {"scene": {"name": "b6l"}}, geometry)
    for record in records:
        recorder.cycle(record)
    recorder.missed(gap)
    for event in events:
        recorder.event(event)
    recorder.cycle(replace(records[0], position="far"))
    report = recorder.finish({"verdict": {"outcome": "ROCKED"}})
    assert (report.written, report.dropped, report.lost, report.refused) == (4004, 0, 0, 1)
    assert report.failure is None
    assert not report.complete
    assert recorder.finish() is report
    run = read_run(report.path)
    assert run.complete
    assert list(run.cycles) == records
    assert (run.events, run.missed, run.geometry) == (events, (gap,), geometry)
    assert run.metadata["verdict"] == {"outcome": "ROCKED"}
    assert run.metadata["recorder"] == {"received": "4004", "dropped": "0", "refused": "1"}


def test_a_dead_process_is_noticed_and_costs_nothing(tmp_path: Path, make_records: MakeRecords) -> None:
    records = make_records(200)
    recorder = Recorder(tmp_path / "run.mcap", {})
    for record in records[:100]:
        recorder.cycle(record)
    recorder._process.kill()
    recorder._thread.join(10.0)
    assert not recorder.alive
    for record in records[100:]:
        recorder.cycle(record)
    started = time.monotonic()
    report = recorder.finish({"verdict": {}})
    assert time.monotonic() - started < 5.0
    assert report.written + report.lost == 200
    assert report.lost >= 100
    assert report.failure == "the recorder process died"
    assert read_run(report.path).complete is False


def test_a_full_queue_drops_cycles_counts_them_and_keeps_events(
    tmp_path: Path, make_records: MakeRecords, events: tuple[Event, ...]
) -> None:
    with Recorder(tmp_path / "run.mcap", {}, bound=0) as recorder:
        for record in make_records(50):
            recorder.cycle(record)
        for event in events:
            recorder.event(event)
    report = recorder.finish()
    assert (report.dropped, report.written, report.lost) == (50, 3, 0)
    assert not report.complete
    assert read_run(report.path).events == events


def test_a_process_that_hangs_is_ended(tmp_path: Path, make_records: MakeRecords) -> None:
    if not hasattr(signal, "SIGSTOP"):
        pytest.skip("this system cannot stop a process")
    recorder = Recorder(tmp_path / "run.mcap", {})
    assert recorder._process.pid is not None
    os.kill(recorder._process.pid, signal.SIGSTOP)
    for record in make_records(2000):
        recorder.cycle(record)
    report = recorder.finish(limit=0.2)
    assert report.failure == "the recorder process did not end within 0.2 s"
    assert (report.written, report.lost) == (0, 2000)


def test_a_file_that_cannot_be_made_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "run.mcap").write_text("")
    with pytest.raises(RecordingError, match="exists already and is not overwritten"):
        Recorder(tmp_path / "run.mcap", {})
    with pytest.raises(RecordingError, match="cannot be written"):
        Recorder(tmp_path / "run.mcap" / "run.mcap", {})


class FullDisk(RunWriter):
    """Writes ten cycles, then the disk is full."""

    def cycle(self, record: CycleRecord) -> None:
        if record.cycle == 10:
            raise OSError(28, "No space left on device")
        super().cycle(record)


@pytest.mark.parametrize("finish", [True, False], ids=["finished", "producer died"])
@pytest.mark.parametrize("full", [True, False], ids=["disk full", "disk fine"])
def test_the_other_end(
    tmp_path: Path, make_records: MakeRecords, monkeypatch: pytest.MonkeyPatch, full: bool, finish: bool
) -> None:
    """What runs in the other process, run in this one."""
    ignored: list[object] = []
    monkeypatch.setattr(signal, "signal", lambda *arguments: ignored.append(arguments))
    monkeypatch.setattr(os, "nice", lambda _: 0, raising=False)
    inbox, outlet = Pipe(duplex=False)
    replies, reply = Pipe(duplex=False)
    outlet.send_bytes(bytes([Frame.BATCH]) + b"".join(map(pack_cycle, make_records(20))))
    if finish:
        outlet.send_bytes(bytes([Frame.FINISH]) + b'{"verdict": {"outcome": "ROCKED"}}')
    outlet.close()
    safe = SimpleNamespace(value=0)
    kind = FullDisk if full else RunWriter
    consume(lambda: kind(tmp_path / "run.mcap", {}), inbox, reply, safe)
    assert (signal.SIGINT, signal.SIG_IGN) in ignored
    assert (signal.SIGTERM, signal.SIG_IGN) in ignored
    assert replies.recv_bytes() == b"ready"
    if full:
        assert replies.recv_bytes() == b"No space left on device"
    run = read_run(tmp_path / "run.mcap")
    assert len(run.cycles) == safe.value == (10 if full else 20)
    assert ("verdict" in run.metadata) == (finish and not full)
    if full:
        assert run.problems == ("recording stopped: No space left on device",)
    else:
        assert run.problems == (() if finish else ("the recorded process ended without closing its recording",))
    for end in (inbox, replies, reply):
        end.close()
