"""Bytes in, bytes out."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.frames import Emergency, NmtCommand, NmtState
from devices.cia402.frames import pack_actual, pack_target, unpack_actual, unpack_target
from devices.errors import FrameError

INT32 = st.integers(-(2**31), 2**31 - 1)


@pytest.mark.parametrize(
    ("packed", "expected"),
    [
        (frames.pack_nmt(NmtCommand.START, 5), "0105"),
        (frames.pack_nmt(NmtCommand.RESET_NODE, 0), "8100"),
        (frames.pack_sync(240), "f0"),
        (frames.pack_heartbeat(NmtState.PRE_OPERATIONAL), "7f"),
        (frames.pack_heartbeat(NmtState.BOOT_UP), "00"),
        (frames.pack_emergency(Emergency(0x8612, 0x21, b"abcde")), "1286216162636465"),
        (pack_target(0x000F, 100_000_000), "0f0000e1f505"),
        (pack_target(0x000F, -1), "0f00ffffffff"),
        (pack_actual(0x1637, 1), "371601000000"),
        (frames.pack_long(-9_810_000), "b04f6aff"),
    ],
)
def test_bytes_out(packed: bytes, expected: str) -> None:
    assert packed.hex() == expected


def test_identifiers() -> None:
    names = ("NMT", "SYNC", "EMCY", "TPDO1", "RPDO1", "TPDO2", "HEARTBEAT")
    assert [getattr(frames, name) for name in names] == [0x000, 0x080, 0x080, 0x180, 0x200, 0x280, 0x700]


@given(INT32, st.integers(0, 0xFFFF))
def test_round_trip(value: int, word: int) -> None:
    assert unpack_target(pack_target(word, value)) == (word, value)
    assert unpack_actual(pack_actual(word, value)) == (word, value)
    assert frames.unpack_long(frames.pack_long(value), "x") == value


def test_round_trip_of_the_small_ones() -> None:
    assert frames.unpack_nmt(frames.pack_nmt(NmtCommand.STOP, 127)) == (NmtCommand.STOP, 127)
    assert all(frames.unpack_sync(frames.pack_sync(n)) == n for n in range(1, 241))
    assert all(frames.unpack_heartbeat(frames.pack_heartbeat(state)) is state for state in NmtState)
    emergency = Emergency(0x8700, 0x11, bytes(5))
    assert frames.unpack_emergency(frames.pack_emergency(emergency)) == emergency


@pytest.mark.parametrize(
    ("unpack", "length"),
    [
        (frames.unpack_nmt, 2),
        (frames.unpack_sync, 1),
        (frames.unpack_heartbeat, 1),
        (frames.unpack_emergency, 8),
        (unpack_target, 6),
        (unpack_actual, 6),
        (lambda data: frames.unpack_long(data, "TPDO2"), 4),
    ],
)
@pytest.mark.parametrize("by", [-1, 1])
def test_wrong_length_is_one_sentence(unpack, length: int, by: int) -> None:
    with pytest.raises(FrameError, match=f"frame has {length + by} bytes; it must have {length}"):
        unpack(bytes(length + by))


def test_wrong_values() -> None:
    with pytest.raises(FrameError, match="1 to 240"):
        frames.unpack_sync(b"\x00")
    with pytest.raises(FrameError, match="1 to 240"):
        frames.unpack_sync(b"\xf1")
    with pytest.raises(FrameError, match="1 to 240"):
        frames.pack_sync(0)
    with pytest.raises(FrameError, match="0x33"):
        frames.unpack_heartbeat(b"\x33")
    with pytest.raises(FrameError, match="0 to 127"):
        frames.pack_nmt(NmtCommand.START, 128)


def test_counts_fill_an_int32_and_no_more() -> None:
    assert frames.counts(2.147483647, 1e-9, "position") == 2**31 - 1
    assert frames.counts(-2.147483648, 1e-9, "position") == -(2**31)
    for value in (2.147483648, -2.147483649, math.inf, -math.inf, math.nan, 1e308):
        with pytest.raises(FrameError, match="32-bit"):
            frames.counts(value, 1e-9, "position")


def test_the_counter_runs_from_1_to_240() -> None:
    counters = [frames.sync_counter(cycle) for cycle in range(481)]
    assert set(counters) == set(range(1, 241))
    assert all((b - a) % 240 == 1 for a, b in itertools.pairwise(counters))


def test_emergency_texts() -> None:
    assert frames.emergency_text(0x8612) == "stroke limit"
    assert "manual" in frames.emergency_text(0xFF01)
