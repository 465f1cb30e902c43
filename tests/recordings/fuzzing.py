"""Read mutated recordings and judge what comes back: a run or one sentence, within time, and nothing made up."""

from __future__ import annotations

import random
import tempfile
import time
from bisect import bisect_right
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from mcap.opcode import Opcode

from recordings import RecordingError, Run, cycle_blocks, read_run, recover
from tests.recordings.mutations import FORGED, HARMLESS, split_file, write_reference
from twin.cycle import CycleRecord

if TYPE_CHECKING:
    from collections.abc import Iterable

FASTEST_DISKS = (Path("/dev/shm"),)  # noqa: S108 - a file of ours in a folder of ours
TIME_LIMIT = 20.0
"""Most time for one file, s."""
RECOVER_EVERY = 10
"""Every so many files are also recovered, and read in blocks."""


@dataclass
class Fuzzed:
    """What came of it: `recovered` cycles were read of those `written`; of a file that was cut, of those in front."""

    files: Counter[str] = field(default_factory=Counter[str])
    opened: Counter[str] = field(default_factory=Counter[str])
    written: Counter[str] = field(default_factory=Counter[str])
    recovered: Counter[str] = field(default_factory=Counter[str])
    slowest: float = 0.0
    slowest_kind: str = ""

    def lines(self) -> list[str]:
        """A line for each kind of mutation."""
        found = [f"{'mutation':18} {'files':>7} {'opened':>7} {'cycles read':>12} {'written':>9} {'share':>7}"]
        for kind in self.files:
            share = self.recovered[kind] / max(self.written[kind], 1)
            found.append(
                f"{kind:18} {self.files[kind]:7} {self.opened[kind]:7} {self.recovered[kind]:12} "
                f"{self.written[kind]:9} {share:7.1%}"
            )
        return [*found, f"slowest file: {self.slowest * 1e3:.1f} ms ({self.slowest_kind})"]


def fuzz(count: int, seed: int, kinds: Iterable[str] = (*HARMLESS, *FORGED), cycles: int = 60) -> Fuzzed:
    """Mutate and read `count` files; anything but a run or a `RecordingError` is an error here too.

    Raises
    ------
    AssertionError
        A file took too long, or a cycle was read that was never written.
    """
    rng = random.Random(seed)  # noqa: S311
    result, chosen = Fuzzed(), tuple(kinds)
    fast = next((folder for folder in FASTEST_DISKS if folder.is_dir()), None)
    with tempfile.TemporaryDirectory(dir=fast) as name:
        folder = Path(name)
        expected = {_bits(record) for record in write_reference(folder / "reference.mcap", cycles)}
        original = (folder / "reference.mcap").read_bytes()
        ends = _cycle_ends(original, folder)
        for number in range(count):
            kind = chosen[number % len(chosen)]
            data = {**HARMLESS, **FORGED}[kind](original, rng)
            path = folder / "fuzzed.mcap"
            path.write_bytes(data)
            began = time.perf_counter()
            run = _read(path)
            if number % RECOVER_EVERY == 0:
                _read_otherwise(path, run, f"file {number} ({kind})", forged=kind in FORGED)
            took = time.perf_counter() - began
            assert took < TIME_LIMIT, f"file {number} ({kind}) took {took:.1f} s"
            if took > result.slowest:
                result.slowest, result.slowest_kind = took, kind
            result.files[kind] += 1
            result.written[kind] += bisect_right(ends, len(data)) if kind == "cut" else cycles
            if run is not None:
                result.opened[kind] += 1
                found = {_bits(record) for record in run.cycles}
                result.recovered[kind] += len(found & expected)
                assert kind in FORGED or found <= expected, f"file {number} ({kind}) has cycles that nobody wrote"
    return result


def _cycle_ends(data: bytes, folder: Path) -> list[int]:
    """Where, in the file, each cycle's chunk ends."""
    ends: list[int] = []
    offset, beginning = 8, folder / "beginning.mcap"
    for opcode, body in split_file(data):
        offset += 9 + len(body)
        if opcode == Opcode.CHUNK:
            beginning.write_bytes(data[:offset])
            ends += [offset] * (len(read_run(beginning).cycles) - len(ends))
    return ends


def _bits(record: CycleRecord) -> tuple[object, ...]:
    return (record.cycle, record.host_time_ns, record.status, *map(float.hex, _numbers(record)))


def _numbers(record: CycleRecord) -> list[float]:
    return [
        record.time,
        record.lateness,
        record.target_position,
        record.position,
        record.acceleration,
        record.rotation,
        record.predicted_rotation,
        record.predicted_angular_velocity,
    ]


def _read(path: Path) -> Run | None:
    try:
        return read_run(path)
    except RecordingError:
        return None


def _read_otherwise(path: Path, run: Run | None, what: str, *, forged: bool) -> None:
    """Read in blocks, and recover; without forgery a clean file has the cycles of the damaged one."""
    with suppress(RecordingError):
        for block in cycle_blocks(path):
            assert len(block)
    clean = path.with_name("clean.mcap")
    clean.unlink(missing_ok=True)
    with suppress(RecordingError):
        recover(path, clean)
        again = _read(clean)
        assert forged or (again is not None and run is not None), f"{what} is not recovered"
        assert forged or list(map(_bits, again.cycles)) == list(map(_bits, run.cycles)), f"{what} is recovered wrongly"
