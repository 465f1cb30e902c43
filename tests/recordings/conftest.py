"""Runs to record: made up, but with every field different."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Protocol

import pytest

from recordings import Geometry, RunWriter
from twin.cycle import CycleRecord, Event, Missed

START_NS = 1_760_000_000_000_000_000
B6L = Geometry(0.06, 0.27)
EVENTS = (
    Event(0.0, START_NS, "info", "phase", "the pulse begins"),
    Event(0.0711387583099853, START_NS + 71_138_758, "info", "uplift", "the block lifted (θ > 0)"),
    Event(0.2, START_NS + 200_000_000, "error", "trip", "command minus feedback is 12 mm; the limit is 10 mm"),
)
GAP = Missed(40, 42, START_NS + 43_000_000)


class MakeRecords(Protocol):
    def __call__(self, count: int = 300) -> list[CycleRecord]: ...


class WriteRun(Protocol):
    def __call__(self, name: str = "run.mcap", count: int = 300) -> Path: ...


def _record(cycle: int) -> CycleRecord:
    time = cycle * 1e-3
    sway = math.sin(7.0 * time)
    return CycleRecord(
        cycle=cycle,
        time=time,
        host_time_ns=START_NS + cycle * 1_000_000 + 137,
        lateness=2.1e-5 + 1e-7 * (cycle % 7),
        target_position=0.02 * sway,
        position=0.0198 * sway,
        acceleration=-0.97 * sway,
        rotation=0.15 * math.cos(5.0 * time),
        predicted_rotation=0.151 * math.cos(5.0 * time),
        predicted_angular_velocity=-0.755 * math.sin(5.0 * time),
        status=0x1237,
    )


@pytest.fixture
def make_records() -> MakeRecords:
    return lambda count=300: [_record(cycle) for cycle in range(count)]


@pytest.fixture
def events() -> tuple[Event, ...]:
    return EVENTS


@pytest.fixture
def gap() -> Missed:
    return GAP


@pytest.fixture
def geometry() -> Geometry:
    return B6L


@pytest.fixture
def write_run(tmp_path: Path, make_records: MakeRecords) -> WriteRun:
    """Write a run with a gap, three events and several chunks, and give its path."""

    def write(name: str = "run.mcap", count: int = 300) -> Path:
        writer = RunWriter(tmp_path / name, {"scene": {"name": "b6l"}}, B6L)
        for record in make_records(count):
            if not GAP.first <= record.cycle <= GAP.last:
                writer.cycle(record)
                writer.tick(record.time)
        writer.missed(GAP)
        for event in EVENTS:
            writer.event(event)
        writer.finish({"statistics": {"overruns": "3"}})
        return writer.path

    return write
