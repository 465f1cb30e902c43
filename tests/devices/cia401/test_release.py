"""The release device: two steps to release, error values when the host is gone, EDS and SDO."""

from __future__ import annotations

import pytest

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand, NmtState
from devices.cia401.release import RELEASE_OUTPUT, Input, Output, ReleaseDevice, pack_outputs, unpack_inputs
from devices.errors import FrameError


class Latch:
    """A base that remembers what was done to it."""

    def __init__(self) -> None:
        self.held, self.at_rest, self.air = True, True, False
        self.lived = self.releases = self.set_ups = 0

    def release(self) -> None:
        self.releases += 1
        self.held = self.at_rest = False

    def advance(self) -> None:
        self.lived += 1

    def set_up(self) -> None:
        self.set_ups += 1
        self.held = self.at_rest = True


class Bench:
    """The device with its frames, SYNC by SYNC."""

    def __init__(self, **options: bool) -> None:
        self.sent: list[tuple[int, bytes]] = []
        self.latch = Latch()
        self.device = ReleaseDevice(
            1, lambda identifier, data: self.sent.append((identifier, data)), self.latch, **options
        )
        self.device.boot()
        self.counter = 0
        self.start()

    def start(self) -> None:
        self.device.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 1))

    def cycle(self, outputs: Output | None = None, steps: int = 1) -> Input:
        """One SYNC, with outputs before it; return the inputs it was answered with."""
        if outputs is not None:
            self.device.receive(0x201, pack_outputs(outputs))
        self.counter += steps
        self.sent.clear()
        self.device.receive(frames.SYNC, frames.pack_sync((self.counter - 1) % 240 + 1))
        ((identifier, data),) = self.sent
        assert identifier == 0x181
        return unpack_inputs(data)

    def write(self, index: int, value: int, sub: int = 0) -> bytes:
        """An expedited download of one byte; return the answer."""
        self.sent.clear()
        request = bytes([0x2F]) + index.to_bytes(2, "little") + bytes([sub, value, 0, 0, 0])
        self.device.receive(0x601, request)
        ((identifier, data),) = self.sent
        assert identifier == 0x581
        return data


def test_releasing_takes_two_steps() -> None:
    bench = Bench()
    assert bench.cycle() == Input.HELD
    # A frame that releases what was not armed does nothing, also where it arms at once.
    bench.cycle(Output.RELEASE)
    bench.cycle(Output.ARM | Output.RELEASE)
    assert bench.latch.releases == 0
    bench.cycle(Output(0))
    assert bench.cycle(Output.ARM) == Input.HELD
    assert bench.cycle() == Input.HELD | Input.ARMED
    bench.cycle(Output.ARM | Output.RELEASE)
    assert bench.latch.releases == 1
    # The inputs of a SYNC are latched before its outputs act.
    assert bench.cycle() == Input.ARMED


def test_outputs_stay_until_others_come() -> None:
    bench = Bench()
    bench.cycle(Output.ARM | Output.AIR)
    assert all(bench.cycle() == Input.HELD | Input.ARMED | Input.AIR for _ in range(5))
    bench.cycle(Output(0))
    assert bench.cycle() == Input.HELD
    assert not bench.device.armed


def test_time_passes_by_the_sync_counter() -> None:
    bench = Bench()
    bench.cycle()
    bench.cycle(steps=1)
    bench.cycle(steps=7)
    assert bench.latch.lived == 8
    # A host that only holds it may be late.
    bench.cycle(Output.ARM)
    bench.cycle(Output.ARM | Output.RELEASE, steps=100)
    assert bench.latch.lived == 109
    # Once it moves, a leap is another master's SYNC, and the host is taken for gone.
    bench.cycle()
    bench.sent.clear()
    bench.device.receive(frames.SYNC, frames.pack_sync(bench.counter + 100))
    assert (bench.latch.lived, bench.device.armed) == (110, False)
    assert [identifier for identifier, _ in bench.sent] == [0x081]
    bench.cycle()
    assert bench.latch.lived == 111
    # The same SYNC twice is answered once.
    bench.sent.clear()
    bench.device.receive(frames.SYNC, frames.pack_sync(bench.counter))
    assert bench.sent == []
    assert bench.latch.lived == 111


def test_on_the_hosts_thread_a_late_sync_is_none_of_a_strangers() -> None:
    bench = Bench(shared_clock=True)
    bench.cycle(Output.ARM)
    bench.cycle(Output.ARM | Output.RELEASE)
    bench.cycle(steps=100)
    assert bench.latch.lived == 101
    assert bench.device.armed


@pytest.mark.parametrize("gone", ["heartbeat", "sync", "stopped", "pre-operational", "reset"])
def test_a_host_that_is_gone_leaves_it_disarmed_and_without_air(gone: str) -> None:
    bench = Bench()
    bench.cycle(Output.ARM | Output.AIR)
    bench.cycle()
    assert bench.device.armed
    bench.sent.clear()
    if gone == "heartbeat":
        bench.device.node.objects.set_data(0x1016, 1, (127 << 16 | 500).to_bytes(4, "little"))
        bench.device.receive(0x700 + 127, frames.pack_heartbeat(NmtState.OPERATIONAL))
        for k in range(61):
            bench.device.node.beat(10.0 + 0.01 * k)
    elif gone == "sync":
        bench.device.elapse(21)
    else:
        command = {
            "stopped": NmtCommand.STOP,
            "pre-operational": NmtCommand.ENTER_PRE_OPERATIONAL,
            "reset": NmtCommand.RESET_NODE,
        }[gone]
        bench.device.receive(frames.NMT, frames.pack_nmt(command, 1))
    assert not bench.device.armed
    assert not bench.latch.air
    assert bench.latch.releases == 0
    emergencies = [frames.unpack_emergency(data).code for identifier, data in bench.sent if identifier == 0x081]
    assert emergencies == {"heartbeat": [0x8130], "sync": [0x8700]}.get(gone, [])
    # Said once.
    bench.sent.clear()
    bench.device.elapse(5)
    assert not any(identifier == 0x081 for identifier, _ in bench.sent)


def test_error_mode_and_value_are_the_users() -> None:
    bench = Bench()
    # The air supply stays as it is: a cart that is to coast to its bumper whatever happens to the host.
    assert bench.write(0x6206, 0xFF & ~Output.AIR, 1)[0] == 0x60
    bench.cycle(Output.ARM | Output.AIR)
    bench.device.elapse(21)
    assert bench.latch.air
    assert not bench.device.armed
    # Or comes on.
    assert bench.write(0x6206, 0xFF, 1)[0] == 0x60
    assert bench.write(0x6207, Output.AIR, 1)[0] == 0x60
    bench.cycle(Output.ARM)
    bench.device.elapse(21)
    assert bench.latch.air


def test_outputs_and_inputs_are_objects_too() -> None:
    bench = Bench()
    assert bench.write(0x6200, Output.ARM, 1)[0] == 0x60
    bench.cycle()
    assert bench.device.armed
    objects = bench.device.node.objects
    assert (objects.get(0x6000, 1), objects.get(0x6200, 1)) == (Input.HELD | Input.ARMED, Output.ARM)


def test_the_operator_puts_the_base_back_when_a_host_starts_the_node() -> None:
    bench = Bench()
    bench.cycle(Output.ARM)
    bench.cycle(Output.ARM | Output.RELEASE)
    # Not while it moves, nor while it is armed.
    bench.start()
    bench.latch.at_rest = True
    bench.start()
    assert bench.latch.set_ups == 0
    bench.cycle(Output(0))
    bench.device.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 2))
    bench.device.receive(frames.NMT, frames.pack_nmt(NmtCommand.STOP, 2))
    bench.device.receive(frames.NMT, b"\x01")
    assert bench.latch.set_ups == 0
    bench.start()
    assert bench.latch.set_ups == 1
    # A base in its latch is left alone.
    bench.start()
    assert bench.latch.set_ups == 1


def test_malformed_frames_do_nothing() -> None:
    bench = Bench()
    bench.device.receive(0x201, b"")
    bench.device.receive(0x201, b"\x03\x00")
    assert bench.device.node.refused_frames == 2
    assert bench.cycle() == Input.HELD
    with pytest.raises(FrameError, match="inputs TPDO1 has 2 bytes; it must have 1"):
        unpack_inputs(b"\x00\x00")
    # Bits that mean nothing are not handed on.
    assert unpack_inputs(b"\xff") == Input.HELD | Input.ARMED | Input.AIR


def test_silent_unless_operational() -> None:
    bench = Bench()
    bench.device.receive(frames.NMT, frames.pack_nmt(NmtCommand.ENTER_PRE_OPERATIONAL, 1))
    bench.sent.clear()
    bench.device.receive(frames.SYNC, frames.pack_sync(5))
    bench.device.receive(0x201, pack_outputs(Output.ARM))
    bench.device.receive(frames.SYNC, frames.pack_sync(6))
    assert bench.sent == []
    assert not bench.device.armed
    # Time goes on all the same.
    assert bench.latch.lived == 1


def test_what_the_data_sheet_says() -> None:
    assert "ProductName=Emulated release output" in RELEASE_OUTPUT
    objects = Bench().device.node.objects
    # CiA 401 with digital inputs and outputs.
    assert objects.get(0x1000) == 0x00030191
    assert (objects.get(0x1600, 1), objects.get(0x1A00, 1)) == (0x62000108, 0x60000108)
