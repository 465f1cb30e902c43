"""Opening a CAN bus by python-can's interface name; only this module and `loopback` import python-can."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any, Self

import can

from devices.cia402.loopback import open_loopback
from devices.errors import BusFailure, BusUnavailable

if TYPE_CHECKING:
    from types import TracebackType

# A group of python-can's own; the IPv6 default is not routed on many laboratory machines.
UDP_GROUP, UDP_PORT = "239.74.163.2", 43113
# Without a time limit one full queue of the virtual interface blocks the sender for ever.
SEND_LIMIT = 0.05
# A reader that sleeps for ten seconds at 1 kHz loses no frame; one that is never read does not fill the memory.
VIRTUAL_QUEUE = 65536
# A flood of frames that are passed over must not hold the caller.
PASS_OVER_LIMIT = 64
# What python-can's interfaces raise on options they do not know, values of the wrong kind, and what is not there.
_CANNOT_OPEN = (
    can.CanError,
    NotImplementedError,
    ImportError,
    OSError,
    TypeError,
    ValueError,
    AttributeError,
    OverflowError,
    struct.error,
)


class CanBus:
    """Bare data frames over any python-can bus: identifier and bytes.

    Remote, error, FD and extended frames, and datagrams that are no frame at all, are passed over and counted in
    `ignored`.

    Parameters
    ----------
    bus : can.BusABC
        An open bus; it is shut down by `close`.
    name : str, optional
        What messages call it; python-can's own words unless told.
    """

    def __init__(self, bus: can.BusABC, name: str | None = None) -> None:
        self._bus = bus
        self._name = name or bus.channel_info
        self._closed = False
        self.ignored = 0

    def __str__(self) -> str:
        return self._name

    def send(self, identifier: int, data: bytes) -> None:
        """Send one data frame with an 11-bit identifier; it takes `SEND_LIMIT` s at most.

        Raises
        ------
        BusFailure
            Where the bus does not take it.
        """
        message = can.Message(arbitration_id=identifier, data=data, is_extended_id=False)
        try:
            self._bus.send(message, timeout=SEND_LIMIT)
        except (can.CanError, OSError) as error:
            raise BusFailure(f"{self} did not take frame {identifier:03x}: {_one_line(error)}") from error

    def receive(self, time_limit: float = 0.0) -> tuple[int, bytes] | None:
        """Return identifier and bytes of the next frame, or None when none came within `time_limit`, s.

        Raises
        ------
        BusFailure
            Where the bus is gone.
        """
        for _ in range(PASS_OVER_LIMIT):
            try:
                message = self._bus.recv(time_limit)
            except can.CanOperationError as error:
                if error.__cause__ is None or isinstance(error.__cause__, OSError):
                    raise BusFailure(f"{self} failed while receiving: {_one_line(error)}") from error
                # udp_multicast met a datagram that is no frame: anybody on the machine can send one.
                self.ignored += 1
                continue
            except OSError as error:
                raise BusFailure(f"{self} failed while receiving: {_one_line(error)}") from error
            if message is None:
                return None
            if message.is_extended_id or message.is_remote_frame or message.is_error_frame or message.is_fd:
                self.ignored += 1
                continue
            return message.arbitration_id, bytes(message.data)
        return None

    def close(self) -> None:
        """Shut the bus down; a second call does nothing."""
        if not self._closed:
            self._closed = True
            self._bus.shutdown()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self.close()


def open_bus(interface: str = "virtual", channel: str | int | None = None, **arguments: Any) -> CanBus:
    """Open a bus by python-can's interface name.

    Parameters
    ----------
    interface : str
        "virtual" (inside one process), "udp_multicast" (between processes of one machine), or any other of
        python-can's.
    channel : str or int, optional
        As python-can wants it. udp_multicast: the group, by default the IPv4 one `UDP_GROUP`. Two buses on one machine
        must differ in `port`, not only in group.
    **arguments
        Passed on untouched, but for udp_multicast: it stays on this machine (`devices.cia402.loopback`; `port` is the
        only option) unless a `hop_limit` above 0 is given. That asks for the network, where everybody hears and
        commands the drive: python-can's own bus is then opened, on every interface, with classic frames only.

    Raises
    ------
    BusUnavailable
        Where interface, option, driver, dependency or network are not there; one sentence.

    Examples
    --------
    >>> with open_bus("virtual", "doctest") as one, open_bus("virtual", "doctest") as other:
    ...     one.send(0x080, b"\\x01")
    ...     other.receive()
    (128, b'\\x01')
    """
    if interface == "udp_multicast":
        channel = UDP_GROUP if channel is None else channel
        arguments = {"port": UDP_PORT, "hop_limit": 0} | arguments
    elif interface == "virtual":
        arguments = {"rx_queue_size": VIRTUAL_QUEUE} | arguments
    try:
        if type(size := arguments.get("rx_queue_size", 0)) is not int:
            # python-can finds out when the first frame is sent.
            raise TypeError(f"rx_queue_size is {size!r}; it must be a whole number")
        if interface == "udp_multicast":
            return _multicast(str(channel), **arguments)
        # ignore_config: what moves a table is what the caller said, not a forgotten ~/.canrc.
        return CanBus(can.Bus(channel=channel, interface=interface, ignore_config=True, **arguments))
    except _CANNOT_OPEN as error:
        where = interface if channel is None else f"{interface} on {channel}"
        raise BusUnavailable(f"CAN bus {where} cannot be opened here: {_one_line(error)}") from error


def _multicast(group: str, *, hop_limit: int, port: int, **arguments: Any) -> CanBus:
    # python-can leaves an open socket behind where it meets such a number.
    for what, number, least, most in (("hop_limit", hop_limit, 0, 255), ("port", port, 1, 65535)):
        if type(number) is not int or not least <= number <= most:
            raise ValueError(f"{what} is {number}; it must be {least} to {most}")
    name = f"udp_multicast {group}:{port}"
    if hop_limit != 0:
        arguments = {"fd": False} | arguments | {"hop_limit": hop_limit, "port": port}
        return CanBus(can.Bus(channel=group, interface="udp_multicast", ignore_config=True, **arguments), name)
    for option in arguments:
        raise TypeError(f"{option} is no option of a bus that stays on this machine; port is")
    return CanBus(open_loopback(group, port), name)


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if error.__cause__ is not None:
        text += f" ({' '.join(str(error.__cause__).split())})"
    return text
