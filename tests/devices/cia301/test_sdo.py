"""Objects read and written over a bus, without a thread: canopen's client and server, both fed by hand."""

from __future__ import annotations

import contextlib
import struct
from typing import TYPE_CHECKING

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from devices.cia301.buses import CanBus, open_bus
from devices.cia301.host import Host
from devices.cia301.sdo_client import Sdo
from devices.clock import ManualClock
from devices.errors import BusFailure, DeviceError, DeviceTimeout, FrameError, ObjectRefused
from tests.devices.cia301.example import EDS, Example

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator


class Pair:
    """A host and the node it talks to, on one thread."""

    def __init__(self, host: CanBus, far: CanBus) -> None:
        self.bus, self.far = host, far
        self.clock = ManualClock()
        self.device = Example(5)
        self.device.node.send = far.send
        self.host = Host(host, [5], self.clock, self.idle)
        self.sdo = Sdo(self.host, 5, EDS, "bench")
        self.rounds = 0
        self.spoil: Callable[[int, bytes], bytes | None] | None = None

    def idle(self) -> None:
        """Let the node answer."""
        self.rounds += 1
        while (frame := self.far.receive()) is not None:
            self.device.receive(*frame)

    def spoiling(self, spoil: Callable[[bytes], bytes | None]) -> None:
        """Put something between the node's answers and the bus: bytes as they shall arrive, None for none."""

        def send(identifier: int, data: bytes) -> None:
            if (left := spoil(data)) is not None:
                self.far.send(identifier, left)

        self.device.node.send = send


@pytest.fixture
def pair(request) -> Iterator[Pair]:
    with open_bus("virtual", request.node.name) as host, open_bus("virtual", request.node.name) as far:
        yield Pair(host, far)


def test_numbers_and_texts(pair: Pair) -> None:
    assert pair.sdo.read(0x1000) == 0x191
    assert pair.sdo.read(0x2000) == -5
    assert pair.sdo.text(0x1008) == "a name of more than seven bytes"
    pair.sdo.write(0x2000, -1000)
    pair.sdo.write(0x2002, -1)
    assert [pair.sdo.read(index) for index in (0x2000, 0x2002)] == [-1000, -1]
    assert pair.device.node.objects.get(0x2000) == -1000
    assert pair.clock.now() == 0.0


@pytest.mark.parametrize(
    ("what", "sentence", "code"),
    [
        (lambda sdo: sdo.write(0x2000, 1001), r"refused to write object 2000:00 \(Level\): .* too high", 0x06090031),
        (lambda sdo: sdo.write(0x1000, 1), r"refused to write object 1000:00 \(Device type\): .*read only", 0x06010002),
        (lambda sdo: sdo.read(0x2001), r"refused to read object 2001:00 \(Secret\): .*write only", 0x06010001),
        (lambda sdo: sdo.read(0x2003), r"refused to read object 2003:00", 0x060A0023),
    ],
)
def test_a_refusal_is_one_sentence(pair: Pair, what, sentence: str, code: int) -> None:
    with pytest.raises(ObjectRefused, match=f"node 5 of bench {sentence}") as refused:
        what(pair.sdo)
    assert refused.value.code == code
    assert "\n" not in str(refused.value)


def test_a_number_that_does_not_fit_is_not_sent(pair: Pair) -> None:
    with pytest.raises(FrameError, match="300 does not fit object 2002:00"):
        pair.sdo.write(0x2002, 300)
    assert pair.rounds == 0


def test_silence_is_a_time_out(pair: Pair) -> None:
    pair.spoiling(lambda _: None)
    with pytest.raises(DeviceTimeout, match=r"node 5 of bench did not read object 1000:00 .*: no answer came within"):
        pair.sdo.read(0x1000)
    assert pair.rounds <= 3 * 100


def test_a_lost_answer_is_asked_for_again(pair: Pair) -> None:
    lost = iter([True, False, False, True])
    pair.spoiling(lambda data: None if next(lost, False) else data)
    assert pair.sdo.read(0x1000) == 0x191
    pair.sdo.write(0x2000, 7)
    assert pair.device.node.objects.get(0x2000) == 7


def test_a_late_answer_to_an_earlier_question_is_not_taken(pair: Pair) -> None:
    pair.far.send(0x585, bytes.fromhex("4300100092010000"))
    assert pair.sdo.read(0x1000) == 0x191
    assert pair.host.counts.stale == 1


def test_an_answer_about_something_else_is_no_answer(pair: Pair) -> None:
    pair.spoiling(lambda data: bytes([data[0], 0x01, *data[2:]]) if data[0] & 0xE0 == 0x40 else data)
    with pytest.raises(DeviceTimeout, match="returned a value for 0x1001"):
        pair.sdo.read(0x1000)


def test_an_answer_of_the_wrong_size(pair: Pair) -> None:
    pair.spoiling(lambda data: bytes([0x4B, *data[1:]]) if data[0] == 0x43 else data)
    with pytest.raises(FrameError, match="2 bytes; its EDS says 4"):
        pair.sdo.read(0x1000)
    pair.spoiling(lambda data: data[:5])
    with pytest.raises(DeviceTimeout, match="its answer has 5 bytes"):
        pair.sdo.read(0x1000)


def test_an_answer_without_end_is_given_up(pair: Pair) -> None:
    answer = bytearray(b"\0AAAAAAA")

    def reply(identifier: int, data: bytes) -> None:
        if identifier == 0x605 and data[0] & 0xE0 == 0x60:
            answer[0] = data[0] & 0x10
            pair.far.send(0x585, bytes(answer))
        elif identifier == 0x605 and data[0] != 0x80:
            pair.far.send(0x585, bytes([0x41, *data[1:4], 0xFF, 0xFF, 0xFF, 0x7F]))

    pair.device.receive = reply
    with pytest.raises(DeviceTimeout, match="more than 200 segments"):
        pair.sdo.text(0x1008)


def test_a_bus_that_is_gone_is_said(pair: Pair) -> None:
    def gone(identifier: int, data: bytes) -> None:
        raise BusFailure("the cable is out")

    pair.bus.send = gone
    with pytest.raises(BusFailure, match="cable"):
        pair.sdo.read(0x1000)


def test_emergencies_and_heartbeats_meanwhile_are_heard(pair: Pair) -> None:
    pair.device.node.emergency(0x8130, 0x11)
    pair.device.node.beat(0.0)
    assert pair.sdo.read(0x1000) == 0x191
    assert pair.host.emergencies[5].code == 0x8130
    assert pair.host.counts.heartbeats == 1


SERVER_BYTES = st.one_of(
    st.binary(max_size=8),
    st.builds(
        lambda command, index, sub, rest: struct.pack("<BHB", command, index, sub) + rest,
        st.integers(0, 255),
        st.sampled_from([0x1000, 0x1008, 0x2000, 0x9999]),
        st.sampled_from([0, 1]),
        st.binary(min_size=4, max_size=4),
    ),
)


@settings(max_examples=60, deadline=None)
@given(st.lists(SERVER_BYTES, min_size=1, max_size=12), st.sampled_from(["read", "text", "write"]))
def test_a_client_raises_nothing_but_our_errors(answers: list[bytes], verb: str) -> None:
    with open_bus("virtual", "sdo fuzz") as host, open_bus("virtual", "sdo fuzz") as far:
        pair = Pair(host, far)
        script = iter(answers)

        def reply(identifier: int, data: bytes) -> None:
            if (answer := next(script, None)) is not None:
                far.send(0x585, answer)

        pair.device.receive = reply
        ask = {
            "read": lambda: pair.sdo.read(0x1000),
            "text": lambda: pair.sdo.text(0x1008),
            "write": lambda: pair.sdo.write(0x2000, 5),
        }
        with contextlib.suppress(DeviceError):
            ask[verb]()


@settings(max_examples=200, deadline=None)
@given(st.lists(SERVER_BYTES, max_size=30))
def test_a_server_raises_nothing_and_stays_usable(requests: list[bytes]) -> None:
    device = Example(5)
    for request in requests:
        device.receive(0x605, request)
    device.sent.clear()
    device.receive(0x605, bytes.fromhex("4000100000000000"))
    assert device.sent == [(0x585, bytes.fromhex("4300100091010000"))]
    assert -1000 <= device.node.objects.get(0x2000) <= 1000


def test_a_download_without_end_fills_no_memory() -> None:
    device = Example(5)
    device.receive(0x605, bytes.fromhex("2104200000000000"))
    for k in range(1000):
        device.receive(0x605, bytes([0x10 * (k % 2)]) + b"AAAAAAA")
    assert device.sent[-1][1][0] == 0x80
    assert len(device.node._server._buffer) < 2000


def test_segments_without_a_beginning_are_aborted() -> None:
    device = Example(5)
    for command in (0x60, 0x00, 0x01):
        device.receive(0x605, bytes([command]) + bytes(7))
        assert device.sent.pop() == (0x585, bytes.fromhex("8000000001000405"))
