"""What every emulated CANopen node does: NMT, boot-up, heartbeat, emergency frames (CiA 301)."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from devices.cia402 import frames
from devices.cia402.frames import NmtCommand, NmtState

if TYPE_CHECKING:
    from collections.abc import Callable

    Send = Callable[[int, bytes], None]


class Device(Protocol):
    """What lives on a node."""

    def leave_operational(self) -> None:
        """The node was stopped or reset."""
        ...


class Node:
    """The CANopen side of one node; frames go out through `send(identifier, data)`.

    Parameters
    ----------
    identifier : int
        Node number, 1 to 127.
    send : callable
        Takes identifier and bytes of a frame.
    heartbeat_period : float
        Time between heartbeats, s (object 1017).
    """

    def __init__(self, identifier: int, send: Send, heartbeat_period: float) -> None:
        if not 1 <= identifier <= 127:
            raise ValueError(f"CANopen node is {identifier}; it must be 1 to 127")
        self.identifier = identifier
        self.send = send
        self.state = NmtState.PRE_OPERATIONAL
        self._heartbeat_period = heartbeat_period
        self._heartbeat_due: float | None = None

    @property
    def operational(self) -> bool:
        """Whether process data flow."""
        return self.state is NmtState.OPERATIONAL

    def boot(self) -> None:
        """Announce a (re)start; the node is pre-operational after it."""
        self.send(frames.HEARTBEAT + self.identifier, frames.pack_heartbeat(NmtState.BOOT_UP))
        self.state = NmtState.PRE_OPERATIONAL

    def command(self, data: bytes, device: Device) -> None:
        """Obey an NMT frame, if it is for this node; unknown commands are ignored, as CiA 301 wants."""
        command, node = frames.unpack_nmt(data)
        if node not in (0, self.identifier):
            return
        if command == NmtCommand.START:
            self.state = NmtState.OPERATIONAL
            return
        if command not in list(NmtCommand):
            return
        if self.operational:
            device.leave_operational()
        if command == NmtCommand.STOP:
            self.state = NmtState.STOPPED
        elif command == NmtCommand.ENTER_PRE_OPERATIONAL:
            self.state = NmtState.PRE_OPERATIONAL
        else:
            self.boot()

    def beat(self, now: float) -> None:
        """Send the heartbeat if it is due at `now`, s; the node's own time, whatever the SYNC does."""
        if self._heartbeat_due is None:
            self._heartbeat_due = now
        if now >= self._heartbeat_due:
            self._heartbeat_due = now + self._heartbeat_period
            self.send(frames.HEARTBEAT + self.identifier, frames.pack_heartbeat(self.state))

    def emergency(self, code: int, register: int, detail: bytes = bytes(5)) -> None:
        """Send an emergency frame."""
        self.send(frames.EMCY + self.identifier, frames.pack_emergency(frames.Emergency(code, register, detail)))
