"""Opening a CAN bus by python-can's interface name, and what can be opened here."""

from __future__ import annotations

import logging
import struct
import time
import uuid
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import can

from devices.cia301.in_process import InProcessBus
from devices.cia301.loopback import open_loopback
from devices.errors import BusFailure, BusUnavailable

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    Tap = Callable[[float, int, bytes, bool], None]

# A group of python-can's own; the IPv6 default is not routed on many laboratory machines.
UDP_GROUP, UDP_PORT = "239.74.163.2", 43113
# Without a time limit one full queue of the virtual interface blocks the sender for ever.
SEND_LIMIT = 0.05
# A reader that sleeps for ten seconds at 1 kHz loses no frame; one that is never read does not fill the memory.
VIRTUAL_QUEUE = 65536
# A flood of frames that are passed over must not hold the caller.
PASS_OVER_LIMIT = 64
# Interfaces whose drivers tell what is plugged in; a serial port, say, may be anything.
_HARDWARE = ("socketcan", "pcan", "kvaser", "vector", "ixxat", "usb2can", "neovi")
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

    Passed over and counted: remote, FD and extended frames and datagrams that are no frame at all in `ignored`, error
    frames in `errors`, own frames that the bus sends back in `echoes`.

    Parameters
    ----------
    bus : can.BusABC
        An open bus; it is shut down by `close`.
    name : str, optional
        What messages call it; python-can's own words unless told.
    echoing : bool
        Whether own frames come back and do not say so: they are then marked, in python-can's field `channel`, so that
        they can be told from the same frame of somebody else.

    Attributes
    ----------
    ignored, errors, echoes : int
    tap : callable or None
        Called with the host's time (s since 1970), identifier, bytes, and whether it was sent, of every data frame that
        was sent or received: for recordings. It must be quick and must not raise.
    """

    def __init__(self, bus: can.BusABC, name: str | None = None, *, echoing: bool = False) -> None:
        self._mark = uuid.uuid4().hex[:12] if echoing else None
        self._bus = bus
        self._name = name or bus.channel_info
        self._closed = False
        self.ignored = self.errors = self.echoes = 0
        self.tap: Tap | None = None

    def __str__(self) -> str:
        return self._name

    @property
    def raw(self) -> can.BusABC:
        """python-can's own bus."""
        return self._bus

    @property
    def echoing(self) -> bool:
        """Whether own frames are marked."""
        return self._mark is not None

    def send(self, identifier: int, data: bytes) -> None:
        """Send one data frame with an 11-bit identifier; it takes `SEND_LIMIT` s at most.

        Raises
        ------
        BusFailure
            Where the bus does not take it.
        """
        self._put(
            can.Message(arbitration_id=identifier, data=data, is_extended_id=False, channel=self._mark),
            f"frame {identifier:03x}",
        )
        if self.tap is not None:
            self.tap(time.time(), identifier, data, True)

    def send_error(self) -> None:
        """Send an error frame, as far as the interface can: what a fault is made of. Errors as of `send`."""
        self._put(can.Message(is_error_frame=True, channel=self._mark), "an error frame")

    def _put(self, message: can.Message, what: str) -> None:
        try:
            self._bus.send(message, timeout=SEND_LIMIT)
        except (can.CanError, OSError) as error:
            raise BusFailure(f"{self} did not take {what}: {_one_line(error)}") from error

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
            if not message.is_rx or (self._mark is not None and message.channel == self._mark):
                self.echoes += 1
                continue
            if message.is_error_frame:
                self.errors += 1
                continue
            if message.is_extended_id or message.is_remote_frame or message.is_fd:
                self.ignored += 1
                continue
            data = bytes(message.data)
            if self.tap is not None:
                self.tap(time.time(), message.arbitration_id, data, False)
            return message.arbitration_id, data
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


def _detected() -> list[Mapping[str, Any]]:
    # Drivers that are not installed are no news: python-can warns of each.
    log = logging.getLogger("can")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        return list(can.detect_available_configs(interfaces=_HARDWARE))
    finally:
        log.setLevel(before)


class BusChoice(NamedTuple):
    """A bus that can be opened here; `channel` is None where the default does, `note` says what it is for."""

    interface: str
    channel: str | None
    note: str


def available_buses() -> tuple[BusChoice, ...]:
    """Return what can be opened here. No CAN hardware is opened to find out: the drivers are asked what they see.

    Examples
    --------
    >>> available_buses()[0]
    BusChoice(interface='virtual', channel=None, note='inside one process: an emulated table')
    """
    found = [BusChoice("virtual", None, "inside one process: an emulated table")]
    try:
        open_bus("udp_multicast").close()
    except BusUnavailable:
        pass
    else:
        found.append(BusChoice("udp_multicast", UDP_GROUP, "between processes of this machine: twin emulate, twin run"))
    for config in _detected():
        found.append(BusChoice(str(config["interface"]), str(config["channel"]), "hardware or its driver's own"))
    return tuple(found)


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
        Passed on untouched, but for udp_multicast: it stays on this machine (`devices.cia301.loopback`; `port` is the
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
        if interface == "virtual":
            return CanBus(InProcessBus(**({} if channel is None else {"channel": channel}), **arguments))
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
        return CanBus(
            can.Bus(channel=group, interface="udp_multicast", ignore_config=True, **arguments), name, echoing=True
        )
    for option in arguments:
        raise TypeError(f"{option} is no option of a bus that stays on this machine; port is")
    return CanBus(open_loopback(group, port), name, echoing=True)


def _one_line(error: BaseException) -> str:
    text = " ".join(str(error).split()) or type(error).__name__
    if error.__cause__ is not None:
        text += f" ({' '.join(str(error.__cause__).split())})"
    return text
