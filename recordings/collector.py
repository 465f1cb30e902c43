"""Take the records of a file as they come, and keep what a run needs."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema

from recordings.columns import Column, Layout
from recordings.decompression import DamagedChunkError
from recordings.errors import RecordingError
from recordings.foxglove import LOG_SCHEMA
from recordings.records import split
from recordings.run import schema_version
from recordings.scan import parse
from recordings.schema import (
    CYCLE,
    CYCLE_TOPICS,
    EVENT_TIME,
    EVENTS_TOPIC,
    MISSED,
    SCHEMA_METADATA,
    TOPICS,
    VERSION,
)

if TYPE_CHECKING:
    from recordings.scan import Scan

BLOCK_SIZE = 1024 * 1024
"""Bytes of records that are split at once: enough that numpy's own time does not count."""

_HEADER = struct.Struct("<BQ")
_STAMPS = {topic.name: ("sequence",) for topic in CYCLE_TOPICS} | {
    CYCLE.name: ("sequence", "log_time"),
    MISSED.name: ("log_time",),
    EVENT_TIME.name: ("sequence",),
}


class Collector:
    """What was found in a file so far.

    Parameters
    ----------
    name : str
        The file's, for sentences.
    scan : Scan

    Attributes
    ----------
    metadata : dict of str to dict of str to str
    columns : dict of str to Column
        By topic, of every topic of ours.
    logs : list of bytes
        Bodies of the messages in /events.
    counts : dict of str to int
        Messages by topic.
    wrong : dict of str to str
        Topics of ours with another message in them, and the sentence about it.
    """

    def __init__(self, name: str, scan: Scan) -> None:
        self.metadata: dict[str, dict[str, str]] = {}
        self.columns = {
            topic.name: Column(topic, _STAMPS[topic.name]) if topic.name in _STAMPS else Column(topic)
            for topic in TOPICS
        }
        self.logs: list[bytes] = []
        self.counts: dict[str, int] = {}
        self.wrong: dict[str, str] = {}
        self._name = name
        self._scan = scan
        self._block: list[bytes] = []
        self._size = 0
        self._schemas: dict[int, Schema] = {}
        self._channels: dict[int, Channel] = {}
        self._layouts: dict[int, Layout] = {}
        self._definitions: dict[tuple[int, bytes], bytes] = {}

    def take(self, opcode: int, body: bytes) -> bool:
        """Take a record; True where columns have grown by a block."""
        if opcode == Opcode.CHUNK:
            return self._keep(body)
        if opcode == Opcode.MESSAGE:
            return self._keep(_HEADER.pack(opcode, len(body)) + body)
        # What stands before this record was written before it.
        grown = self._size > 0
        self.flush()
        self._define(opcode, body, proven=False)
        return grown

    def flush(self) -> None:
        """Split what is still together."""
        block, self._block, self._size = self._block, [], 0
        if not block:
            return
        try:
            self._add(b"".join(block))
        except DamagedChunkError:
            for plain in block:
                try:
                    self._add(plain)
                except DamagedChunkError:
                    self._scan.damaged_chunks += 1

    def _keep(self, records: bytes) -> bool:
        self._block.append(records)
        self._size += len(records)
        if self._size < BLOCK_SIZE:
            return False
        self.flush()
        return True

    def _add(self, plain: bytes) -> None:
        messages, others = split(plain)
        for opcode, body in others:
            if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(opcode, body, proven=True)
        for channel in np.unique(messages.channels).tolist():
            if channel not in self._channels:
                continue
            topic = self._channels[channel].topic
            chosen = np.flatnonzero(messages.channels == channel)
            self.counts[topic] += chosen.size
            if channel in self._layouts:
                self._layouts[channel].add(messages, chosen)
            elif topic == EVENTS_TOPIC and topic not in self.wrong:
                bounds = zip(messages.starts[chosen].tolist(), messages.ends[chosen].tolist(), strict=True)
                self.logs += [messages.plain[start:end] for start, end in bounds]

    def _define(self, opcode: int, body: bytes, *, proven: bool) -> None:
        if opcode == Opcode.METADATA:
            if record := parse(Metadata.read, body, self._scan):
                self._describe(record)
            return
        # Definitions come more than once; those in chunks have a checksum, and one that has none replaces no other.
        place = (opcode, body[:2])
        known = self._definitions.get(place)
        if known == body or (known is not None and not proven):
            return
        self._definitions[place] = body
        if opcode == Opcode.SCHEMA and (schema := parse(Schema.read, body, self._scan)):
            self._schemas[schema.id] = schema
            for channel in [channel for channel in self._channels.values() if channel.schema_id == schema.id]:
                self._open(channel, proven=proven)
        elif opcode == Opcode.CHANNEL and (channel := parse(Channel.read, body, self._scan)):
            self._forget(channel.id)
            self._open(channel, proven=proven)

    def _describe(self, record: Metadata) -> None:
        self.metadata.setdefault(record.name, {}).update(record.metadata)
        if record.name == SCHEMA_METADATA:
            major = record.metadata.get("major", "")
            if major.isdecimal() and int(major[:9]) > VERSION[0]:
                raise RecordingError(
                    f"{self._name} has schema version {major}; this version of shake-table-twin reads up to "
                    f"{VERSION[0]}"
                )

    def _forget(self, number: int) -> None:
        """Forget what a channel was said to be, where nothing came of it."""
        old = self._channels.pop(number, None)
        if old is None or self.counts[old.topic] or old.topic in (other.topic for other in self._channels.values()):
            return
        del self.counts[old.topic]
        self.wrong.pop(old.topic, None)

    def _open(self, channel: Channel, *, proven: bool) -> None:
        topic = channel.topic
        self._channels[channel.id] = channel
        self.counts.setdefault(topic, 0)
        self._layouts.pop(channel.id, None)
        if topic not in self.columns and topic != EVENTS_TOPIC:
            return
        schema = self._schemas.get(channel.schema_id)
        found = schema.name if schema else "no schema"
        expected = self.columns[topic].topic.schema_name if topic in self.columns else LOG_SCHEMA
        if schema is None or found != expected or (schema.encoding, channel.message_encoding) != ("protobuf",) * 2:
            self.wrong[topic] = f"{self._name} has {found!r} in topic {topic}, not {expected!r} in protobuf"
            return
        if topic in self.columns:
            try:
                whole = not proven and schema_version(self.metadata) >= VERSION
                self._layouts[channel.id] = Layout(self.columns[topic], schema.data, whole=whole)
            except ValueError as error:
                self.wrong[topic] = f"{self._name} has another {expected} in topic {topic}: {error}"
                return
        self.wrong.pop(topic, None)
