"""The PDOs of a servo drive, as its EDS maps them: bytes in and out. Units are told by the EDS too (`units`).

| frame | identifier | bytes |
|---|---|---|
| RPDO1 | 200 + node | controlword u16 (6040), target position i32 (607A) |
| TPDO1 | 180 + node | statusword u16 (6041), actual position i32 (6064) |
| TPDO2 | 280 + node | acceleration i32 (2100) |
"""

from __future__ import annotations

from struct import Struct

from devices.cia301.frames import unpack

_WORD_POSITION = Struct("<Hi")


def pack_target(controlword: int, target: int) -> bytes:
    """Return RPDO1: controlword and target position."""
    return _WORD_POSITION.pack(controlword, target)


def unpack_target(data: bytes) -> tuple[int, int]:
    """Return controlword and target position of RPDO1."""
    controlword, target = unpack(_WORD_POSITION, data, "RPDO1")
    return controlword, target


def pack_actual(statusword: int, position: int) -> bytes:
    """Return TPDO1: statusword and actual position."""
    return _WORD_POSITION.pack(statusword, position)


def unpack_actual(data: bytes) -> tuple[int, int]:
    """Return statusword and actual position of TPDO1."""
    statusword, position = unpack(_WORD_POSITION, data, "TPDO1")
    return statusword, position
