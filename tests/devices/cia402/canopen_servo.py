"""A servo built on canopen's LocalNode, with nothing of ours but the EDS: our host must be able to drive others.

LocalNode has SDO server, NMT and heartbeat; it neither sends its TPDOs on SYNC nor fills them from its dictionary, so
the cycle is written here, by canopen's own table of CiA 402's transitions.
"""

from __future__ import annotations

import struct
from contextlib import contextmanager
from importlib.resources import files
from typing import TYPE_CHECKING

import canopen
from canopen.profiles.p402 import State402

if TYPE_CHECKING:
    from collections.abc import Iterator

H = 1e-3
_AUTOMATIC = 0x00


class LocalServo:
    """Stiff: it is where it is told to be; a quick stop takes 1 m/s2 off its velocity until it stands."""

    def __init__(self, channel: str, position: int = 0) -> None:
        self.network = canopen.Network()
        self.network.connect(interface="virtual", channel=channel)
        self.node = self.network.create_node(1, str(files("devices.cia402").joinpath("servo_drive.eds")))
        self.state = "SWITCH ON DISABLED"
        self.position = position
        self.velocity = 0.0
        self.path = [position]
        self._command = 0, position
        self._target = position
        self._reset_bit = False
        self.node.add_read_callback(self._answer)
        self.network.subscribe(0x080, self._on_sync)
        self.network.subscribe(0x201, self._on_rpdo)
        self.node.nmt.state = "INITIALISING"
        self.node.nmt.state = "PRE-OPERATIONAL"

    def close(self) -> None:
        """Stop its threads."""
        self.node.nmt.stop_heartbeat()
        self.network.disconnect()

    def setting(self, index: int, sub: int = 0) -> int:
        """Return what a host has written."""
        variable = self.node.sdo[index]
        return (variable[sub] if sub else variable).raw

    def fail(self, code: int) -> None:
        """Go into fault and say so."""
        self.state = "FAULT"
        self.velocity = 0.0
        self.node.emcy.send(code, 0x21, bytes(5))

    def _answer(self, index: int, subindex: int, od: object) -> int | None:
        if index == 0x6061:
            return self.node.sdo[0x6060].raw
        return None

    def _on_rpdo(self, can_id: int, data: bytes, timestamp: float) -> None:
        self._command = struct.unpack("<Hi", data)

    def _on_sync(self, can_id: int, data: bytes, timestamp: float) -> None:
        if self.node.nmt.state != "OPERATIONAL":
            return
        self._move()
        bits = State402.SW_MASK[self.state][1] | 1 << 9
        self.network.send_message(0x181, struct.pack("<Hi", bits, self.position))
        self.network.send_message(0x281, struct.pack("<i", 1_500_000))
        controlword, self._target = self._command
        self._obey(controlword)

    def _move(self) -> None:
        before = self.position
        if self.state == "OPERATION ENABLED":
            self.position = self._target
            self.velocity = (self.position - before) * 1e-9 / H
        elif self.velocity:
            slower = max(0.0, abs(self.velocity) - 1.0 * H)
            self.velocity = slower if self.velocity > 0 else -slower
            self.position += round(self.velocity * H / 1e-9)
        if self.state == "QUICK STOP ACTIVE" and not self.velocity:
            self.state = "SWITCH ON DISABLED"
        self.path.append(self.position)

    def _obey(self, controlword: int) -> None:
        rising = bool(controlword & 0x80) and not self._reset_bit
        self._reset_bit = bool(controlword & 0x80)
        if self.state == "FAULT":
            if rising:
                self.state = "SWITCH ON DISABLED"
                self.node.emcy.reset()
            return
        if self.state == "OPERATION ENABLED" and controlword == State402.CW_QUICK_STOP:
            self.state = "QUICK STOP ACTIVE"
            return
        for (source, target), word in State402.TRANSITIONTABLE.items():
            if source == self.state and word == controlword != _AUTOMATIC:
                self.state = target
                return
        if controlword == State402.CW_DISABLE_VOLTAGE and self.state != "QUICK STOP ACTIVE":
            self.state = "SWITCH ON DISABLED"


@contextmanager
def local_servo(channel: str, position: int = 0) -> Iterator[LocalServo]:
    """A servo that is served by its network's Notifier."""
    servo = LocalServo(channel, position)
    try:
        yield servo
    finally:
        servo.close()
