"""Walk through the records of an MCAP file from its beginning, wherever it ends and whatever is damaged.

A truncated file has no index, so nothing here needs one; the library's reader would do, but takes 10 us a message,
believes every length it reads, and gives up at the first that is wrong. Here no length is used before it is compared
with the bytes that are there, and where the records do not follow each other any more, the next chunk that proves
itself by its checksum is searched for.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from io import SEEK_CUR, BytesIO
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema, Statistics
from mcap.writer import MCAP0_MAGIC

from recordings.decompression import Budget, DamagedChunkError, open_chunk
from recordings.errors import RecordingError
from recordings.resync import next_chunk

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RECORD_LIMIT, CHUNK_RECORD_LIMIT = 16 * 1024 * 1024, 64 * 1024 * 1024
"""Longest record that is read into memory, bytes, and longest chunk; longer ones are passed over."""
BUFFER = 1024 * 1024
"""Bytes read from the disk at once."""

_HEADER = struct.Struct("<BQ")
_FOOTER = struct.Struct("<QQI")
# The last fields of these records each have their length in front: where the first begins, and how many there are.
_SHAPES = {
    Opcode.SCHEMA: (2, 3),
    Opcode.CHANNEL: (4, 3),
    Opcode.MESSAGE_INDEX: (2, 1),
    Opcode.METADATA: (0, 2),
    Opcode.STATISTICS: (42, 1),
}
_READ = frozenset({*_SHAPES, Opcode.MESSAGE, Opcode.CHUNK, Opcode.DATA_END})
_DEFINITIONS = frozenset({Opcode.SCHEMA, Opcode.CHANNEL})
_LEAST_MESSAGE = 22
_INDEX_HEAD, _INDEX_ENTRY = 6, 16

_Record = TypeVar("_Record", Schema, Channel, Metadata, Statistics)


@dataclass
class Scan:
    """What a walk found out about the file itself.

    Attributes
    ----------
    size : int
        Length of the file, bytes; known before the walk.
    ended : bool
        Whether the closing magic was reached.
    data_ended : bool
        Whether the end of the data was reached: what is missing then is the index alone.
    end : int
        Where the last record that proved to be one ends, bytes from the beginning of the file.
    damaged_chunks : int
        Chunks that are left out.
    damaged_messages : dict of int to int
        Messages that were in them, by channel, as far as the indices behind the chunks say it.
    passed_over : int
        Bytes among the records that could not be made sense of.
    attachments : int
        Attachments, which are passed over.
    problems : list of str
        Clauses about anything else.
    """

    size: int = 0
    ended: bool = False
    data_ended: bool = False
    end: int = 0
    damaged_chunks: int = 0
    damaged_messages: dict[int, int] = field(default_factory=dict[int, int])
    passed_over: int = 0
    attachments: int = 0
    problems: list[str] = field(default_factory=list[str])

    def sentences(self) -> list[str]:
        """Everything that is wrong with the file, as clauses."""
        found = list(self.problems)
        if not self.ended:
            found.append(f"it ends early, after {self.end} bytes that can be read")
        if self.passed_over:
            found.append(f"{self.passed_over} bytes in the middle of it are no records and are passed over")
        if self.damaged_chunks:
            lost = sum(self.damaged_messages.values())
            found.append(
                f"{self.damaged_chunks} damaged chunks are left out" + (f", with {lost} messages" if lost else "")
            )
        return list(dict.fromkeys(found))


def check_magic(file: BinaryIO, name: str) -> None:
    """Raise RecordingError unless `file` begins as an MCAP file does."""
    magic = file.read(len(MCAP0_MAGIC))
    if not magic:
        raise RecordingError(f"{name} is empty")
    if magic != MCAP0_MAGIC:
        raise RecordingError(f"{name} is not an MCAP file")


def walk(file: BinaryIO, scan: Scan) -> Iterator[tuple[int, bytes]]:
    """Yield (opcode, body) of every record of interest, with the decompressed records of a chunk as its body.

    The definitions that the end of a closed file repeats come first, so that damage to the first ones costs nothing.
    Damage ends up in `scan`, never as exception.
    """
    if repeated := _repeated_definitions(file, scan.size):
        yield Opcode.CHUNK, repeated
    yield from _Walk(file, scan).records()


def parse(kind: Callable[[ReadDataStream], _Record], body: bytes, scan: Scan) -> _Record | None:
    """Parse a record; None, and said in `scan`, where the bytes are none."""
    try:
        return kind(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError):
        scan.problems.append("a record that describes the file is damaged and left out")
        return None


class _Walk:
    """A walk under way; `scan.end` is the end of the last record that proved to be one."""

    def __init__(self, file: BinaryIO, scan: Scan) -> None:
        self._file = file
        self._size = scan.size
        self._scan = scan
        self._checksum: int | None = zlib.crc32(MCAP0_MAGIC)
        self._budget = Budget.of(scan.size)
        self._chunk_is_damaged = False
        scan.end = len(MCAP0_MAGIC)

    def records(self) -> Iterator[tuple[int, bytes]]:
        """Yield what `walk` does."""
        offset = len(MCAP0_MAGIC)
        self._file.seek(offset)
        while True:
            head = self._file.read(_HEADER.size)
            opcode, length = _HEADER.unpack(head) if len(head) == _HEADER.size else (0, 0)
            if opcode == Opcode.FOOTER and length == _FOOTER.size:
                self._file.seek(offset + _HEADER.size + length)
                if self._file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC:
                    self._scan.ended = True
                    return
                opcode = 0
            if opcode == 0 or length > self._size - offset - _HEADER.size:
                found = self._search()
                if found is None:
                    return
                offset = found
                continue
            body = self._body(head, opcode, length)
            offset += _HEADER.size + length
            yield from self._take(opcode, body, offset)

    def _body(self, head: bytes, opcode: int, length: int) -> bytes:
        """Read the rest of a record; empty where it is of no interest or too long to keep."""
        keep = opcode in _READ and length <= (CHUNK_RECORD_LIMIT if opcode == Opcode.CHUNK else RECORD_LIMIT)
        if opcode == Opcode.DATA_END:
            stated = self._file.read(length) if length == 4 else b""
            if self._checksum is not None and int.from_bytes(stated, "little") not in (0, self._checksum):
                self._scan.problems.append("its data section has a wrong checksum")
            self._checksum = None
            self._file.seek(length - len(stated), SEEK_CUR)
            return stated
        body = b""
        self._sum(head)
        for start in range(0, length, length if keep else BUFFER) if length else ():
            body = self._file.read(min(length if keep else BUFFER, length - start))
            self._sum(body)
        return body if keep else b""

    def _sum(self, data: bytes) -> None:
        if self._checksum is not None:
            self._checksum = zlib.crc32(data, self._checksum)

    def _take(self, opcode: int, body: bytes, end: int) -> Iterator[tuple[int, bytes]]:
        """Yield a record that is of interest and makes sense."""
        scan = self._scan
        if opcode == Opcode.CHUNK:
            self._chunk_is_damaged = True
            try:
                plain = open_chunk(body, self._budget)
            except DamagedChunkError:
                scan.damaged_chunks += 1
                return
            self._chunk_is_damaged = False
            scan.end = end
            yield opcode, plain
        elif opcode == Opcode.MESSAGE:
            if len(body) >= _LEAST_MESSAGE:
                scan.end = end
                yield opcode, body
        elif opcode == Opcode.ATTACHMENT:
            scan.attachments += 1
        elif opcode == Opcode.DATA_END:
            scan.data_ended = len(body) == 4
        elif opcode in _SHAPES:
            left = _left_over(body, *_SHAPES[Opcode(opcode)])
            if left == 0:
                scan.end = end
            if opcode == Opcode.MESSAGE_INDEX:
                if left == 0 and self._chunk_is_damaged:
                    channel = int.from_bytes(body[:2], "little")
                    count = (len(body) - _INDEX_HEAD) // _INDEX_ENTRY
                    scan.damaged_messages[channel] = scan.damaged_messages.get(channel, 0) + count
            elif left < 0:
                scan.problems.append("a record that describes the file is damaged and left out")
            elif opcode == Opcode.STATISTICS or not scan.data_ended:
                yield opcode, body

    def _search(self) -> int | None:
        """Go to the next chunk after the last record that was one; None where there is none."""
        scan = self._scan
        found = next_chunk(self._file, scan.end + 1, self._size, self._budget)
        if found is None:
            return None
        scan.passed_over += found - scan.end
        self._checksum = None
        self._file.seek(found)
        return found


def _left_over(body: bytes, start: int, count: int) -> int:
    """Bytes behind the `count` last fields of a record, which each begin with their length; negative where cut."""
    for _ in range(count):
        if start + 4 > len(body):
            return -1
        start += 4 + int.from_bytes(body[start : start + 4], "little")
    return len(body) - start


def _repeated_definitions(file: BinaryIO, size: int) -> bytes:
    """Schema and channel records as the end of the file repeats them, where its checksum is right; none otherwise."""
    tail = _HEADER.size + _FOOTER.size + len(MCAP0_MAGIC)
    if size < tail:
        return b""
    file.seek(size - tail)
    end = file.read(tail)
    start, _, checksum = _FOOTER.unpack_from(end, _HEADER.size)
    if end[-len(MCAP0_MAGIC) :] != MCAP0_MAGIC or not 0 < size - tail - start <= RECORD_LIMIT:
        return b""
    file.seek(start)
    summary = file.read(size - tail - start)
    if zlib.crc32(end[: _HEADER.size + _FOOTER.size - 4], zlib.crc32(summary)) != checksum:
        return b""
    found: list[bytes] = []
    place = 0
    while place + _HEADER.size <= len(summary):
        opcode, length = _HEADER.unpack_from(summary, place)
        begin, place = place, place + _HEADER.size + length
        if opcode in _DEFINITIONS and place <= len(summary):
            found.append(summary[begin:place])
    return b"".join(found)
