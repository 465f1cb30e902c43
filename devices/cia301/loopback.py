"""CAN frames between processes of one machine: python-can's udp_multicast format, kept on the loopback interface.

python-can's own bus listens on every interface of the machine, so that anybody on the laboratory's network could
command a drive. This one is guaranteed neither to hear nor to be heard by other machines:

* everywhere: it sends with time to live 0 by the loopback interface and joins the group there alone; datagrams from any
  other source than 127.0.0.1 are dropped and counted, and no system takes those in from a network (RFC 1122, 3.2.1.3);
* Linux and macOS: the socket is bound to the group, so that datagrams sent to the machine itself do not reach it;
* Linux: groups that other programs joined on other interfaces do not reach it either (IP_MULTICAST_ALL).

Other programs of the same machine do hear it and may send: that is what it is for.
"""

from __future__ import annotations

import platform
import select
import socket
from ipaddress import IPv4Address
from typing import Any

import can
from can.interfaces.udp_multicast.utils import is_msgpack_installed, pack_message, unpack_message

LOOPBACK = "127.0.0.1"
# The header that Python's socket module does not name: linux/in.h.
_IP_MULTICAST_ALL = 49
_LARGEST_DATAGRAM = 65536
# A flood of datagrams that are dropped must not hold the caller.
_DROPPED_AT_ONCE = 64


class LoopbackBus(can.BusABC):
    """A bus between processes of this machine; `open_loopback` makes one.

    Parameters
    ----------
    joined : socket.socket
        Non-blocking, in the group; it is closed by `shutdown`.
    group, port
        Where frames go.

    Attributes
    ----------
    dropped : int
        Datagrams of other sources.
    """

    def __init__(self, joined: socket.socket, group: str, port: int) -> None:
        super().__init__(group)
        self.dropped = 0
        self._destination = (group, port)
        self._socket = joined

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Send one frame; OSError where the system does not take it within `timeout`, s."""
        data = pack_message(msg)
        try:
            self._socket.sendto(data, self._destination)
        except BlockingIOError:
            select.select([], [self._socket], [], timeout)
            self._socket.sendto(data, self._destination)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        waited = False
        for _ in range(_DROPPED_AT_ONCE):
            try:
                data, source = self._received()
            except BlockingIOError:
                if waited or timeout == 0.0:
                    break
                select.select([self._socket], [], [], timeout)
                waited = True
                continue
            if source != LOOPBACK:
                self.dropped += 1
                continue
            try:
                return unpack_message(data, check=True), False
            except Exception as error:
                # Whatever the bytes of a stranger raise: msgpack's errors have no common class.
                raise can.CanOperationError("could not unpack received message") from error
        return None, False

    def _received(self) -> tuple[bytes, str]:
        data, address = self._socket.recvfrom(_LARGEST_DATAGRAM)
        return data, str(address[0])

    def shutdown(self) -> None:
        """Close the socket."""
        super().shutdown()
        self._socket.close()

    def options(self) -> dict[str, Any]:
        """Return what the system says of the socket: time to live, interface it sends by, address it is bound to."""
        return {
            "time_to_live": self._socket.getsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL),
            "interface": socket.inet_ntoa(self._socket.getsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, 4)),
            "bound": self._socket.getsockname(),
        }


def open_loopback(group: str, port: int) -> LoopbackBus:
    """Open a bus between processes of this machine.

    Parameters
    ----------
    group : str
        An IPv4 multicast address.
    port : int
        1 to 65535. Two buses on one machine must differ in it: outside Linux a socket receives every group of its port.

    Raises
    ------
    ValueError, OSError, can.CanError
        Where that is no group, the system does not grant it, or the package msgpack is missing.
    """
    is_msgpack_installed()
    try:
        is_group = IPv4Address(group).is_multicast
    except ValueError:
        is_group = False
    if not is_group:
        raise ValueError(f"{group} is no IPv4 multicast group, 224.0.0.0 to 239.255.255.255")
    return LoopbackBus(_joined(group, port), group, port)


def _joined(group: str, port: int) -> socket.socket:
    made = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        # Both processes take the same port. macOS wants the second option for it, Windows does not have it.
        made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        if hasattr(socket, "SO_REUSEPORT"):
            made.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEPORT, 1)
        made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_LOOP, 1)
        made.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
        if platform.system() == "Linux":
            made.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)
        # Windows binds to addresses of its own only.
        made.bind(("" if platform.system() == "Windows" else group, port))
        membership = socket.inet_aton(group) + socket.inet_aton(LOOPBACK)
        made.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, membership)
        made.setblocking(False)
    except OSError:
        made.close()
        raise
    return made
