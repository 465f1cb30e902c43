"""Opening a CAN bus by python-can's interface name; the only module that imports python-can."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Self

import can

from devices.errors import BusFailure, BusUnavailable

if TYPE_CHECKING:
    from types import TracebackType

# A group of python-can's own; the IPv6 default is not routed on many laboratory machines.
UDP_GROUP = "239.74.163.2"
# Without a time limit one full queue of the virtual interface blocks the sender for ever.
SEND_LIMIT = 0.05
# A reader that sleeps for ten seconds at 1 kHz loses no frame; one that is never read does not fill the memory.
VIRTUAL_QUEUE = 65536
# A flood of frames that are passed over must not hold the caller.
PASS_OVER_LIMIT = 64


class CanBus:
    """Bare data frames over any python-can bus: identifier and bytes.

    Remote, error and extended frames, and datagrams that are no frame at all, are passed over and counted in `ignored`.

    Parameters
    ----------
    bus : can.BusABC
        An open bus; it is shut down by `close`.
    """

    def __init__(self, bus: can.BusABC) -> None:
        self._bus = bus
        self._closed = False
        self.ignored = 0

    def __str__(self) -> str:
        return self._bus.channel_info

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
            if message.is_extended_id or message.is_remote_frame or message.is_error_frame:
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
        must differ in `port`, not only in group: a socket receives every group of its port.
    **arguments
        Passed on untouched. Where they do not say otherwise, udp_multicast gets `hop_limit=0` (python-can's own default
        lets the whole local network hear and command the drive) and classic frames only.

    Raises
    ------
    BusUnavailable
        Where interface, driver, dependency or network are not there; one sentence.

    Examples
    --------
    >>> with open_bus("virtual", "doctest") as one, open_bus("virtual", "doctest") as other:
    ...     one.send(0x080, b"\\x01")
    ...     other.receive()
    (128, b'\\x01')
    """
    if interface == "udp_multicast":
        channel = UDP_GROUP if channel is None else channel
        arguments = {"hop_limit": 0, "fd": False} | arguments
    elif interface == "virtual":
        arguments = {"rx_queue_size": VIRTUAL_QUEUE} | arguments
    try:
        # ignore_config: what moves a table is what the caller said, not a forgotten ~/.canrc.
        bus: can.BusABC = can.Bus(channel=channel, interface=interface, ignore_config=True, **arguments)
    except (can.CanError, NotImplementedError, ImportError, OSError, TypeError, ValueError, AttributeError) as error:
        where = interface if channel is None else f"{interface} on {channel}"
        raise BusUnavailable(f"CAN bus {where} cannot be opened here: {_one_line(error)}") from error
    return CanBus(bus)


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if error.__cause__ is not None:
        text += f" ({' '.join(str(error.__cause__).split())})"
    return text
