"""Read a recording back: whole, truncated or damaged, always a `Run` or one sentence."""

from __future__ import annotations

import struct
from collections import defaultdict
from functools import reduce
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from recordings.descriptors import mismatch, parse_fields
from recordings.errors import RecordingError
from recordings.foxglove import LOG_SCHEMA, parse_log
from recordings.run import Cycles, Run
from recordings.scan import Scan, check_magic, parse, walk
from recordings.schema import (
    BLOCK_MEASURED,
    BLOCK_PREDICTED,
    CYCLE,
    CYCLE_TOPICS,
    EVENT_TIME,
    EVENTS_TOPIC,
    FAILURE_KEY,
    MISSED,
    RECORDER_METADATA,
    SCHEMA_METADATA,
    TABLE_MEASURED,
    TABLE_TARGET,
    TOPICS,
    VERSION,
    Topic,
)
from twin.cycle import Event, Missed

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

_MESSAGE_HEAD = struct.Struct("<HIQQ")
_CHANNEL_BYTES = 2
_STAMPS = [("sequence", "<u4"), ("log_time", "<u8"), ("publish_time", "<u8")]


class _Column:
    """Messages of one topic of ours, collected as raw rows: sequence, the two times, the payload."""

    def __init__(self, topic: Topic) -> None:
        self.topic = topic
        self.undecoded = 0
        self._rows = bytearray()
        self._row = np.dtype(_STAMPS + topic.columns)
        self._regular_length = _CHANNEL_BYTES + self._row.itemsize
        self._payload = struct.Struct(topic.struct_format)

    def add(self, body: bytes) -> None:
        """Append a message record."""
        if len(body) == self._regular_length:
            self._rows += body[_CHANNEL_BYTES:]
        elif (payload := self._normal(body[_MESSAGE_HEAD.size :])) is not None:
            self._rows += body[_CHANNEL_BYTES : _MESSAGE_HEAD.size] + payload

    def table(self) -> NDArray[np.void]:
        """All rows, one column for each field."""
        rows = np.frombuffer(self._rows, dtype=self._row)
        keys = zip((name for name, _ in self.topic.columns[::2]), self.topic.tags, strict=True)
        irregular = reduce(np.logical_or, (rows[name] != tag for name, tag in keys))
        keep = np.ones(rows.size, dtype=np.bool_)
        for index in np.flatnonzero(irregular):
            start = index * self._row.itemsize + _MESSAGE_HEAD.size - _CHANNEL_BYTES
            stop = (index + 1) * self._row.itemsize
            payload = self._normal(bytes(self._rows[start:stop]))
            if payload is None:
                keep[index] = False
            else:
                rows[index] = np.frombuffer(self._rows[start - 20 : start] + payload, dtype=self._row)[0]
        return rows[keep]

    def _normal(self, payload: bytes) -> bytes | None:
        # Another writer, or a newer minor version: fields in another order, left out at zero, or more than we know.
        try:
            values = parse_fields(self.topic, payload)
        except ValueError:
            self.undecoded += 1
            return None
        return self._payload.pack(*(part for pair in zip(self.topic.tags, values, strict=True) for part in pair))


class _Collector:
    """Takes the records of a file as they come and keeps what a `Run` needs."""

    def __init__(self, name: str, scan: Scan) -> None:
        self.name = name
        self.metadata: dict[str, dict[str, str]] = {}
        self.columns = {topic.name: _Column(topic) for topic in TOPICS}
        self.logs: list[bytes] = []
        self.counts: dict[int, int] = defaultdict(int)
        self.channels: dict[int, str] = {}
        self._scan = scan
        self._schemas: dict[int, Schema] = {}
        self._add: dict[int, Callable[[bytes], None]] = {}

    def take(self, opcode: int, body: bytes) -> None:
        if opcode == Opcode.MESSAGE:
            channel = int.from_bytes(body[:_CHANNEL_BYTES], "little")
            if len(body) >= _MESSAGE_HEAD.size and channel in self.channels:
                self.counts[channel] += 1
                if add := self._add.get(channel):
                    add(body)
        elif opcode == Opcode.METADATA:
            if record := parse(Metadata.read, body, self._scan):
                self._describe(record)
        elif opcode == Opcode.SCHEMA:
            if schema := parse(Schema.read, body, self._scan):
                self._schemas[schema.id] = schema
        elif opcode == Opcode.CHANNEL and (channel := parse(Channel.read, body, self._scan)):
            self._open(channel)

    def _describe(self, record: Metadata) -> None:
        self.metadata.setdefault(record.name, {}).update(record.metadata)
        if record.name == SCHEMA_METADATA:
            major = record.metadata.get("major", "")
            if major.isdecimal() and int(major[:9]) > VERSION[0]:
                raise RecordingError(
                    f"{self.name} has schema version {major}; this version of shake-table-twin reads up to {VERSION[0]}"
                )

    def _open(self, channel: Channel) -> None:
        self.channels[channel.id] = channel.topic
        topic = channel.topic
        if topic in self.columns:
            expected, add = self.columns[topic].topic.schema_name, self.columns[topic].add
        elif topic == EVENTS_TOPIC:
            expected, add = LOG_SCHEMA, self.logs.append
        else:
            return
        schema = self._schemas.get(channel.schema_id)
        found = schema.name if schema else "no schema"
        if schema is None or found != expected or (schema.encoding, channel.message_encoding) != ("protobuf",) * 2:
            raise RecordingError(f"{self.name} has {found!r} in topic {topic}, not {expected!r} in protobuf")
        wrong = mismatch(self.columns[topic].topic, schema.data) if topic in self.columns else None
        if wrong:
            raise RecordingError(f"{self.name} has another {expected} in topic {topic}: {wrong}")
        self._add[channel.id] = add


def read_run(path: Path | str) -> Run:
    """Read a recording.

    A file that was cut off, or that has damaged chunks, still opens: `Run.complete` is then False, `Run.problems` says
    why, and the cycles that are whole are there.

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
    collector = _Collector(str(path), scan)
    try:
        with path.open("rb") as file:
            check_magic(file, str(path))
            for opcode, body in walk(file, path.stat().st_size, scan):
                collector.take(opcode, body)
    except OSError as error:
        raise RecordingError(f"{path} cannot be read: {error.strerror}") from None
    found = set(collector.channels.values())
    if scan.ended or found:
        for topic in CYCLE_TOPICS:
            # A run that ended before its first value has no chunk, and so no channels: that is an empty run.
            if topic.name not in found and not (not found and SCHEMA_METADATA in collector.metadata):
                raise RecordingError(f"{path} has no topic {topic.name}: it is not the recording of a run")
    return _assemble(path, collector, scan)


def _assemble(path: Path, collector: _Collector, scan: Scan) -> Run:
    tables = {name: column.table() for name, column in collector.columns.items()}
    cycles = _cycles(tables)
    undecoded = sum(column.undecoded for column in collector.columns.values())
    if undecoded:
        scan.problems.append(f"{undecoded} messages cannot be decoded and are left out")
    if failure := collector.metadata.get(RECORDER_METADATA, {}).get(FAILURE_KEY):
        scan.problems.append(failure)
    if np.any(np.diff(cycles.cycle) <= 0):
        scan.problems.append("its cycle numbers do not increase throughout")
    missed = tables[MISSED.name]
    gaps = zip(missed["first"].tolist(), missed["last"].tolist(), missed["log_time"].tolist(), strict=True)
    counts: dict[str, int] = defaultdict(int)
    for channel, topic in collector.channels.items():
        counts[topic] += collector.counts[channel]
    return Run(
        path=path,
        metadata=collector.metadata,
        cycles=cycles,
        events=_events(collector.logs, tables[EVENT_TIME.name]),
        missed=tuple(Missed(first, last, host) for first, last, host in gaps),
        topics=dict(counts),
        complete=not scan.problems,
        problems=tuple(dict.fromkeys(scan.problems)),
    )


def _cycles(tables: dict[str, NDArray[np.void]]) -> Cycles:
    parts = {topic.name: tables[topic.name] for topic in CYCLE_TOPICS}
    numbers = [part["sequence"] for part in parts.values()]
    if any(not np.array_equal(numbers[0], other) for other in numbers[1:]):
        # The end was cut between the messages of one cycle, or a message is damaged: keep the cycles that are whole.
        whole = reduce(np.intersect1d, numbers)
        parts = {name: part[np.unique(part["sequence"], return_index=True)[1]] for name, part in parts.items()}
        parts = {name: part[np.isin(part["sequence"], whole)] for name, part in parts.items()}
        order = np.argsort(parts[CYCLE.name]["cycle"], kind="stable")
        parts = {name: part[order] for name, part in parts.items()}
    cycle, measured, predicted = parts[CYCLE.name], parts[TABLE_MEASURED.name], parts[BLOCK_PREDICTED.name]
    return Cycles(
        cycle=cycle["cycle"].astype(np.int64),
        time=_doubles(cycle["time_s"]),
        host_time_ns=cycle["log_time"].astype(np.int64),
        lateness=_doubles(cycle["lateness_s"]),
        target_position=_doubles(parts[TABLE_TARGET.name]["position_m"]),
        position=_doubles(measured["position_m"]),
        acceleration=_doubles(measured["acceleration_m_s2"]),
        rotation=_doubles(parts[BLOCK_MEASURED.name]["rotation_rad"]),
        predicted_rotation=_doubles(predicted["rotation_rad"]),
        predicted_angular_velocity=_doubles(predicted["angular_velocity_rad_s"]),
        status=measured["statusword"].astype(np.int64),
    )


def _doubles(column: NDArray[np.float64]) -> NDArray[np.float64]:
    # A copy: the rows interleave the columns, and arithmetic on such strides is slow.
    return np.ascontiguousarray(column, dtype=np.float64)


def _events(logs: list[bytes], times: NDArray[np.void]) -> tuple[Event, ...]:
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
