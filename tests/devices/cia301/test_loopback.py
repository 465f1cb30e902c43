"""The bus between processes of one machine: neither heard by others nor hearing them."""

from __future__ import annotations

import platform
import socket
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import pytest
from can.interfaces.udp_multicast.utils import pack_message

from devices.cia301.buses import UDP_GROUP, CanBus, open_bus
from devices.cia301.loopback import LOOPBACK, LoopbackBus, open_loopback
from devices.errors import BusFailure, BusUnavailable, DeviceError

FRAME = pack_message(can.Message(arbitration_id=0x181, is_extended_id=False, data=b"abc"))


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("", 0))
        return probe.getsockname()[1]


@pytest.fixture
def port() -> int:
    number = free_port()
    try:
        with open_bus("udp_multicast", port=number) as one, open_bus("udp_multicast", port=number) as other:
            one.send(0x123, b"probe")
            if other.receive(0.2) != (0x123, b"probe"):
                pytest.skip("multicast does not reach its own machine here")
    except DeviceError as reason:
        pytest.skip(str(reason))
    return number


@pytest.fixture
def bus(port: int) -> Iterator[LoopbackBus]:
    made = open_loopback(UDP_GROUP, port)
    yield made
    made.shutdown()


class ScriptedSocket:
    """Datagrams and where they came from; nothing more where the script ends."""

    def __init__(self, *script: tuple[bytes, str]) -> None:
        self.script = list(script)

    def recvfrom(self, _: int) -> tuple[bytes, tuple[str, int]]:
        if not self.script:
            raise BlockingIOError
        data, source = self.script.pop(0)
        return data, (source, 43113)

    def close(self) -> None:
        pass


def scripted(*script: tuple[bytes, str]) -> LoopbackBus:
    made: Any = ScriptedSocket(*script)
    return LoopbackBus(made, UDP_GROUP, 43113)


def test_it_names_itself(port: int) -> None:
    with open_bus("udp_multicast", port=port) as bus:
        assert str(bus) == f"udp_multicast {UDP_GROUP}:{port}"


def test_nothing_leaves_the_machine(bus: LoopbackBus, port: int) -> None:
    options = bus.options()
    assert options["time_to_live"] == 0
    assert options["interface"] == LOOPBACK
    if platform.system() != "Windows":
        assert options["bound"] == (UDP_GROUP, port)


@pytest.mark.skipif(not Path("/proc/net/igmp").exists(), reason="reads Linux's list of groups")
def test_the_group_is_joined_on_the_loopback_interface_alone(port: int) -> None:
    def interfaces(group: str) -> list[str]:
        number = f"{int.from_bytes(socket.inet_aton(group), 'little'):08X}"
        found, interface = [], ""
        for line in Path("/proc/net/igmp").read_text(encoding="ascii").splitlines()[1:]:
            if not line.startswith("\t"):
                interface = line.split()[1]
            elif line.split()[0] == number:
                found.append(interface)
        return found

    group = "239.74.163.77"
    with open_bus("udp_multicast", group, port=port):
        assert interfaces(group) == ["lo"]
    assert interfaces(group) == []


def test_datagrams_of_other_machines_are_dropped() -> None:
    bus = scripted((FRAME, "192.0.2.7"), (FRAME, "127.0.0.2"), (FRAME, LOOPBACK), (FRAME, "10.1.2.3"))
    assert CanBus(bus).receive() == (0x181, b"abc")
    assert CanBus(bus).receive() is None
    assert bus.dropped == 3
    bus.shutdown()


def test_a_flood_of_them_does_not_hold_the_caller() -> None:
    bus = scripted(*[(FRAME, "192.0.2.7")] * 1000)
    assert CanBus(bus).receive() is None
    assert bus.dropped == 64
    bus.shutdown()


def test_a_frame_sent_by_a_network_interface_is_not_heard(bus: LoopbackBus, port: int) -> None:
    """What python-can's own bus does, and any other machine: here with time to live 0, since this is a test."""
    try:
        other = can.Bus(channel=UDP_GROUP, interface="udp_multicast", ignore_config=True, port=port, hop_limit=0)
    except can.CanError as reason:
        pytest.skip(f"no network here: {reason}")
    with other:
        try:
            other.send(can.Message(arbitration_id=0x201, is_extended_id=False))
            if other.recv(0.2) is None:
                pytest.skip("multicast by the network interface does not come back here")
        except can.CanError as reason:
            pytest.skip(f"no network here: {reason}")
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as direct:
            direct.sendto(FRAME, (LOOPBACK, port))
        if platform.system() != "Windows":
            assert CanBus(bus).receive(0.05) is None


def test_garbage_is_passed_over(port: int) -> None:
    with open_bus("udp_multicast", port=port) as one, open_bus("udp_multicast", port=port) as other:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as stranger:
            stranger.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
            stranger.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(LOOPBACK))
            for data in (b"", b"\xc1", b"hello", b"\x81\xa1x\x01", bytes(5000)):
                stranger.sendto(data, (UDP_GROUP, port))
        one.send(0x181, b"abc")
        assert other.receive(0.2) == (0x181, b"abc")
        assert other.ignored == 5


def test_buses_differ_in_their_port(port: int) -> None:
    with open_bus("udp_multicast", port=port) as one, open_bus("udp_multicast", port=free_port()) as other:
        one.send(1, b"")
        assert other.receive(0.05) is None


def test_a_bus_that_was_closed(port: int) -> None:
    bus = open_bus("udp_multicast", port=port)
    bus.close()
    with pytest.raises(BusFailure, match=f"udp_multicast {UDP_GROUP}:{port} did not take frame 080"):
        bus.send(0x080, b"")
    with pytest.raises(BusFailure, match="failed while receiving"):
        bus.receive()


def test_a_port_that_is_taken() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("", 0))
        if platform.system() != "Linux":
            pytest.skip("whether a port can be shared against its holder's will differs")
        with pytest.raises(BusUnavailable, match=r"cannot be opened here: .*in use"):
            open_bus("udp_multicast", port=taken.getsockname()[1])


def test_a_full_buffer_is_waited_for(bus: LoopbackBus) -> None:
    real, refusals = bus._socket, [True]

    class Full:
        def sendto(self, data: bytes, where: tuple[str, int]) -> int:
            if refusals:
                refusals.pop()
                raise BlockingIOError
            return real.sendto(data, where)

        def fileno(self) -> int:
            return real.fileno()

    bus._socket = Full()  # type: ignore[assignment]
    bus.send(can.Message(arbitration_id=5, is_extended_id=False), timeout=0.05)
    bus._socket = real
    assert CanBus(bus).receive(0.2) == (5, b"")
