"""A run and its recording: CAN traffic on request; a recorder that fails in the middle stops the table, and says so."""

from __future__ import annotations

import argparse
import itertools
import json
from functools import partial
from pathlib import Path

import can
import pytest

from devices.catalogue import find_device
from devices.clock import ManualClock
from recordings import Recorder, RunWriter, read_run
from recordings.can_traffic import CanTap, frames
from recordings.disk_file import DiskFile
from tests.recordings.disk_faults import FullDisk
from tests.twin.conftest import FREE, Kept, chain, short_scene
from twin.cli import main
from twin.commands.connection import connect
from twin.commands.recording import live_twin
from twin.commands.run import _recorder_trouble  # pyright: ignore[reportPrivateUsage]
from twin.cycle import Tee
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import rehearse

FAILS_AT = 700


@pytest.mark.parametrize("fault", ["disk full", "killed"])
def test_a_run_whose_recorder_fails_ramps_down_and_says_so(tmp_path: Path, fault: str) -> None:
    full = fault == "disk full"
    recorder = Recorder(tmp_path / "run.mcap", {}, disk=partial(FullDisk, room=60_000) if full else DiskFile)
    kept, calls = Kept(), itertools.count()

    def stopped() -> str | None:
        # The manual clock outruns the recorder's process: it is waited for once, where it must have failed.
        if next(calls) == FAILS_AT:
            if not full:
                recorder._process.kill()
            recorder._thread.join(20.0)
        return _recorder_trouble(recorder)

    scene = short_scene()
    with chain(scene) as (table, release, rehearsal):
        table.enable(0.0)
        report = perform(
            table,
            rehearsal.motion,
            live_twin(scene),
            Tee(recorder, kept),
            ManualClock(),
            watch=Watch(stopped=stopped, release=release),
        )
    said = "stopped: No space left on device" if full else "died"
    assert report.tripped == f"recorder: the recorder process {said}"
    assert report.executed <= FAILS_AT + 1
    names = [event.name for event in kept.events]
    assert "trip" in names
    assert names[-1] == "stopped"
    # On the way down, and at rest.
    assert report.stopping > 0
    assert abs(kept.cycles[-1].position - kept.cycles[-2].position) < 5e-6
    written = recorder.finish()
    assert not written.complete
    assert written.failure == report.tripped.removeprefix("recorder: ")
    run = read_run(written.path)
    assert len(run.cycles) >= written.written - len(run.events)
    assert list(run.cycles) == kept.cycles[: len(run.cycles)]
    assert len(run.cycles) > 0 or not full


def test_can_traffic_is_recorded_frame_by_frame(tmp_path: Path) -> None:
    scene, entry = short_scene(FREE), find_device("quanser_st3")
    options = argparse.Namespace(bus="virtual", channel="test-can-traffic", bus_option=[])
    writer = RunWriter(tmp_path / "run.mcap", {})
    with connect(options, scene, entry, entry.capacity) as link:
        link.bus.tap = CanTap(writer)
        with link.table as table:
            table.enable(0.0)
            motion = rehearse(scene, entry.capacity).motion
            report = perform(table, motion, live_twin(scene), writer, ManualClock())
            table.disable()
    writer.finish()
    run = read_run(writer.path)
    traffic = list(frames(run))
    assert run.complete
    assert len(run.cycles) == report.executed
    # CiA 301 and 402: SYNC is 080; the drive, node 1, answers with 181: statusword and position in nm.
    syncs = [frame for frame in traffic if (frame.identifier, frame.sent) == (0x080, True)]
    answers = [frame for frame in traffic if (frame.identifier, frame.sent) == (0x181, False)]
    assert len(answers) == len(syncs) >= report.executed
    positions = {int.from_bytes(frame.data[2:6], "little", signed=True) for frame in answers}
    assert {round(position * 1e9) for position in run.cycles.position.tolist()} <= positions
    assert all(a.host_time_ns <= b.host_time_ns for a, b in itertools.pairwise(traffic))


def test_the_traffic_leaves_by_the_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    writer = RunWriter(tmp_path / "run.mcap", {})
    tap = CanTap(writer)
    tap(1_760_000_000.25, 0x080, b"\x07", True)
    writer.finish()
    assert main(["export", "run.mcap", "--to", "blf", "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["files"] == ["run.blf"]
    with can.LogReader("run.blf") as log:
        assert [(message.arbitration_id, bytes(message.data)) for message in log] == [(0x080, b"\x07")]
    RunWriter(tmp_path / "silent.mcap", {}).finish()
    assert main(["export", "silent.mcap", "--to", "blf"]) == 2
    assert "silent.mcap has no CAN traffic" in capsys.readouterr().err
