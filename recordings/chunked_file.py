"""An MCAP file that every flush leaves readable to its last byte.

The library's own writer defines channels in the first chunk only, cannot take half a record back where the disk is
full, and ends a chunk in the middle of a cycle. Here definitions stand before the first chunk and in it again, every
write is whole records or nothing, and the caller says where a chunk ends. The records are the library's.
"""

from __future__ import annotations

import struct
import zlib
from collections import defaultdict
from typing import TYPE_CHECKING, Any, cast

import lz4.frame  # pyright: ignore[reportMissingTypeStubs]
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    McapRecord,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.writer import MCAP0_MAGIC

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from recordings.disk_file import DiskFile

CHUNK_SIZE = 65_536
"""Bytes of a chunk before compression; those of one flush may be fewer."""
MESSAGE_HEAD = "<BQHIQQ"
"""Opcode, length of the rest, channel, sequence, log_time, publish_time of a message record; the payload follows."""
MESSAGE_HEAD_LENGTH = struct.calcsize(MESSAGE_HEAD)
HEADER_LENGTH = 9
"""Of every record: opcode and length."""

_COMPRESSION = "lz4"
_compress = cast("Callable[[bytes], bytes]", cast("Any", lz4.frame).compress)


class ChunkedFile:
    """Writes an MCAP file. Every method may raise OSError; the file then ends with its last whole record.

    Parameters
    ----------
    file : DiskFile
        New and empty; it is not closed here.
    library : str
        Who writes, for the header.
    """

    def __init__(self, file: DiskFile, library: str) -> None:
        self._file = file
        self._checksum = 0
        self._schemas: dict[int, bytes] = {}
        self._channels: dict[int, bytes] = {}
        self._counts: dict[int, int] = defaultdict(int)
        self._span: tuple[int, int] | None = None
        # Of the open chunk: its records, their length, and for each channel log_time and offset of its messages.
        self._records: list[bytes] = []
        self._length = 0
        self._messages: dict[int, list[int]] = defaultdict(list)
        # Of the summary.
        self._chunk_indices: list[bytes] = []
        self._metadata_indices: list[bytes] = []
        self._put(MCAP0_MAGIC + _record(Header("", library)))

    @property
    def full(self) -> bool:
        """Whether the open chunk is as large as it should become."""
        return self._length >= CHUNK_SIZE

    def schema(self, name: str, data: bytes, encoding: str = "protobuf") -> int:
        """Define a schema and return its number."""
        number = len(self._schemas) + 1
        self._schemas[number] = self._define(Schema(id=number, name=name, encoding=encoding, data=data))
        return number

    def channel(
        self, topic: str, schema: int, metadata: Mapping[str, str] | None = None, encoding: str = "protobuf"
    ) -> int:
        """Define a channel and return its number."""
        number = len(self._channels) + 1
        record = Channel(
            id=number, topic=topic, message_encoding=encoding, metadata=dict(metadata or {}), schema_id=schema
        )
        self._channels[number] = self._define(record)
        return number

    def add(self, channel: int, log_time: int, record: bytes) -> None:
        """Add a whole message record of `channel` to the open chunk."""
        messages = self._messages[channel]
        messages.append(log_time)
        messages.append(self._length)
        self._records.append(record)
        self._length += len(record)

    def message(self, channel: int, sequence: int, log_time: int, publish_time: int, payload: bytes) -> None:
        """Add a message to the open chunk."""
        length = MESSAGE_HEAD_LENGTH - HEADER_LENGTH + len(payload)
        head = struct.pack(MESSAGE_HEAD, Opcode.MESSAGE, length, channel, sequence, log_time, publish_time)
        self.add(channel, log_time, head + payload)

    def metadata(self, name: str, values: Mapping[str, str]) -> None:
        """End the open chunk and write a metadata record."""
        self.flush()
        record = _record(Metadata(name=name, metadata=dict(values)))
        offset = self._file.end
        self._put(record)
        self._metadata_indices.append(_record(MetadataIndex(offset=offset, length=len(record), name=name)))

    def flush(self) -> None:
        """End the open chunk and write it; where that fails it stays open."""
        if not self._messages:
            return
        times = [time for messages in self._messages.values() for time in messages[::2]]
        first, last = min(times), max(times)
        plain = b"".join(self._records)
        packed = _compress(plain)
        chunk = _chunk(first, last, plain, packed)
        offsets: dict[int, int] = {}
        parts = [chunk]
        place = self._file.end + len(chunk)
        for channel, messages in self._messages.items():
            offsets[channel] = place
            parts.append(_message_index(channel, messages))
            place += len(parts[-1])
        index = ChunkIndex(
            message_start_time=first,
            message_end_time=last,
            chunk_start_offset=self._file.end,
            chunk_length=len(chunk),
            message_index_offsets=offsets,
            message_index_length=place - self._file.end - len(chunk),
            compression=_COMPRESSION,
            compressed_size=len(packed),
            uncompressed_size=len(plain),
        )
        self._put(b"".join(parts))
        self._chunk_indices.append(_record(index))
        for channel, messages in self._messages.items():
            self._counts[channel] += len(messages) // 2
        earliest, latest = self._span or (first, last)
        self._span = min(earliest, first), max(latest, last)
        self.discard()

    def discard(self) -> None:
        """Forget the open chunk."""
        self._records.clear()
        self._messages.clear()
        self._length = 0

    def finish(self) -> None:
        """End the open chunk, write index and statistics, and wait until the disk has everything."""
        self.flush()
        self._put(_record(DataEnd(self._checksum)) + self._summary())
        self._file.sync()

    def _define(self, definition: Schema | Channel) -> bytes:
        record = _record(definition)
        self._put(record)
        self._records.append(record)
        self._length += len(record)
        return record

    def _put(self, data: bytes) -> None:
        self._file.append(data)
        self._checksum = zlib.crc32(data, self._checksum)

    def _summary(self) -> bytes:
        start = self._file.end + len(_record(DataEnd(0)))
        first, last = self._span or (0, 0)
        statistics = Statistics(
            attachment_count=0,
            channel_count=len(self._channels),
            channel_message_counts=dict(self._counts),
            chunk_count=len(self._chunk_indices),
            message_count=sum(self._counts.values()),
            message_end_time=last,
            message_start_time=first,
            metadata_count=len(self._metadata_indices),
            schema_count=len(self._schemas),
        )
        groups = {
            Opcode.SCHEMA: self._schemas.values(),
            Opcode.CHANNEL: self._channels.values(),
            Opcode.STATISTICS: [_record(statistics)],
            Opcode.CHUNK_INDEX: self._chunk_indices,
            Opcode.METADATA_INDEX: self._metadata_indices,
        }
        summary, offsets = b"", b""
        for opcode, records in groups.items():
            group = b"".join(records)
            if group:
                offsets += _record(SummaryOffset(opcode, start + len(summary), len(group)))
                summary += group
        content = summary + offsets
        footer = Footer(summary_start=start, summary_offset_start=start + len(summary), summary_crc=0)
        # The checksum covers the footer's own beginning, up to the place where it stands itself.
        footer.summary_crc = zlib.crc32(_record(footer)[:-4], zlib.crc32(content))
        return content + _record(footer) + MCAP0_MAGIC


def _record(record: McapRecord) -> bytes:
    builder = RecordBuilder()
    record.write(builder)
    return builder.end()


def _chunk(first: int, last: int, plain: bytes, packed: bytes) -> bytes:
    name = _COMPRESSION.encode()
    head = struct.pack("<QQQII", first, last, len(plain), zlib.crc32(plain), len(name))
    length = len(head) + len(name) + 8 + len(packed)
    return struct.pack("<BQ", Opcode.CHUNK, length) + head + name + struct.pack("<Q", len(packed)) + packed


def _message_index(channel: int, messages: list[int]) -> bytes:
    size = 8 * len(messages)
    return struct.pack(f"<BQHI{len(messages)}Q", Opcode.MESSAGE_INDEX, 6 + size, channel, size, *messages)
