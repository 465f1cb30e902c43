"""Read a recording back: whole, truncated or damaged, always a `Run` or one sentence."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from recordings.collector import Collector
from recordings.columns import increases, matched
from recordings.errors import RecordingError
from recordings.foxglove import parse_log
from recordings.run import Cycles, Run, Series
from recordings.scan import BUFFER, Scan, check_magic, walk
from recordings.schema import (
    BLOCK_MEASURED,
    BLOCK_PREDICTED,
    CYCLE,
    CYCLE_TOPICS,
    EVENT_TIME,
    FAILURE_KEY,
    MISSED,
    RECORDER_METADATA,
    SCHEMA_METADATA,
    TABLE_MEASURED,
    TABLE_TARGET,
    TOPICS,
)
from twin.cycle import Event, Missed

if TYPE_CHECKING:
    from collections.abc import Iterator

    from recordings.columns import Table

_MESSAGE_HEAD = struct.Struct("<HIQQ")
_OPTIONAL = [topic for topic in TOPICS if topic not in (*CYCLE_TOPICS, MISSED, EVENT_TIME)]
_PENDING_LIMIT = 100_000
"""Messages of cycles that are not whole yet, beyond which `cycle_blocks` lets the oldest go."""


def read_run(path: Path | str) -> Run:
    """Read a recording.

    A file that was cut off, or that has damaged chunks, still opens: `Run.complete` is then False, `Run.problems` says
    why, and the cycles that are whole are there. Topics and fields of a newer minor version are passed over.

    Parameters
    ----------
    path : Path or str
        An MCAP file written by `RunWriter` or `Recorder`.

    Returns
    -------
    Run
        Metadata, cycles, events and gaps; every double is bit for bit what was written.

    Raises
    ------
    RecordingError
        The file cannot be read, is no MCAP file, is empty, misses a needed topic, has another message in it, or a
        newer major version of the schema. Nothing else is raised, whatever the bytes are.
    """
    path = Path(path)
    scan = Scan()
    collector = Collector(str(path), scan)
    for opcode, body in records_of(path, scan):
        collector.take(opcode, body)
    collector.flush()
    _check_topics(path, collector, scan)
    return _assemble(path, collector, scan)


def cycle_blocks(path: Path | str) -> Iterator[Cycles]:
    """Read the cycles of a recording block by block, in the order of the file and in constant memory.

    A block is a few thousand cycles. Damage is passed over as by `read_run`; who wants to know of it asks that. A cycle
    is given when its messages have all come: where another tool has put them 100 000 messages apart it is left out.

    Raises
    ------
    RecordingError
        As `read_run`.
    """
    path = Path(path)
    scan = Scan()
    collector = Collector(str(path), scan)
    pending = [collector.columns[topic.name].take() for topic in CYCLE_TOPICS]
    for opcode, body in records_of(path, scan):
        if collector.take(opcode, body):
            cycles, pending = _next_block(collector, pending)
            if len(cycles):
                yield cycles
    collector.flush()
    _check_topics(path, collector, scan)
    cycles, _ = _next_block(collector, pending)
    if len(cycles):
        yield cycles


def records_of(path: Path, scan: Scan) -> Iterator[tuple[int, bytes]]:
    """Yield the records of a file as `recordings.scan.walk` does; RecordingError where it cannot be read."""
    try:
        with path.open("rb", buffering=BUFFER) as file:
            check_magic(file, str(path))
            scan.size = path.stat().st_size
            yield from walk(file, scan)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from None


def _next_block(collector: Collector, pending: list[Table]) -> tuple[Cycles, list[Table]]:
    """Give the cycles that are whole by now, and the messages that wait for the rest of theirs."""
    for column in collector.columns.values():
        if not column.topic.required:
            column.take()
    collector.logs.clear()
    tables: list[Table] = []
    for topic, waiting in zip(CYCLE_TOPICS, pending, strict=True):
        new = collector.columns[topic.name].take()
        tables.append({name: np.concatenate([waiting[name], values]) for name, values in new.items()})
    whole = matched(tables)
    done = whole[0]["sequence"]
    left: list[Table] = []
    for table in tables:
        waits = np.flatnonzero(~np.isin(table["sequence"], done))[-_PENDING_LIMIT:]
        left.append({name: values[waits] for name, values in table.items()})
    return _cycles(whole), left


def _check_topics(path: Path, collector: Collector, scan: Scan) -> None:
    """Raise `RecordingError` where a topic without which nothing can be read is not there, or is another one."""
    for topic in CYCLE_TOPICS:
        if topic.name in collector.wrong:
            raise RecordingError(collector.wrong[topic.name])
    missing = [topic.name for topic in CYCLE_TOPICS if topic.name not in collector.counts]
    ours = SCHEMA_METADATA in collector.metadata
    # A file of ours that was cut among its first definitions, or has none at all, is a run without cycles.
    empty = ours and not (scan.ended and collector.counts)
    if missing and not empty and (scan.ended or collector.counts):
        raise RecordingError(f"{path} has no topic {missing[0]}: it is not the recording of a run")


def _assemble(path: Path, collector: Collector, scan: Scan) -> Run:
    problems = scan.sentences()
    undecoded = sum(column.undecoded for column in collector.columns.values())
    if undecoded:
        problems.append(f"{undecoded} messages cannot be decoded and are left out")
    problems += [f"topic {topic} is left out: {sentence}" for topic, sentence in collector.wrong.items()]
    if failure := collector.metadata.get(RECORDER_METADATA, {}).get(FAILURE_KEY):
        problems.append(failure)
    tables = [collector.columns[topic.name].take() for topic in CYCLE_TOPICS]
    if not increases(tables[-1]["cycle"]):
        problems.append("its cycles are not in order or come twice: they are put in order")
    cycles = _cycles(matched(tables))
    gaps = collector.columns[MISSED.name].take()
    rows = zip(gaps["first"].tolist(), gaps["last"].tolist(), gaps["log_time"].tolist(), strict=True)
    return Run(
        path=path,
        metadata=collector.metadata,
        cycles=cycles,
        events=_events(collector.logs, collector.columns[EVENT_TIME.name].take()),
        missed=tuple(Missed(first, last, host) for first, last, host in rows),
        topics=collector.counts,
        complete=not problems,
        problems=tuple(dict.fromkeys(problems)),
        series=_series(collector),
    )


def _cycles(tables: list[Table]) -> Cycles:
    parts = {topic.name: table for topic, table in zip(CYCLE_TOPICS, tables, strict=True)}
    cycle, measured, predicted = parts[CYCLE.name], parts[TABLE_MEASURED.name], parts[BLOCK_PREDICTED.name]
    return Cycles(
        cycle=cycle["cycle"].view(np.int64),
        time=cycle["time_s"],
        host_time_ns=cycle["log_time"].view(np.int64),
        lateness=cycle["lateness_s"],
        target_position=parts[TABLE_TARGET.name]["position_m"],
        position=measured["position_m"],
        acceleration=measured["acceleration_m_s2"],
        rotation=parts[BLOCK_MEASURED.name]["rotation_rad"],
        predicted_rotation=predicted["rotation_rad"],
        predicted_angular_velocity=predicted["angular_velocity_rad_s"],
        status=measured["statusword"].astype(np.int64),
    )


def _series(collector: Collector) -> dict[str, Series]:
    found: dict[str, Series] = {}
    for topic in _OPTIONAL:
        table = collector.columns[topic.name].take()
        if table["sequence"].size:
            fields = {field.name: table[field.name] for field in topic.fields}
            host, clock = (table[name].view(np.int64) for name in ("log_time", "publish_time"))
            found[topic.name] = Series(topic, table["sequence"], host, clock, fields)
    return found


def _events(logs: list[bytes], times: Table) -> tuple[Event, ...]:
    clock = dict(zip(times["sequence"].tolist(), times["time_s"].tolist(), strict=True))
    events: list[Event] = []
    for body in logs:
        _, sequence, host, _ = _MESSAGE_HEAD.unpack_from(body)
        try:
            level, name, message = parse_log(body[_MESSAGE_HEAD.size :])
        except ValueError:
            continue
        if sequence in clock:
            events.append(Event(clock[sequence], host, level, name, message))
    return tuple(events)
