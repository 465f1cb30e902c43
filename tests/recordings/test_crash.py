"""Killed, without power, on a full disk: what was written before is there, and the file opens."""

from __future__ import annotations

import os
import random
import signal
import struct
import subprocess
import sys
from contextlib import suppress
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from recordings import Recorder, RecordingError, RunWriter, read_run
from recordings.writer import FLUSH_INTERVAL, SYNC_INTERVAL
from tests.recordings.disk_faults import FullDisk, PowerCut
from twin.cycle import CycleRecord

if TYPE_CHECKING:
    from conftest import MakeRecords

    from recordings import Geometry

ROOT = Path(__file__).resolve().parents[2]
WRITING = """
import mmap, struct, sys
from pathlib import Path
from recordings import Geometry, RunWriter
from twin.cycle import CycleRecord
with open(sys.argv[2], "r+b") as shared:
    progress = mmap.mmap(shared.fileno(), 8)
writer = RunWriter(Path(sys.argv[1]), {"scene": {"name": "b6l"}}, Geometry(0.06, 0.27))
for k in range(10**9):
    writer.cycle(CycleRecord(k, k * 1e-3, 1_760_000_000_000_000_000 + k * 1_000_000, *[k * 1e-6] * 7, 0x1237))
    writer.tick(k * 1e-3)
    progress[:] = struct.pack("<Q", k + 1)
"""


@pytest.mark.parametrize("seed", range(4))
def test_a_killed_writer_loses_a_tenth_of_a_second(tmp_path: Path, seed: int) -> None:
    """SIGKILL at a random moment; time is the samples' own, so the machine's speed does not matter."""
    progress = tmp_path / "progress"
    progress.write_bytes(bytes(8))
    path = tmp_path / "run.mcap"
    with subprocess.Popen([sys.executable, "-c", WRITING, path, progress], cwd=ROOT) as child:
        least = random.Random(seed).randrange(50, 4000)  # noqa: S311
        while child.poll() is None and _count(progress) < least:
            os.sched_yield()
        assert child.poll() is None
        child.kill()
    emitted = _count(progress)
    run = read_run(path)
    assert [record.cycle for record in run.cycles] == list(range(len(run.cycles)))
    # 50 ms of the interval and the cycle in which it was over.
    assert emitted - len(run.cycles) <= FLUSH_INTERVAL * 1000 + 1
    assert least <= emitted
    assert "ends early" in run.problems[0]


def _count(progress: Path) -> int:
    (count,) = struct.unpack("<Q", progress.read_bytes())
    return count


@pytest.mark.parametrize("cut_after", [1, 60, 130, 299, 300, 555, 1000, 1777])
def test_a_power_cut_loses_two_tenths_of_a_second(
    tmp_path: Path, make_records: MakeRecords, geometry: Geometry, cut_after: int
) -> None:
    disks: list[PowerCut] = []

    def disk(path: Path, mode: str) -> PowerCut:
        disks.append(PowerCut(path, mode))
        return disks[0]

    records = make_records(cut_after)
    writer = RunWriter(tmp_path / "run.mcap", {"scene": {"name": "b6l"}}, geometry, disk=disk)
    for record in records:
        writer.cycle(record)
        writer.tick(record.time)
    found = tmp_path / "found.mcap"
    found.write_bytes(disks[0].after_a_power_cut())
    run = read_run(found)
    assert list(run.cycles) == records[: len(run.cycles)]
    assert len(run.cycles) == writer.safe
    assert cut_after - len(run.cycles) <= min(SYNC_INTERVAL, 0.2) * 1000
    assert run.metadata["scene"] == {"name": "b6l"}
    writer.finish()


def _write_until_full(path: Path, records: list[CycleRecord], geometry: Geometry, room: int) -> int:
    """Write as `recordings.consumer` does; return how many values were safe before the disk was full."""
    writer = RunWriter(path, {}, geometry, disk=partial(FullDisk, room=room))
    try:
        for record in records:
            writer.cycle(record)
            writer.tick(record.time)
        writer.finish({"verdict": {"outcome": "ROCKED"}})
    except OSError:
        with suppress(OSError):
            writer.finish({"recorder": {"failure": "recording stopped: No space left on device"}})
    return writer.safe


def test_a_disk_that_is_full_at_any_byte_costs_nothing_written_before(
    tmp_path: Path, make_records: MakeRecords, geometry: Geometry
) -> None:
    records = make_records(400)
    _write_until_full(tmp_path / "whole.mcap", records, geometry, 10**9)
    whole = (tmp_path / "whole.mcap").stat().st_size
    begun = 0
    for room in [*range(0, whole, 1499), *range(whole - 60, whole + 1)]:
        path = tmp_path / f"{room}.mcap"
        try:
            safe = _write_until_full(path, records, geometry, room)
        except RecordingError:
            # Not even the beginning fits; the run does not start, and leaves nothing behind.
            assert room < 20_000
            assert not path.exists()
            continue
        begun += 1
        assert path.stat().st_size <= room
        run = read_run(path)
        got = list(run.cycles)
        assert got == records[: len(got)]
        assert len(got) >= safe
        # Nothing but a whole record is ever left at the end.
        assert not run.problems or run.problems[0].startswith(("it ends early", "recording stopped"))
        assert run.complete == (room == whole)
        path.unlink()
    assert begun > 100


def test_a_disk_that_has_room_again_gets_its_end(tmp_path: Path, make_records: MakeRecords, geometry: Geometry) -> None:
    disk: list[FullDisk] = []

    def open_disk(path: Path, mode: str) -> FullDisk:
        disk.append(FullDisk(path, mode, 60_000))
        return disk[0]

    writer = RunWriter(tmp_path / "run.mcap", {}, geometry, disk=open_disk)
    records = make_records(1000)

    def write() -> None:
        for record in records:
            writer.cycle(record)
            writer.tick(record.time)

    with pytest.raises(OSError, match="No space left"):
        write()
    disk[0].room = 10**9
    writer.finish({"recorder": {"failure": "recording stopped: No space left on device"}})
    run = read_run(writer.path)
    assert run.problems == ("recording stopped: No space left on device",)
    # The chunk that did not fit was kept, and is there now.
    assert len(run.cycles) == writer.safe == writer.written
    assert list(run.cycles) == records[: writer.written]


LIMITED = """
import resource, sys
from pathlib import Path
from recordings import Recorder, read_run
from twin.cycle import CycleRecord

if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_FSIZE, (50_000, resource.RLIM_INFINITY))
    recorder = Recorder(Path(sys.argv[1]), {})
    for k in range(5000):
        recorder.cycle(CycleRecord(k, k * 1e-3, 1_760_000_000_000_000_000 + k * 1_000_000, *[k * 1e-6] * 7, 0x1237))
        if not recorder.alive:
            break
    report = recorder.finish()
    run = read_run(report.path)
    print(report.failure)
    print(len(run.cycles) >= report.written, 0 < len(run.cycles) < 5000, run.problems)
"""


@pytest.mark.skipif(not hasattr(signal, "SIGXFSZ"), reason="this system has no limit on the size of a file")
def test_a_real_process_at_its_file_limit(tmp_path: Path) -> None:
    script = tmp_path / "limited.py"
    script.write_text(LIMITED)
    done = subprocess.run(
        [sys.executable, script, tmp_path / "run.mcap"],
        capture_output=True,
        text=True,
        timeout=60,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    said, found = done.stdout.splitlines()
    assert said == "the recorder process stopped: File too large"
    assert found.startswith("True True ('")


def test_files_cut_at_every_byte_of_the_last_chunks_open(tmp_path: Path, make_records: MakeRecords) -> None:
    expected = make_records(12)
    writer = RunWriter(tmp_path / "run.mcap", {})
    ends: list[int] = []
    for record in expected:
        writer.cycle(record)
        writer.tick(record.cycle)
        ends.append(writer.path.stat().st_size)
    writer.finish()
    data = writer.path.read_bytes()
    cut = tmp_path / "cut.mcap"
    # Each cycle is a chunk of its own here.
    for offset in [*range(ends[-4], ends[-1] + 1), *range(ends[-1], len(data), 29)]:
        cut.write_bytes(data[:offset])
        run = read_run(cut)
        assert not run.complete
        assert run.problems
        whole = sum(end <= offset for end in ends)
        # A chunk is there before its index is.
        assert list(run.cycles) in (expected[:whole], expected[: whole + 1])


def test_a_new_file_is_in_its_folder_after_a_power_cut(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    synced: list[str] = []
    if not Path("/proc/self/fd").exists():
        pytest.skip("this system does not say what a descriptor is of")
    monkeypatch.setattr(os, "fsync", lambda number: synced.append(str(Path(f"/proc/self/fd/{number}").readlink())))
    RunWriter(tmp_path / "run.mcap", {}).finish()
    assert synced[:2] == [str(tmp_path / "run.mcap"), str(tmp_path)]
    assert synced.count(str(tmp_path)) == 1


def test_a_recorder_whose_disk_is_full_says_so_and_keeps_what_it_had(
    tmp_path: Path, make_records: MakeRecords, geometry: Geometry
) -> None:
    recorder = Recorder(tmp_path / "run.mcap", {}, geometry, disk=partial(FullDisk, room=80_000))
    records = make_records(5000)
    for record in records:
        recorder.cycle(record)
    recorder._thread.join(20.0)
    assert not recorder.alive
    report = recorder.finish()
    assert report.failure == "the recorder process stopped: No space left on device"
    run = read_run(report.path)
    assert 0 < report.written == len(run.cycles)
    assert report.written + report.lost == 5000
    assert list(run.cycles) == records[: len(run.cycles)]
