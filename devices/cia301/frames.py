"""Frames common to all CANopen nodes (CiA 301): identifiers, and bytes in and out. Nothing here knows a bus.

Little-endian, as CiA 301 says; what PDOs carry is told by the EDS of the node and packed in the folder of its profile.

| frame | identifier | bytes |
|---|---|---|
| NMT | 000 | command u8, node u8 |
| SYNC | 080 | counter u8, 1 to 240 (object 1019 = 240) |
| EMCY | 080 + node | error code u16, error register u8, five bytes of the maker's |
| TPDO1 to 4 | 180, 280, 380, 480 + node | up to eight bytes |
| RPDO1 to 4 | 200, 300, 400, 500 + node | up to eight bytes |
| SDO | 600 + node to the server, 580 + node from it | eight bytes |
| heartbeat | 700 + node | NMT state u8, 0 after a (re)start |
"""

from __future__ import annotations

import math
from enum import IntEnum
from struct import Struct
from typing import NamedTuple

from devices.errors import FrameError

NMT, SYNC, EMCY, HEARTBEAT = 0x000, 0x080, 0x080, 0x700
TPDO1, TPDO2, TPDO3, TPDO4 = 0x180, 0x280, 0x380, 0x480
RPDO1, RPDO2, RPDO3, RPDO4 = 0x200, 0x300, 0x400, 0x500
SDO_ANSWER, SDO_REQUEST = 0x580, 0x600

HOST_NODE = 127
"""CANopen node of the host, unless told: the last one, so that devices keep the low numbers."""
SYNC_COUNTS = 240
"""CiA 301: the SYNC counter runs from 1 to this and starts again at 1."""

_NMT = Struct("<BB")
_BYTE = Struct("<B")
_LONG = Struct("<i")
_EMCY = Struct("<HB5s")


class NmtCommand(IntEnum):
    """What an NMT frame asks of a node."""

    START = 0x01
    STOP = 0x02
    ENTER_PRE_OPERATIONAL = 0x80
    RESET_NODE = 0x81
    RESET_COMMUNICATION = 0x82


class NmtState(IntEnum):
    """What a heartbeat says of its node."""

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
    0x2310: "over-current",
    0x3210: "over-voltage",
    0x4310: "drive too hot",
    0x8130: "communication lost",
    0x8140: "was off the bus",
    0x8250: "no set-point came",
    0x8400: "velocity limit",
    0x8500: "acceleration limit",
    0x8611: "set-point too far from the table",
    0x8612: "stroke limit",
    0x8700: "SYNC lost or out of order",
    0x9000: "emergency stop",
    0xFF10: "limit switch",
}
"""Error codes of CiA 301 and 402 used here, and ours from FF00, with what they mean on a shake table."""


def emergency_text(code: int) -> str:
    """Return the meaning of an emergency error code, or that it is the maker's."""
    return EMERGENCY_TEXTS.get(code, "see the device's manual")


def counts(value: float, unit: float, what: str) -> int:
    """Return `value` (SI) in counts of `unit`, rounded to the nearest.

    Raises
    ------
    FrameError
        Where it is not finite or does not fit a signed 32-bit number.

    Examples
    --------
    >>> counts(0.1, 1e-9, "position")
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
    command, node = unpack(_NMT, data, "NMT")
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
    (counter,) = unpack(_BYTE, data, "SYNC")
    if not 1 <= counter <= SYNC_COUNTS:
        raise FrameError(f"SYNC counter is {counter}; it must be 1 to {SYNC_COUNTS}")
    return counter


def pack_heartbeat(state: NmtState) -> bytes:
    """Return the heartbeat frame; `BOOT_UP` is the one sent once after a (re)start."""
    return _BYTE.pack(state)


def unpack_heartbeat(data: bytes) -> NmtState:
    """Return the NMT state of a heartbeat."""
    (state,) = unpack(_BYTE, data, "heartbeat")
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


def pack_long(value: int) -> bytes:
    """Return a PDO of one INT32: an acceleration, a rotation, a position."""
    return _LONG.pack(value)


def unpack_long(data: bytes, what: str) -> int:
    """Return the one INT32 of a PDO; `what` names it in the error."""
    (value,) = unpack(_LONG, data, what)
    return value


def unpack(layout: Struct, data: bytes, what: str) -> tuple[int, ...]:
    """Return the integers of a frame of exactly this layout; `what` names it in the error."""
    if len(data) != layout.size:
        raise FrameError(f"{what} frame has {len(data)} bytes; it must have {layout.size}")
    return layout.unpack(data)
