"""The SDO server of an emulated node: canopen's own, fed by hand, hardened against what anybody may send."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, cast

from canopen.sdo.constants import EXPEDITED, NO_MORE_DATA
from canopen.sdo.server import SdoServer

from devices.cia301.dictionary import OUT_OF_MEMORY, WRONG_COMMAND, Refused
from devices.cia301.frames import SDO_ANSWER, SDO_REQUEST

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.dictionary import ObjectStore

    Send = Callable[[int, bytes], None]

# No object of ours is longer; a segmented download must not fill the memory.
_LONGEST = 1024


class _Sender:
    """What of a canopen network its SDO server uses."""

    def __init__(self, send: Send) -> None:
        self._send = send

    def send_message(self, can_id: int, data: bytes) -> None:
        self._send(can_id, bytes(data))


class Server(SdoServer):
    """Answers SDO requests to one node; frames go out through `send(identifier, data)`.

    Without these lines canopen 2.4 raises out of `on_request` where a segment or an unknown command comes before any
    transfer was begun, and takes segments for ever.
    """

    def __init__(self, node: int, objects: ObjectStore, send: Send) -> None:
        super().__init__(SDO_REQUEST + node, SDO_ANSWER + node, cast("Any", objects))
        self.network = cast("Any", _Sender(send))
        self._index = self._subindex = 0
        self._buffer = bytearray()
        self._loading = ""

    def serve(self, data: bytes) -> None:
        """Answer one request of eight bytes."""
        self.on_request(self.rx_cobid, data, 0.0)  # pyright: ignore[reportUnknownMemberType]

    def init_upload(self, request: bytes) -> None:
        """Begin to hand an object over."""
        self._loading, self._buffer = "", bytearray()
        super().init_upload(request)  # pyright: ignore[reportUnknownMemberType]
        self._loading = "up"

    def init_download(self, request: bytes) -> None:
        """Begin to take an object."""
        # Before anything can fail: the abort names the object that was asked for.
        self._index, self._subindex = int.from_bytes(request[1:3], "little"), request[3]
        self._loading = ""
        super().init_download(request)  # pyright: ignore[reportUnknownMemberType]
        self._loading = "" if request[0] & EXPEDITED else "down"

    def segmented_upload(self, command: int) -> None:
        """Hand over the next seven bytes of the object that is being read."""
        if self._loading != "up" or not self._buffer:
            raise Refused(WRONG_COMMAND)
        super().segmented_upload(command)  # pyright: ignore[reportUnknownMemberType]

    def segmented_download(self, command: int, request: bytes) -> None:
        """Take the next seven bytes of the object that is being written."""
        if self._loading != "down":
            raise Refused(WRONG_COMMAND)
        if len(self._buffer) > _LONGEST:
            self._loading = ""
            raise Refused(OUT_OF_MEMORY)
        super().segmented_download(command, request)  # pyright: ignore[reportUnknownMemberType]
        if command & NO_MORE_DATA:
            self._loading = ""
