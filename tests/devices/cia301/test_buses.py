"""Opening buses, and what python-can's have in store."""

from __future__ import annotations

from typing import Any

import can
import pytest

from devices.cia301 import buses
from devices.cia301.buses import CanBus, open_bus
from devices.errors import BusFailure, BusUnavailable


class Scripted(can.BusABC):
    """Receives what it is told to; exceptions are raised."""

    channel_info = "scripted bus"

    def __init__(self, *script: object) -> None:
        super().__init__("scripted")
        self.script = list(script)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        item = self.script.pop(0) if self.script else None
        if isinstance(item, BaseException):
            raise item
        return item, True  # type: ignore[return-value]

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        assert timeout is not None
        raise can.CanOperationError("queue\nfull")


@pytest.mark.parametrize(
    ("interface", "arguments"),
    [
        ("no_such_interface", {}),
        ("socketcan", {"channel": "nocan77"}),
        ("udp_multicast", {"channel": "not a group", "port": 47001}),
        ("udp_multicast", {"receive_own_messages": True}),
        ("udp_multicast", {"port": "x"}),
        ("udp_multicast", {"port": 0}),
        ("udp_multicast", {"port": 99999}),
        ("udp_multicast", {"channel": "10.0.0.1"}),
        ("udp_multicast", {"channel": "ff15::1"}),
        ("udp_multicast", {"fd": True}),
        ("udp_multicast", {"hop_limit": "far"}),
        ("udp_multicast", {"hop_limit": 1, "port": 99999}),
        ("virtual", {"rx_queue_size": "long"}),
    ],
)
def test_a_bus_that_is_not_there_is_one_sentence(interface: str, arguments: dict[str, Any]) -> None:
    with pytest.raises(BusUnavailable, match=f"CAN bus {interface}.* cannot be opened here: .") as error:
        open_bus(interface, **arguments)
    assert "\n" not in str(error.value)


def test_missing_dependency(monkeypatch) -> None:
    monkeypatch.setattr("can.interfaces.udp_multicast.utils.msgpack", None)
    with pytest.raises(BusUnavailable, match="msgpack not installed"):
        open_bus("udp_multicast")


def test_what_reaches_python_can(monkeypatch) -> None:
    seen: list[dict[str, Any]] = []

    def fake(**arguments: Any) -> can.BusABC:
        seen.append(arguments)
        return Scripted()

    monkeypatch.setattr(buses.can, "Bus", fake)
    for interface, channel, arguments in (
        ("udp_multicast", None, {"hop_limit": 1}),
        ("udp_multicast", "239.1.2.3", {"hop_limit": 2, "fd": True, "port": 4711}),
        ("pcan", "PCAN_USBBUS1", {"bitrate": 1_000_000, "auto_reset": True}),
    ):
        open_bus(interface, channel, **arguments).close()
    common = {"ignore_config": True}
    assert seen[0] == common | {
        "interface": "udp_multicast",
        "channel": buses.UDP_GROUP,
        "hop_limit": 1,
        "port": buses.UDP_PORT,
        "fd": False,
    }
    assert seen[1] == common | {
        "interface": "udp_multicast",
        "channel": "239.1.2.3",
        "hop_limit": 2,
        "port": 4711,
        "fd": True,
    }
    assert seen[2] == common | {
        "interface": "pcan",
        "channel": "PCAN_USBBUS1",
        "bitrate": 1_000_000,
        "auto_reset": True,
    }


def test_frames_that_are_not_ours_are_passed_over() -> None:
    garbage = can.CanOperationError("could not unpack received message")
    garbage.__cause__ = ValueError("not msgpack")
    bus = CanBus(
        Scripted(
            can.Message(arbitration_id=0x181, is_extended_id=True),
            can.Message(arbitration_id=0x181, is_extended_id=False, is_remote_frame=True),
            can.Message(is_error_frame=True, is_extended_id=False),
            can.Message(arbitration_id=0x181, is_extended_id=False, is_fd=True),
            garbage,
            can.Message(arbitration_id=0x181, is_extended_id=False, data=b"abc"),
        )
    )
    assert bus.receive() == (0x181, b"abc")
    assert (bus.ignored, bus.errors) == (4, 1)
    assert bus.receive() is None
    bus.close()
    bus.close()


def test_a_flood_of_them_ends_the_wait() -> None:
    flood = [can.Message(arbitration_id=1, is_extended_id=True)] * 1000
    with CanBus(Scripted(*flood)) as bus:
        assert bus.receive() is None
        assert bus.ignored == buses.PASS_OVER_LIMIT


@pytest.mark.parametrize("error", [can.CanOperationError("gone"), OSError("gone")])
def test_a_bus_that_fails(error: Exception) -> None:
    with CanBus(Scripted(error)) as bus:
        with pytest.raises(BusFailure, match="scripted bus failed while receiving: gone"):
            bus.receive()
        with pytest.raises(BusFailure, match="scripted bus did not take frame 080: queue full"):
            bus.send(0x080, b"\x01")


def test_a_full_virtual_queue_is_an_error_and_no_hang() -> None:
    with open_bus("virtual", "full", rx_queue_size=1), open_bus("virtual", "full") as sender:
        sender.send(1, b"")
        with pytest.raises(BusFailure, match="did not take frame 001"):
            sender.send(1, b"")


def test_a_closed_bus() -> None:
    bus = open_bus("virtual", "closed")
    bus.close()
    with pytest.raises(BusFailure, match="closed"):
        bus.receive()


def test_a_tap_hears_what_is_sent_and_received() -> None:
    heard: list[tuple[int, bytes, bool]] = []
    times: list[float] = []

    def tap(time: float, identifier: int, data: bytes, sent: bool) -> None:
        times.append(time)
        heard.append((identifier, data, sent))

    with open_bus("virtual", "tapped") as one, open_bus("virtual", "tapped") as other:
        one.send(0x001, b"before")
        one.tap = tap
        one.send(0x123, b"out")
        other.send(0x456, b"in")
        assert one.receive() == (0x456, b"in")
        assert one.receive() is None
        one.tap = None
        one.send(0x002, b"after")
    assert heard == [(0x123, b"out", True), (0x456, b"in", False)]
    assert 1.6e9 < times[0] <= times[1]


def test_a_frame_that_was_not_taken_is_not_tapped() -> None:
    heard: list[object] = []
    with open_bus("virtual", "full tap", rx_queue_size=1), open_bus("virtual", "full tap") as sender:
        sender.send(1, b"")
        sender.tap = lambda *frame: heard.append(frame)
        with pytest.raises(BusFailure):
            sender.send(1, b"")
    assert heard == []


def test_frames_do_not_share_their_bytes() -> None:
    """python-can copies a frame for each listener; ours gives the last one the frame itself."""
    with (
        open_bus("virtual", "copies") as one,
        open_bus("virtual", "copies") as two,
        open_bus("virtual", "copies") as three,
    ):
        one.send(0x7FF, b"\x01\x02")
        first = two._bus.recv(0.0)
        second = three._bus.recv(0.0)
    assert first is not None
    assert second is not None
    first.data[0] = 9
    assert bytes(second.data) == b"\x01\x02"
    assert (second.arbitration_id, second.is_extended_id, second.dlc, second.is_rx) == (0x7FF, False, 2, True)


def test_an_end_of_python_cans_own_hears_ours_and_is_heard() -> None:
    with open_bus("virtual", "theirs") as ours, can.Bus("theirs", interface="virtual") as theirs:
        ours.send(0x123, b"\x01")
        heard = theirs.recv(0.0)
        theirs.send(can.Message(arbitration_id=0x321, data=b"\x02", is_extended_id=False))
        assert ours.receive() == (0x321, b"\x02")
        assert ours.receive() is None
    assert heard is not None
    assert (heard.arbitration_id, bytes(heard.data), heard.is_rx) == (0x123, b"\x01", True)


def test_what_can_be_opened_here(monkeypatch) -> None:
    asked: list[object] = []

    def detected(interfaces: object) -> list[dict[str, object]]:
        asked.append(interfaces)
        return [{"interface": "socketcan", "channel": "can0"}, {"interface": "kvaser", "channel": 0}]

    monkeypatch.setattr(buses.can, "detect_available_configs", detected)
    monkeypatch.setattr(buses.can, "Bus", None)
    monkeypatch.setattr(buses, "open_loopback", lambda *_: Scripted())
    found = buses.available_buses()
    assert [(choice.interface, choice.channel) for choice in found] == [
        ("virtual", None),
        ("udp_multicast", buses.UDP_GROUP),
        ("socketcan", "can0"),
        ("kvaser", "0"),
    ]
    assert all(choice.note for choice in found)
    assert len(asked) == 1


def test_a_bus_that_is_not_granted_is_not_offered(monkeypatch) -> None:
    def refused(group: str, port: int) -> can.BusABC:
        raise OSError("no such device")

    monkeypatch.setattr(buses, "open_loopback", refused)
    monkeypatch.setattr(buses.can, "detect_available_configs", lambda **_: [])
    assert [choice.interface for choice in buses.available_buses()] == ["virtual"]
