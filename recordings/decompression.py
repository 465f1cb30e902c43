"""Decompress a chunk of an MCAP file that nobody vouches for: never more bytes than the chunk declares."""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, cast

import lz4.frame  # pyright: ignore[reportMissingTypeStubs]
import zstandard

if TYPE_CHECKING:
    from collections.abc import Callable

CHUNK_LIMIT = 32 * 1024 * 1024
"""Most bytes a chunk may declare (ours have 64 KiB; other tools rewrite files with up to some MiB)."""
RATIO_LIMIT = 256
"""Most bytes a chunk may declare for each byte it holds: LZ4's own maximum is 255."""


FILE_RATIO_LIMIT = 40
"""Most bytes a whole file may hold for each of its own, beyond the first `FILE_ALLOWANCE`.

Recordings come to less than 3, and to 20 where a table stands still and nothing is indexed."""
FILE_ALLOWANCE = 16 * 1024 * 1024

_HEAD = struct.Struct("<QQQII")


class DamagedChunkError(ValueError):
    """A chunk that is not what it declares."""


@dataclass
class Budget:
    """How many bytes the chunks of one file may still hold."""

    left: int

    @classmethod
    def of(cls, size: int) -> Budget:
        """Give the budget of a file of `size` bytes."""
        return cls(FILE_ALLOWANCE + FILE_RATIO_LIMIT * size)

    def spend(self, count: int) -> None:
        """Take `count` bytes; DamagedChunkError where they are not left."""
        if count > self.left:
            raise DamagedChunkError("would make the file larger than a recording can be")
        self.left -= count


def open_chunk(body: bytes, budget: Budget, *, proven: bool = False) -> bytes:
    """Records of a chunk record with this body, decompressed.

    Raises
    ------
    DamagedChunkError
        Whatever is wrong with it; with `proven` also where it has no checksum to prove itself by.
    """
    try:
        _, _, declared, checksum, name_length = _HEAD.unpack_from(body)
        start = _HEAD.size + name_length
        compression = body[_HEAD.size : start].decode()
        (length,) = struct.unpack_from("<Q", body, start)
    except (struct.error, UnicodeDecodeError) as error:
        raise DamagedChunkError(str(error)) from None
    data = body[start + 8 :]
    if length != len(data):
        raise DamagedChunkError("holds another length than it declares")
    if proven and not checksum:
        raise DamagedChunkError("has no checksum")
    budget.spend(declared)
    return decompress(compression, data, declared, checksum)


def decompress(compression: str, data: bytes, declared: int, checksum: int) -> bytes:
    """Uncompressed records of a chunk, `declared` bytes long; `checksum` is their CRC-32, or 0 for none.

    Raises
    ------
    DamagedChunkError
        Unknown compression, a declared size beyond the limits, another size than declared, or a wrong checksum.
    """
    if declared > CHUNK_LIMIT or declared > RATIO_LIMIT * len(data) + 1024:
        raise DamagedChunkError(f"declares {declared} bytes in {len(data)}")
    if compression == "lz4":
        plain = _lz4(data, declared)
    elif compression == "zstd":
        plain = _zstd(data, declared)
    elif compression == "":
        plain = data
    else:
        raise DamagedChunkError(f"unknown compression {compression!r}")
    if len(plain) != declared:
        raise DamagedChunkError("holds another size than it declares")
    if checksum and zlib.crc32(plain) != checksum:
        raise DamagedChunkError("has a wrong checksum")
    return plain


def _lz4(data: bytes, declared: int) -> bytes:
    # lz4 has no type stubs; `max_length` is what keeps a bomb from going off.
    decompressor = cast("Any", lz4.frame).LZ4FrameDecompressor()
    step = cast("Callable[..., bytes]", decompressor.decompress)
    try:
        return step(data, max_length=declared + 1)
    except (RuntimeError, ValueError, EOFError) as error:
        raise DamagedChunkError(str(error)) from None


def _zstd(data: bytes, declared: int) -> bytes:
    try:
        with zstandard.ZstdDecompressor(max_window_size=CHUNK_LIMIT).stream_reader(data) as stream:
            return stream.read(declared + 1)
    except (zstandard.ZstdError, ValueError) as error:
        raise DamagedChunkError(str(error)) from None
