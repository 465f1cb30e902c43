"""Find the next chunk of a damaged MCAP file, where the records do not follow each other any more."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from mcap.opcode import Opcode

from recordings.decompression import DamagedChunkError, open_chunk

if TYPE_CHECKING:
    from collections.abc import Iterator
    from typing import BinaryIO

    from recordings.decompression import Budget

LEAST_COST = 4096
"""What looking at one place costs of the file's budget, bytes at least: a file full of such places is given up."""

# A chunk record is opcode, length, two times, size, checksum; its compression's name with a length, 4 bytes; its data
# with a length, 8 bytes.
_HEAD = struct.Struct("<BQQQQI")
_NAMES = (b"\x03\x00\x00\x00lz4", b"\x04\x00\x00\x00zstd")
_LENGTH = struct.Struct("<Q")
_RECORD_HEAD = 9
_PIECE = 1024 * 1024
_OVERLAP = _HEAD.size + max(map(len, _NAMES)) + _LENGTH.size


def next_chunk(file: BinaryIO, start: int, size: int, budget: Budget) -> int | None:
    """Offset of the first chunk from `start` on that proves itself by its checksum; None where there is none.

    `size` is the file's length. Where the file stands afterwards is not said.
    """
    try:
        for candidate, length in _candidates(file, start, size):
            budget.spend(max(length, LEAST_COST))
            file.seek(candidate + _RECORD_HEAD)
            try:
                open_chunk(file.read(length), budget, proven=True)
            except DamagedChunkError:
                continue
            return candidate
    except DamagedChunkError:
        # Nothing is left of the budget.
        pass
    return None


def _candidates(file: BinaryIO, start: int, size: int) -> Iterator[tuple[int, int]]:
    """Give offset and length of what looks like a chunk from `start` on: every number agrees with the others."""
    offset, kept = start, b""
    while offset < size:
        file.seek(offset)
        read = file.read(min(_PIECE, size - offset))
        if not read:
            return
        piece, base = kept + read, offset - len(kept)
        for place, name in sorted((found, known) for known in _NAMES for found in _places(piece, known)):
            first, data = place - _HEAD.size, place + len(name)
            if first < 0 or data + _LENGTH.size > len(piece):
                continue
            opcode, length, *_ = _HEAD.unpack_from(piece, first)
            (held,) = _LENGTH.unpack_from(piece, data)
            inside = data + _LENGTH.size - first - _RECORD_HEAD
            fits = length <= size - base - first - _RECORD_HEAD
            if opcode == Opcode.CHUNK and length == inside + held and fits:
                yield base + first, length
        offset += len(read)
        kept = piece[-_OVERLAP:]


def _places(piece: bytes, name: bytes) -> Iterator[int]:
    place = piece.find(name)
    while place >= 0:
        yield place
        place = piece.find(name, place + 1)
