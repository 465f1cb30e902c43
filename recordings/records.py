"""Split the decompressed records of chunks into messages, without a loop over them."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from mcap.opcode import Opcode

from recordings.chunked_file import HEADER_LENGTH, MESSAGE_HEAD_LENGTH
from recordings.decompression import DamagedChunkError

if TYPE_CHECKING:
    from numpy.typing import NDArray

_HEADER = struct.Struct("<BQ")
_LEAST = MESSAGE_HEAD_LENGTH - HEADER_LENGTH


OTHERS_LIMIT = 10_000
"""Most records of a block that are no message: definitions of channels, of which a file has a handful."""


class Messages(NamedTuple):
    """The message records among `plain`: where their bodies begin and end, and which channel they are of."""

    plain: bytes
    starts: NDArray[np.int64]
    ends: NDArray[np.int64]
    channels: NDArray[np.uint16]


def split(plain: bytes) -> tuple[Messages, list[tuple[int, bytes]]]:
    """Return the messages among records that follow each other, and the other records as (opcode, body).

    Every place that could begin a message record is taken from the bytes at once; those whose end is the next one's
    beginning form runs, and only what stands between two runs is looked at record by record.

    Raises
    ------
    DamagedChunkError
        The records do not follow each other from the first byte to the last.
    """
    places, ends = _candidates(plain)
    lasts = np.append(np.flatnonzero(ends[:-1] != places[1:]), places.size - 1)
    runs = [np.zeros(0, dtype=np.int64)]
    others: list[tuple[int, bytes]] = []
    offset, size = 0, len(plain)
    while offset < size:
        first = int(np.searchsorted(places, offset))
        if first < places.size and places[first] == offset:
            last = int(lasts[np.searchsorted(lasts, first)])
            runs.append(np.arange(first, last + 1))
            offset = int(ends[last])
        else:
            others.append(_other(plain, offset))
            offset += HEADER_LENGTH + len(others[-1][1])
            if len(others) > OTHERS_LIMIT:
                raise DamagedChunkError("has more records that are no message than a file needs")
    chosen = np.concatenate(runs)
    starts = places[chosen] + HEADER_LENGTH
    channels = at_every_byte(plain, "<u2")[starts] if starts.size else np.zeros(0, dtype=np.uint16)
    return Messages(plain, starts, ends[chosen], channels), others


def at_every_byte(plain: bytes, dtype: str | np.dtype[np.void], offset: int = 0) -> NDArray[Any]:
    """View of `plain`, from `offset` on, as a value of `dtype` at every byte where one can begin."""
    kind = np.dtype(dtype)
    return np.ndarray((len(plain) - offset - kind.itemsize + 1,), kind, buffer=plain, offset=offset, strides=(1,))


def _candidates(plain: bytes) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give the places where a message record that fits could begin, and where it would end."""
    if len(plain) < MESSAGE_HEAD_LENGTH:
        return np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64)
    data = np.frombuffer(plain, dtype=np.uint8)[: len(plain) - MESSAGE_HEAD_LENGTH + 1]
    places = np.flatnonzero(data == Opcode.MESSAGE).astype(np.int64)
    lengths = at_every_byte(plain, "<u8", 1)[places]
    small = (lengths >= _LEAST) & (lengths < len(plain))
    places = places[small]
    ends = places + HEADER_LENGTH + lengths[small].astype(np.int64)
    fit = ends <= len(plain)
    return places[fit], ends[fit]


def _other(plain: bytes, offset: int) -> tuple[int, bytes]:
    if len(plain) - offset < HEADER_LENGTH:
        raise DamagedChunkError("ends in half a record")
    opcode, length = _HEADER.unpack_from(plain, offset)
    start = offset + HEADER_LENGTH
    # 0 is no opcode: a bomb of zeros would be millions of empty records.
    if opcode in (0, Opcode.MESSAGE) or length > len(plain) - start:
        raise DamagedChunkError("has a record that does not fit")
    return opcode, plain[start : start + length]
