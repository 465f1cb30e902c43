"""Make a clean, indexed file of a recording that was cut off or damaged, and say what was lost."""

from __future__ import annotations

import struct
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics

from recordings.chunked_file import HEADER_LENGTH, ChunkedFile
from recordings.decompression import DamagedChunkError
from recordings.descriptors import descriptor_set
from recordings.disk_file import DiskFile
from recordings.errors import RecordingError
from recordings.reader import read_run, records_of
from recordings.records import split
from recordings.scan import Scan, parse
from recordings.schema import CYCLE_TOPICS, RECOVERY_METADATA, SCHEMA_METADATA
from recordings.writer import LIBRARY

if TYPE_CHECKING:
    from collections.abc import Callable

    from recordings.records import Messages
    from recordings.run import Run

_LOG_TIME = struct.Struct("<6xQ")
"""In the body of a message record."""


@dataclass(frozen=True)
class Recovery:
    """What `recover` saved, and what it could not.

    Attributes
    ----------
    path, out : Path
        The damaged and the clean file.
    written : mapping of str to int
        Messages in the clean file, by topic.
    lost : mapping of str to int
        Messages known to be lost, by topic: those that the damaged file's own statistics or indices speak of, and the
        cycles missing among the others. What an unfinished end would have held is not known to anybody.
    cycles, cycles_lost : int
        Cycles that are whole, and cycle numbers between the first and the last that are neither there nor recorded as
        missed.
    duration, duration_lost : float
        From the first to the last cycle, and of the cycles lost, s, on the table's clock.
    damaged_chunks : int
    bytes_left : int
        Bytes of the damaged file that are in no whole record.
    cut : bool
        Whether the file ends before its data do.
    problems : tuple of str
        What was wrong with the damaged file, each a clause; empty where nothing was.
    """

    path: Path
    out: Path
    written: dict[str, int]
    lost: dict[str, int]
    cycles: int
    cycles_lost: int
    duration: float
    duration_lost: float
    damaged_chunks: int
    bytes_left: int
    cut: bool
    problems: tuple[str, ...]

    @property
    def complete(self) -> bool:
        """Whether nothing was wrong."""
        return not self.problems


def recover(path: Path | str, out: Path | str, *, disk: Callable[[Path, str], DiskFile] = DiskFile) -> Recovery:
    """Copy every whole message and metadata record of `path` to a new file with an index.

    Messages are copied as they are, those of topics that nobody here knows too. `disk` opens the new file; tests give
    one that fails.

    Raises
    ------
    RecordingError
        `path` is no recording (as of `read_run`) or has nothing in it; `out` exists or cannot be written.
    """
    path, out = Path(path), Path(out)
    run = read_run(path)
    if not (run.topics or run.metadata):
        raise RecordingError(f"{path} holds nothing that could be recovered")
    try:
        file = disk(out, "xb")
    except FileExistsError:
        raise RecordingError(f"{out} exists already and is not overwritten") from None
    except OSError as error:
        raise RecordingError(f"{out} cannot be written: {error.strerror}") from None
    try:
        with file:
            return _recover(path, run, file, out)
    except OSError as error:
        out.unlink(missing_ok=True)
        raise RecordingError(f"{out} cannot be written: {error.strerror}") from None


def _recover(path: Path, run: Run, file: DiskFile, out: Path) -> Recovery:
    scan = Scan()
    copy = _Copy(ChunkedFile(file, LIBRARY), scan)
    for opcode, body in records_of(path, scan):
        copy.take(opcode, body)
    lost = copy.lost()
    gaps = _cycles_lost(run) if scan.passed_over or scan.damaged_chunks else 0
    problems = run.problems
    if scan.attachments:
        problems = (*problems, f"{scan.attachments} attachments are not copied")
    times = run.cycles.time[np.isfinite(run.cycles.time)]
    step = float(np.median(np.diff(times))) if times.size > 1 else 0.0
    recovery = Recovery(
        path=path,
        out=out,
        written=copy.written(),
        lost=lost,
        cycles=len(run.cycles),
        cycles_lost=gaps,
        duration=float(times[-1] - times[0]) if times.size else 0.0,
        duration_lost=gaps * step,
        damaged_chunks=scan.damaged_chunks,
        bytes_left=scan.passed_over + (0 if scan.ended else scan.size - scan.end),
        cut=not scan.data_ended,
        problems=problems,
    )
    copy.finish(_as_metadata(recovery))
    return recovery


class _Copy:
    """Copies records into a new file; a channel is defined there when its first message comes."""

    def __init__(self, file: ChunkedFile, scan: Scan) -> None:
        self._file = file
        self._scan = scan
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._new_schemas: dict[int, int] = {}
        self._new_channels: dict[int, int] = {}
        self._counts: dict[int, int] = defaultdict(int)
        self._written: dict[str, int] = defaultdict(int)
        self._stated: dict[int, int] = {}
        self._ours = False

    def take(self, opcode: int, body: bytes) -> None:
        """Copy a record, or the records of a chunk."""
        if opcode == Opcode.CHUNK:
            try:
                messages, others = split(body)
            except DamagedChunkError:
                self._scan.damaged_chunks += 1
                return
            for kind, definition in others:
                self._define(kind, definition, proven=True)
            self._add(messages)
        elif opcode == Opcode.MESSAGE:
            messages, _ = split(opcode.to_bytes(1) + len(body).to_bytes(8, "little") + body)
            self._add(messages)
        elif opcode == Opcode.METADATA:
            if record := parse(Metadata.read, body, self._scan):
                self._ours |= record.name == SCHEMA_METADATA
                self._file.metadata(record.name, record.metadata)
        elif opcode == Opcode.STATISTICS:
            if record := parse(Statistics.read, body, self._scan):
                self._stated = record.channel_message_counts
        else:
            self._define(opcode, body, proven=False)

    def written(self) -> dict[str, int]:
        """Messages copied, by topic."""
        return dict(self._written)

    def lost(self) -> dict[str, int]:
        """Messages that the file speaks of and does not hold, by topic."""
        stated = {channel: count - self._counts[channel] for channel, count in self._stated.items()}
        found: dict[str, int] = defaultdict(int)
        for channel, count in (stated or self._scan.damaged_messages).items():
            if count > 0 and channel in self._channels:
                found[self._channels[channel].topic] += count
        return dict(found)

    def finish(self, metadata: dict[str, str]) -> None:
        """Define what had no message, and in a recording of ours what it cannot be without, and close the file."""
        for channel in self._channels:
            self._open(channel)
        there = {channel.topic for channel in self._channels.values()}
        for topic in CYCLE_TOPICS:
            if self._ours and topic.name not in there:
                self._file.channel(topic.name, self._file.schema(topic.schema_name, descriptor_set(topic)))
        self._file.metadata(RECOVERY_METADATA, metadata)
        self._file.finish()

    def _define(self, opcode: int, body: bytes, *, proven: bool) -> None:
        # As of `Collector`: definitions in chunks have a checksum, and one that has none replaces no other.
        if opcode == Opcode.SCHEMA and (schema := parse(Schema.read, body, self._scan)):
            known = self._schemas.get(schema.id)
            if known is None or (proven and known != schema):
                self._schemas[schema.id] = schema
                self._new_schemas.pop(schema.id, None)
        elif opcode == Opcode.CHANNEL and (channel := parse(Channel.read, body, self._scan)):
            known = self._channels.get(channel.id)
            if known is None or (proven and known != channel):
                self._channels[channel.id] = channel
                self._new_channels.pop(channel.id, None)

    def _open(self, channel: int) -> int:
        if channel not in self._new_channels:
            old = self._channels[channel]
            if old.schema_id not in self._new_schemas and (schema := self._schemas.get(old.schema_id)):
                self._new_schemas[old.schema_id] = self._file.schema(schema.name, schema.data, schema.encoding)
            schema_id = self._new_schemas.get(old.schema_id, 0)
            self._new_channels[channel] = self._file.channel(old.topic, schema_id, old.metadata, old.message_encoding)
        return self._new_channels[channel]

    def _add(self, messages: Messages) -> None:
        plain = messages.plain
        rows = zip(messages.starts.tolist(), messages.ends.tolist(), messages.channels.tolist(), strict=True)
        for start, end, channel in rows:
            if channel not in self._channels:
                continue
            new = self._open(channel)
            record = plain[start - HEADER_LENGTH : start] + new.to_bytes(2, "little") + plain[start + 2 : end]
            self._file.add(new, _LOG_TIME.unpack_from(plain, start)[0], record)
            self._counts[channel] += 1
            self._written[self._channels[channel].topic] += 1
            if self._file.full:
                self._file.flush()


def _cycles_lost(run: Run) -> int:
    numbers = run.cycles.cycle
    if not numbers.size:
        return 0
    first, last = int(numbers.min()), int(numbers.max())
    missed = sum(max(min(gap.last, last) - max(gap.first, first) + 1, 0) for gap in run.missed)
    return max(last - first + 1 - int(np.unique(numbers).size) - missed, 0)


def _as_metadata(recovery: Recovery) -> dict[str, str]:
    return {
        "from": recovery.path.name,
        "problems": "; ".join(recovery.problems),
        "cycles": str(recovery.cycles),
        "cycles_lost": str(recovery.cycles_lost),
        "seconds_lost": repr(recovery.duration_lost),
        "messages_lost": "; ".join(f"{topic} {count}" for topic, count in recovery.lost.items()),
        "damaged_chunks": str(recovery.damaged_chunks),
        "bytes_left": str(recovery.bytes_left),
    }
