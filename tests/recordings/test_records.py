"""Splitting records without a loop gives what a loop gives."""

from __future__ import annotations

import struct

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from recordings.decompression import DamagedChunkError
from recordings.records import OTHERS_LIMIT, split

MESSAGE = 5


def _record(opcode: int, body: bytes) -> bytes:
    return struct.pack("<BQ", opcode, len(body)) + body


def _message(channel: int, payload: bytes) -> bytes:
    return _record(MESSAGE, struct.pack("<HIQQ", channel, 7, 8, 9) + payload)


def _loop(plain: bytes) -> tuple[list[tuple[int, bytes]], list[tuple[int, bytes]]]:
    """Messages and others, one by one."""
    messages: list[tuple[int, bytes]] = []
    others: list[tuple[int, bytes]] = []
    offset = 0
    while offset < len(plain):
        opcode, length = struct.unpack_from("<BQ", plain, offset)
        body = plain[offset + 9 : offset + 9 + length]
        offset += 9 + length
        (messages if opcode == MESSAGE else others).append((opcode, body))
    return messages, others


# Payloads that look like the beginning of a message record are what could mislead it.
FAKES = st.sampled_from(
    [_message(1, b""), _message(3, b"x" * 40), struct.pack("<BQ", 5, 22), struct.pack("<BQ", 5, 30)]
)
PAYLOADS = st.binary(max_size=40) | st.tuples(st.binary(max_size=9), FAKES, st.binary(max_size=9)).map(b"".join)
RECORDS = st.lists(
    st.builds(_message, st.integers(0, 2**16 - 1), PAYLOADS)
    | st.builds(_record, st.sampled_from([3, 4, 0x80]), PAYLOADS),
    max_size=12,
)


@settings(max_examples=300, deadline=None)
@given(RECORDS)
def test_records_are_what_a_loop_finds(records: list[bytes]) -> None:
    plain = b"".join(records)
    messages, others = split(plain)
    expected, rest = _loop(plain)
    bodies = [plain[start:end] for start, end in zip(messages.starts.tolist(), messages.ends.tolist(), strict=True)]
    assert bodies == [body for _, body in expected]
    assert messages.channels.tolist() == [int.from_bytes(body[:2], "little") for body in bodies]
    assert others == rest


@settings(max_examples=300, deadline=None)
@given(RECORDS, st.integers(0, 400), st.integers(0, 255))
def test_records_that_do_not_follow_each_other_are_damage(records: list[bytes], place: int, value: int) -> None:
    """A changed byte gives either records that fill the chunk exactly, or the error: nothing between."""
    plain = bytearray(b"".join(records))
    if not plain:
        return
    plain[place % len(plain)] = value
    try:
        messages, others = split(bytes(plain))
    except DamagedChunkError:
        return
    lengths = int(np.sum(messages.ends - messages.starts)) + sum(len(body) for _, body in others)
    assert lengths + 9 * (messages.starts.size + len(others)) == len(plain)


@pytest.mark.parametrize(
    "plain",
    [
        b"\x05",
        bytes(9),
        bytes(4000),
        _record(MESSAGE, bytes(21)),
        struct.pack("<BQ", 5, 2**63) + bytes(40),
        struct.pack("<BQ", 3, 2**64 - 1),
        _message(1, b"")[:-1],
        _message(1, b"") + b"\x05",
        _record(0x80, b"") * (OTHERS_LIMIT + 1),
    ],
)
def test_what_are_no_records(plain: bytes) -> None:
    with pytest.raises(DamagedChunkError):
        split(plain)


def test_nothing_is_nothing() -> None:
    messages, others = split(b"")
    assert (messages.starts.size, others) == (0, [])
