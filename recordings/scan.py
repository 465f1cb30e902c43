"""Walk through the records of an MCAP file from its beginning, wherever it ends.

A truncated file has no index, so nothing here seeks; the library's reader would do, but takes 10 us a message and
believes every length it reads. Here no length is used before it is compared with the bytes that are there.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass, field
from io import BytesIO
from typing import TYPE_CHECKING, BinaryIO, TypeVar

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Metadata, Schema
from mcap.writer import MCAP0_MAGIC

from recordings.decompression import DamagedChunkError, decompress
from recordings.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

RECORD_LIMIT = 64 * 1024 * 1024
"""Longest record that is read into memory, bytes; longer ones (attachments) are passed over."""

_HEADER = struct.Struct("<BQ")
_CHUNK_HEAD = struct.Struct("<QQQII")
_PIECE = 1024 * 1024
_READ = frozenset({Opcode.SCHEMA, Opcode.CHANNEL, Opcode.MESSAGE, Opcode.CHUNK, Opcode.METADATA, Opcode.DATA_END})

_Record = TypeVar("_Record", Schema, Channel, Metadata)


@dataclass
class Scan:
    """What a walk found out about the file itself.

    `ended` is True once the closing magic was reached; `problems` are sentences about what was left out.
    """

    ended: bool = False
    damaged_chunks: int = 0
    problems: list[str] = field(default_factory=list[str])


def check_magic(file: BinaryIO, name: str) -> None:
    """Raise RecordingError unless `file` begins as an MCAP file does."""
    magic = file.read(len(MCAP0_MAGIC))
    if not magic:
        raise RecordingError(f"{name} is empty")
    if magic != MCAP0_MAGIC:
        raise RecordingError(f"{name} is not an MCAP file")


def walk(file: BinaryIO, size: int, scan: Scan) -> Iterator[tuple[int, bytes]]:
    """Yield (opcode, body) of every record of interest, those inside chunks in place of the chunk.

    `file` stands after the magic; `size` is the file's length in bytes. Damage ends up in `scan`, never as exception.
    """
    offset = len(MCAP0_MAGIC)
    checksum = zlib.crc32(MCAP0_MAGIC)
    in_data = True
    while True:
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            break
        opcode, length = _HEADER.unpack(head)
        if length > size - offset - _HEADER.size:
            break
        body = b""
        if opcode in _READ and length <= RECORD_LIMIT:
            body = file.read(length)
        before = checksum
        if in_data:
            checksum = zlib.crc32(body, zlib.crc32(head, checksum))
        if not body:
            for start in range(0, length, _PIECE):
                piece = file.read(min(_PIECE, length - start))
                checksum = zlib.crc32(piece, checksum) if in_data else checksum
        offset += _HEADER.size + length
        if opcode == Opcode.DATA_END:
            in_data = False
            if len(body) == 4 and (stated := int.from_bytes(body, "little")) and stated != before:
                scan.problems.append("its data section has a wrong checksum")
        elif opcode == Opcode.FOOTER:
            scan.ended = file.read(len(MCAP0_MAGIC)) == MCAP0_MAGIC
            break
        elif opcode == Opcode.CHUNK:
            yield from _open_chunk(body, scan)
        elif body and in_data:
            yield opcode, body
    if not scan.ended:
        scan.problems.append(f"it ends early, after {offset} bytes that can be read")
    if scan.damaged_chunks:
        scan.problems.append(f"{scan.damaged_chunks} damaged chunks are left out")


def parse(kind: Callable[[ReadDataStream], _Record], body: bytes, scan: Scan) -> _Record | None:
    """Parse a schema, channel or metadata record; None, and said in `scan`, where the bytes are none."""
    try:
        return kind(ReadDataStream(BytesIO(body)))
    except (McapError, struct.error, UnicodeDecodeError):
        scan.problems.append("a record that describes the file is damaged and left out")
        return None


def _open_chunk(body: bytes, scan: Scan) -> Iterator[tuple[int, bytes]]:
    try:
        plain = _plain(body)
        # All records are split before the first is given out: a chunk counts whole or not at all.
        records = list(_split(plain))
    except (DamagedChunkError, struct.error, UnicodeDecodeError):
        scan.damaged_chunks += 1
        return
    yield from records


def _plain(body: bytes) -> bytes:
    _, _, declared, checksum, name_length = _CHUNK_HEAD.unpack_from(body)
    start = _CHUNK_HEAD.size + name_length
    compression = body[_CHUNK_HEAD.size : start].decode()
    (length,) = struct.unpack_from("<Q", body, start)
    data = body[start + 8 :]
    if length != len(data):
        raise DamagedChunkError("holds another length than it declares")
    return decompress(compression, data, declared, checksum)


def _split(plain: bytes) -> Iterator[tuple[int, bytes]]:
    offset, end, head = 0, len(plain), _HEADER.size
    unpack = _HEADER.unpack_from
    while offset < end:
        opcode, length = unpack(plain, offset)
        start = offset + head
        offset = start + length
        # 0 is no opcode: a bomb of zeros would be millions of empty records.
        if offset > end or opcode == 0:
            raise DamagedChunkError("has a record that does not fit")
        yield opcode, plain[start:offset]
