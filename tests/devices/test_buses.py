"""Opening buses, and what python-can's have in store."""

from __future__ import annotations

from typing import Any

import can
import pytest

from devices.cia402 import buses
from devices.cia402.buses import CanBus, open_bus
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
    assert bus.ignored == 5
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
