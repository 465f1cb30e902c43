"""The frames of one control cycle: identifiers, and bytes in and out. Nothing here knows a bus.

Units on the bus, in this one place: position in nanometres (INT32, up to +-2.147 m), acceleration in micrometres per
second squared (INT32, up to +-2147 m/s2), rotation in microradians (INT32). Little-endian, as CiA 301 says.

| frame | identifier | bytes |
|---|---|---|
| NMT | 000 | command u8, node u8 |
| SYNC | 080 | counter u8, 1 to 240 (object 1019 = 240) |
| EMCY | 080 + node | error code u16, error register u8, five bytes of the maker's |
| TPDO1 | 180 + node | statusword u16, actual position i32; of a rotation sensor: rotation i32 |
| RPDO1 | 200 + node | controlword u16, target position i32 |
| TPDO2 | 280 + node | acceleration i32 |
| heartbeat | 700 + node | NMT state u8, 0 after a (re)start |
"""

from __future__ import annotations

import math
from enum import IntEnum
from struct import Struct
from typing import NamedTuple

from devices.errors import FrameError

NMT, SYNC, EMCY, TPDO1, RPDO1, TPDO2, HEARTBEAT = 0x000, 0x080, 0x080, 0x180, 0x200, 0x280, 0x700

POSITION_UNIT = 1e-9
"""m, one count of target and actual position."""
ACCELERATION_UNIT = 1e-6
"""m/s2, one count of acceleration."""
ROTATION_UNIT = 1e-6
"""rad, one count of rotation."""
SYNC_COUNTS = 240
"""CiA 301: the SYNC counter runs from 1 to this and starts again at 1."""

_NMT = Struct("<BB")
_BYTE = Struct("<B")
_WORD_POSITION = Struct("<Hi")
_LONG = Struct("<i")
_EMCY = Struct("<HB5s")


class NmtCommand(IntEnum):
    """What an NMT frame asks of a node (CiA 301)."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """What a heartbeat says of its node (CiA 301)."""

    BOOT_UP = 0x00
    STOPPED = 0x04
    OPERATIONAL = 0x05
    PRE_OPERATIONAL = 0x7F


class Emergency(NamedTuple):
    """Content of an emergency frame; `detail` are the five bytes of the maker's."""

    code: int
    register: int
    detail: bytes


EMERGENCY_TEXTS = {
    0x0000: "error reset",
    0x8130: "communication lost",
    0x8250: "no set-point came",
    0x8400: "velocity limit",
    0x8500: "acceleration limit",
    0x8611: "set-point too far from the table",
    0x8612: "stroke limit",
    0x8700: "SYNC lost",
}
"""Error codes of CiA 301 and 402 used here, with what they mean on a shake table."""


def emergency_text(code: int) -> str:
    """Return the meaning of an emergency error code, or that it is the maker's."""
    return EMERGENCY_TEXTS.get(code, "see the drive's manual")


def counts(value: float, unit: float, what: str) -> int:
    """Return `value` (SI) in counts of `unit`, rounded to the nearest.

    Raises
    ------
    FrameError
        Where it is not finite or does not fit a signed 32-bit number.

    Examples
    --------
    >>> counts(0.1, POSITION_UNIT, "position")
    100000000
    """
    scaled = value / unit
    if not math.isfinite(scaled) or not -(2**31) <= round(scaled) < 2**31:
        raise FrameError(f"{what} of {value:g} does not fit a signed 32-bit number in units of {unit:g}")
    return round(scaled)


def pack_nmt(command: NmtCommand, node: int) -> bytes:
    """Return the NMT frame for one node, 1 to 127, or all of them, 0."""
    if not 0 <= node <= 127:
        raise FrameError(f"NMT node is {node}; it must be 0 to 127")
    return _NMT.pack(command, node)


def unpack_nmt(data: bytes) -> tuple[int, int]:
    """Return command and node of an NMT frame."""
    command, node = _unpack(_NMT, data, "NMT")
    return command, node


def sync_counter(cycle: int) -> int:
    """Return the SYNC counter of a cycle: 1 to 240.

    >>> sync_counter(0), sync_counter(239), sync_counter(240)
    (1, 240, 1)
    """
    return cycle % SYNC_COUNTS + 1


def pack_sync(counter: int) -> bytes:
    """Return the SYNC frame with its counter, 1 to 240."""
    if not 1 <= counter <= SYNC_COUNTS:
        raise FrameError(f"SYNC counter is {counter}; it must be 1 to {SYNC_COUNTS}")
    return _BYTE.pack(counter)


def unpack_sync(data: bytes) -> int:
    """Return the counter of a SYNC frame; a SYNC without counter is a FrameError, for nobody could tell a lost one."""
    (counter,) = _unpack(_BYTE, data, "SYNC")
    if not 1 <= counter <= SYNC_COUNTS:
        raise FrameError(f"SYNC counter is {counter}; it must be 1 to {SYNC_COUNTS}")
    return counter


def pack_heartbeat(state: NmtState) -> bytes:
    """Return the heartbeat frame; `BOOT_UP` is the one sent once after a (re)start."""
    return _BYTE.pack(state)


def unpack_heartbeat(data: bytes) -> NmtState:
    """Return the NMT state of a heartbeat."""
    (state,) = _unpack(_BYTE, data, "heartbeat")
    try:
        return NmtState(state)
    except ValueError:
        raise FrameError(f"heartbeat says NMT state {state:#04x}; CiA 301 knows 0x00, 0x04, 0x05 and 0x7f") from None


def pack_emergency(emergency: Emergency) -> bytes:
    """Return the EMCY frame."""
    return _EMCY.pack(emergency.code, emergency.register, emergency.detail)


def unpack_emergency(data: bytes) -> Emergency:
    """Return the content of an EMCY frame."""
    if len(data) != _EMCY.size:
        raise FrameError(f"EMCY frame has {len(data)} bytes; it must have {_EMCY.size}")
    code, register, detail = _EMCY.unpack(data)
    return Emergency(code, register, detail)


def pack_target(controlword: int, target: int) -> bytes:
    """Return RPDO1: controlword and target position, nm."""
    return _WORD_POSITION.pack(controlword, target)


def unpack_target(data: bytes) -> tuple[int, int]:
    """Return controlword and target position, nm, of RPDO1."""
    controlword, target = _unpack(_WORD_POSITION, data, "RPDO1")
    return controlword, target


def pack_actual(statusword: int, position: int) -> bytes:
    """Return TPDO1: statusword and actual position, nm."""
    return _WORD_POSITION.pack(statusword, position)


def unpack_actual(data: bytes) -> tuple[int, int]:
    """Return statusword and actual position, nm, of TPDO1."""
    statusword, position = _unpack(_WORD_POSITION, data, "TPDO1")
    return statusword, position


def pack_long(value: int) -> bytes:
    """Return a frame of one INT32: TPDO2 (acceleration, um/s2) or a rotation sensor's TPDO1 (rotation, urad)."""
    return _LONG.pack(value)


def unpack_long(data: bytes, what: str) -> int:
    """Return the one INT32 of a frame; `what` names it in the error."""
    (value,) = _unpack(_LONG, data, what)
    return value


def _unpack(layout: Struct, data: bytes, what: str) -> tuple[int, ...]:
    if len(data) != layout.size:
        raise FrameError(f"{what} frame has {len(data)} bytes; it must have {layout.size}")
    return layout.unpack(data)
