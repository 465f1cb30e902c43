"""What reading takes: memory by the size of what is asked for, not of the file."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable
from pathlib import Path

import pytest

from recordings import Geometry, RunWriter, cycle_blocks, read_run
from twin.cycle import CycleRecord

ROW = 11 * 8
"""Bytes of a cycle in `Cycles`."""


def _write(path: Path, count: int) -> Path:
    writer = RunWriter(path, {}, Geometry(0.06, 0.27))
    for k in range(count):
        sway = 1e-3 * ((k * 7919) % 1013)
        writer.cycle(CycleRecord(k, k * 1e-3, 1_760_000_000_000_000_000 + k * 1_000_000, *[sway] * 7, 0x1237))
        if k % 50 == 0:
            writer.tick(float(k))
    writer.finish()
    return path


def _peak(read: Callable[[], object]) -> int:
    read()
    tracemalloc.start()
    try:
        kept = read()
        _, peak = tracemalloc.get_traced_memory()
        assert kept is not None
    finally:
        tracemalloc.stop()
    return peak


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """A recording, and one four times as long."""
    folder = tmp_path_factory.mktemp("long")
    return _write(folder / "one.mcap", 15_000), _write(folder / "four.mcap", 60_000)


def test_blocks_take_the_same_memory_however_long_the_file(files: tuple[Path, Path]) -> None:
    one, four = (_peak(lambda path=path: sum(len(block) for block in cycle_blocks(path))) for path in files)
    assert four < 1.15 * one


def test_a_run_takes_little_more_than_its_arrays(files: tuple[Path, Path]) -> None:
    one, four = (_peak(lambda path=path: read_run(path)) for path in files)
    # Beside the arrays: the sequence numbers of the topics that are joined (a quarter), and room to grow into.
    assert four - one < 45_000 * ROW * 1.8
