"""What every emulated CANopen node does: NMT, boot-up, heartbeats, object dictionary, SDO, emergency frames (CiA 301).

A device is a subclass of `Device` with an EDS; its node does the rest and knows neither bus nor clock.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia301.dictionary import ObjectStore
from devices.cia301.frames import NmtCommand, NmtState
from devices.cia301.sdo_server import Server

if TYPE_CHECKING:
    from collections.abc import Callable

    Send = Callable[[int, bytes], None]

_RPDOS = (frames.RPDO1, frames.RPDO2, frames.RPDO3, frames.RPDO4)
_REMEMBERED_ERRORS = 8


class Device:
    """What lives on a node; a profile fills the methods it needs, all of which do nothing here.

    Parameters
    ----------
    identifier : int
        Node number, 1 to 127.
    send : callable
        Takes identifier and bytes of each frame; a plain attribute of `node`, so that a fault can stand in its place.
    eds : str
        Text of the electronic data sheet.
    heartbeat_period : float, optional
        Time between heartbeats, s, instead of the EDS's own (object 1017).
    """

    def __init__(self, identifier: int, send: Send, eds: str, *, heartbeat_period: float | None = None) -> None:
        self.node = Node(identifier, send, eds, self, heartbeat_period=heartbeat_period)

    def boot(self) -> None:
        """Power on."""
        self.node.boot()

    def receive(self, identifier: int, data: bytes) -> None:
        """Take one frame from the bus; others' are ignored, malformed ones counted in `node.refused_frames`."""
        self.node.receive(identifier, data)

    def sync(self, counter: int) -> None:
        """Hear SYNC, in every NMT state; answers are sent only where `node.operational`."""

    def take(self, pdo: int, data: bytes) -> None:
        """Take RPDO 1 to 4 of an operational node; FrameError where it makes no sense."""

    def leave_operational(self) -> None:
        """Hear that the node is about to be stopped or reset: nothing may go on moving."""

    def lost(self, node: int) -> None:
        """Hear that the heartbeat of a watched node (object 1016) is overdue."""


class Node:
    """The CANopen side of one device; arguments as of `Device`.

    Attributes
    ----------
    objects : ObjectStore
        The object dictionary.
    state : NmtState
    refused_frames : int
        Frames for this node that made no sense; they did nothing.
    """

    def __init__(
        self, identifier: int, send: Send, eds: str, device: Device, *, heartbeat_period: float | None = None
    ) -> None:
        if not 1 <= identifier <= 127:
            raise ValueError(f"CANopen node is {identifier}; it must be 1 to 127")
        self.identifier = identifier
        self.send = send
        self.state = NmtState.PRE_OPERATIONAL
        self.objects = ObjectStore(eds, identifier)
        self.refused_frames = 0
        self._device = device
        self._server = Server(identifier, self.objects, lambda number, data: self.send(number, data))
        self._rpdos = {base + identifier: number for number, base in enumerate(_RPDOS, start=1)}
        self._errors: list[int] = []
        self._register = 0
        self._heartbeat_due: float | None = None
        self._watched: dict[int, _Watch] = {}
        self._looked = -math.inf
        self._declare(heartbeat_period)

    @property
    def operational(self) -> bool:
        """Whether process data flow."""
        return self.state is NmtState.OPERATIONAL

    def boot(self) -> None:
        """Announce a (re)start; the node is pre-operational after it."""
        self.send(frames.HEARTBEAT + self.identifier, frames.pack_heartbeat(NmtState.BOOT_UP))
        self.state = NmtState.PRE_OPERATIONAL

    def receive(self, identifier: int, data: bytes) -> None:
        """Take one frame from the bus, whoever it is for."""
        counter = 0
        try:
            if identifier == frames.SYNC:
                counter = frames.unpack_sync(data)
            elif identifier in self._rpdos:
                if self.operational:
                    self._device.take(self._rpdos[identifier], data)
            elif identifier == frames.NMT:
                self._command(data)
            elif identifier in self._watched:
                frames.unpack_heartbeat(data)
                self._watched[identifier].heard = True
            elif identifier == frames.SDO_REQUEST + self.identifier:
                self._serve(data)
        except frames.FrameError:
            self.refused_frames += 1
        if counter:
            # Not above: an error of the device's own is none of the sender's.
            self._device.sync(counter)

    def beat(self, now: float) -> None:
        """Send the heartbeat if it is due at `now`, s, and miss others' that are overdue, whatever the SYNC does."""
        if self._period > 0.0 and (self._heartbeat_due is None or now >= self._heartbeat_due):
            self._heartbeat_due = now + self._period
            self.send(frames.HEARTBEAT + self.identifier, frames.pack_heartbeat(self.state))
        away, self._looked = now - self._looked, now
        for watch in self._watched.values():
            if watch.overdue(now, away):
                self._device.lost(watch.node)

    def emergency(self, code: int, register: int, detail: bytes = bytes(5)) -> None:
        """Send an emergency frame, and remember it (objects 1001 and 1003); code 0 says that the error is over."""
        self._register = register
        if code != 0:
            self._errors = [code, *self._errors][:_REMEMBERED_ERRORS]
        if self.state is not NmtState.STOPPED:
            self.send(frames.EMCY + self.identifier, frames.pack_emergency(frames.Emergency(code, register, detail)))

    def _declare(self, heartbeat_period: float | None) -> None:
        objects, declared = self.objects, self.objects.object_dictionary
        self._period = 0.0
        if heartbeat_period is not None:
            objects.set(0x1017, round(1e3 * heartbeat_period))
        if 0x1017 in declared:
            self._produce(objects.get(0x1017))
            objects.on_write(0x1017, self._produce)
        if 0x1016 in declared:
            objects.on_write(0x1016, self._watch, 1)
        objects.on_read(0x1001, lambda: self._register)
        if 0x1003 in declared:
            objects.on_read(0x1003, lambda: len(self._errors))
            for sub in range(1, _REMEMBERED_ERRORS + 1):
                objects.on_read(0x1003, lambda k=sub: self._errors[k - 1] if k <= len(self._errors) else 0, sub)

    def _produce(self, milliseconds: int) -> None:
        self._period = 1e-3 * milliseconds
        self._heartbeat_due = None

    def _watch(self, entry: int) -> None:
        """Watch the heartbeat of one other node, as object 1016 says: its number and a time, ms; 0 watches nobody."""
        node, milliseconds = entry >> 16 & 0x7F, entry & 0xFFFF
        self._watched = {}
        if node and milliseconds:
            self._watched[frames.HEARTBEAT + node] = _Watch(node, 1e-3 * milliseconds)

    def _serve(self, data: bytes) -> None:
        if len(data) != 8:
            raise frames.FrameError(f"SDO frame has {len(data)} bytes; it must have 8")
        if self.state is not NmtState.STOPPED:
            self._server.serve(data)

    def _command(self, data: bytes) -> None:
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
            self._device.leave_operational()
        if command == NmtCommand.STOP:
            self.state = NmtState.STOPPED
        elif command == NmtCommand.ENTER_PRE_OPERATIONAL:
            self.state = NmtState.PRE_OPERATIONAL
        else:
            # Parameters of the application are kept, as if they had been stored (object 1010).
            self.objects.restore(0x1000, 0x1FFF)
            self.boot()


@dataclass(slots=True)
class _Watch:
    """One entry of object 1016: watched from the first heartbeat on (CiA 301, 7.2.8.3.2.2)."""

    node: int
    limit: float
    heard: bool = False
    deadline: float | None = None

    def overdue(self, now: float, away: float) -> bool:
        """Return whether the heartbeat has been missing for longer than the limit; said once, until it is back.

        Time in which this node itself did not look, `away` s, is not the other one's silence.
        """
        if self.heard or (self.deadline is not None and away > 0.5 * self.limit):
            self.heard, self.deadline = False, now + self.limit
        elif self.deadline is not None and now > self.deadline:
            self.deadline = None
            return True
        return False
