"""What the host checks and sets before it enables a drive, and what it does not need for it to stop."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.cia402 import states
from devices.cia402.commissioning import cycle_microseconds
from devices.cia402.states import State
from devices.cia402.units import SERVO_DRIVE
from devices.errors import (
    DeviceMismatch,
    DeviceNotReady,
    DeviceTimeout,
    DriveFault,
    DriveStopped,
    EdsError,
    FrameError,
    ObjectRefused,
)
from tests.devices.cia402.conftest import H

if TYPE_CHECKING:
    from tests.devices.cia402.conftest import Chain


def test_what_is_written(make_chain) -> None:
    chain = make_chain(stop_deceleration=0.75, following_error=5e-3, patience=0.05)
    chain.table.open()
    objects = chain.drive.node.objects
    assert [objects.get(index) for index in (0x1006, 0x2010, 0x607F, 0x60C5, 0x6085, 0x6065)] == [
        1000,
        50,
        500_000,
        10_000_000,
        750_000,
        5_000_000,
    ]
    assert [objects.get(0x607D, sub) for sub in (1, 2)] == [-100_000_000, 100_000_000]
    assert [objects.get(index) for index in (0x605A, 0x605E, 0x6060, 0x6061)] == [2, 2, 8, 8]
    assert (objects.get(0x1017), objects.get(0x1016, 1)) == (100, 127 << 16 | 500)


def test_what_is_not_told_is_left_as_it_is(make_chain) -> None:
    chain = make_chain(options={"stop_deceleration": 3.0, "following_error": 1e-3})
    chain.table.open()
    objects = chain.drive.node.objects
    assert [objects.get(index) for index in (0x2010, 0x6085, 0x6065)] == [20, 3_000_000, 1_000_000]


@pytest.mark.parametrize("deceleration", [0.5, 5.0])
def test_the_drive_really_stops_with_what_was_written(make_chain, deceleration: float) -> None:
    chain = make_chain(stop_deceleration=deceleration)
    with chain.table as table:
        run_up(chain)
        first = len(chain.rail.path)
        table.quick_stop()
    way = chain.rail.path[first:]
    braking = [(2.0 * b - a - c) / H**2 for a, b, c in zip(way, way[1:], way[2:], strict=False)]
    assert max(braking) == pytest.approx(deceleration, abs=3e-3)
    assert chain.rail.velocity == 0.0


def run_up(chain: Chain, velocity: float = 0.2) -> tuple[int, float]:
    """Enable, and reach a velocity; the next cycle and the last set-point."""
    chain.table.enable(chain.table.position)
    x, v, cycle = chain.table.position, 0.0, 0
    while v < velocity:
        v += 5.0 * H
        x += v * H
        chain.clock.advance(H)
        chain.table.exchange(cycle, x)
        cycle += 1
    return cycle, x


@pytest.mark.parametrize(
    ("index", "sub", "value", "sentence"),
    [
        (0x1000, 0, 0x00020191, "is of device type 00020191; its EDS says 00020192"),
        (0x1018, 1, 0x1234, "is vendor 00001234; its EDS says 7FFFFFFF"),
        (0x1018, 2, 2, "is product 00000002; its EDS says 00000001"),
        (0x1018, 3, 0x00020000, "is revision 00020000; its EDS says 00010000"),
        (0x1A00, 2, 0x60640010, r"has 60640010 in object 1A00:02; its EDS says 60640020"),
        (0x1600, 0, 1, r"has 1 in object 1600:00; its EDS says 2"),
        (0x1400, 1, 0x222, r"has 222 in object 1400:01; its EDS says 201"),
        (0x1019, 0, 0, r"has 0 in object 1019:00; its EDS says F0"),
        (0x60A8, 0, 0xFA010000, r"has FA010000 in object 60A8:00; its EDS says F7010000"),
        (0x6502, 0, 0x20, r"has no cyclic synchronous position mode \(object 6502, bit 7\)"),
    ],
)
def test_another_drive_is_refused_before_anything_is_written(make_chain, index, sub, value, sentence) -> None:
    chain = make_chain()
    chain.drive.node.objects.set(index, value, sub)
    with pytest.raises(DeviceMismatch, match=f"node 1 of bench {sentence}") as error:
        chain.table.open()
    assert "\n" not in str(error.value)
    assert chain.drive.node.objects.get(0x607F) == 2**32 - 1
    assert chain.drive.state is State.SWITCH_ON_DISABLED


def test_a_minor_revision_changes_nothing(make_chain) -> None:
    chain = make_chain()
    chain.drive.node.objects.set(0x1018, 0x00010007, 3)
    chain.table.open()


def test_a_drive_that_does_not_go_into_the_mode(make_chain) -> None:
    chain = make_chain()
    chain.drive.node.objects.on_read(0x6061, lambda: 6)
    with pytest.raises(DeviceMismatch, match=r"stays in mode 6; mode 8 was asked for \(6060\)"):
        chain.table.open()


def test_a_number_that_the_drive_does_not_take(make_chain) -> None:
    chain = make_chain(cycle_time=0.25e-3)
    with pytest.raises(
        ObjectRefused, match=r"refused to write object 1006:00 \(Communication cycle period\): .* too low"
    ):
        chain.table.open()


def test_a_cycle_that_is_no_whole_number_of_microseconds(make_chain) -> None:
    assert [cycle_microseconds(1.0 / rate) for rate in (250, 500, 800, 1000, 2000)] == [4000, 2000, 1250, 1000, 500]
    chain = make_chain(cycle_time=1.0 / 1500.0)
    with pytest.raises(FrameError, match=r"cycle time is 666\.667 us; a drive takes whole microseconds"):
        chain.table.open()


@pytest.mark.parametrize("rate", [250.0, 500.0, 2000.0])
def test_every_rate_from_250_hz_to_2_khz(make_chain, rate: float) -> None:
    h = 1.0 / rate
    chain = make_chain(cycle_time=h)
    with chain.table as table:
        assert chain.rail.cycle_time == pytest.approx(h)
        table.enable(0.0)
        targets = [0.01 * (1.0 - math.cos(math.tau * 2.0 * (k + 1) * h)) for k in range(round(0.5 / h))]
        samples = [table.exchange(k, x) for k, x in enumerate(targets)]
        table.disable()
    assert [s.position for s in samples[1:]] == pytest.approx(targets[:-1], abs=1e-9)
    assert max(s.position for s in samples) == pytest.approx(0.02, abs=5e-6)


def test_an_eds_of_another_maker(make_chain) -> None:
    """Coarser units, another vendor: everything that depends on it comes from the text."""
    eds = SERVO_DRIVE.replace("DefaultValue=0x7FFFFFFF", "DefaultValue=0x99")
    chain = make_chain(eds=eds)
    with pytest.raises(DeviceMismatch, match="its EDS says 00000099"):
        chain.table.open()
    chain.drive.node.objects.set(0x1018, 0x99, 1)
    chain.table.open()


def test_who_it_is(make_chain) -> None:
    chain = make_chain()
    with pytest.raises(DeviceNotReady, match="described before it is open"):
        chain.table.describe()
    with chain.table as table:
        (drive,) = table.describe()
        assert (drive.node, drive.name, drive.hardware, drive.software) == (
            1,
            "Emulated servo drive",
            "emulated",
            "1.0",
        )
        assert (drive.vendor, drive.product, drive.revision, drive.serial) == (0x7FFFFFFF, 1, 0x10000, 1)
        assert (drive.what, drive.state, drive.mode) == (
            "servo drive",
            "switch on disabled",
            "cyclic synchronous position",
        )
        assert chain.rail.path == [0.0] * len(chain.rail.path)
        table.enable(0.0)
        with pytest.raises(DeviceNotReady, match="described before it is stopped"):
            table.describe()


def test_in_the_cycle_no_object_is_touched(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    seen: set[int] = set()
    chain.bus.tap = lambda _time, identifier, _data, _sent: seen.add(identifier)
    run_up(chain)
    chain.table.quick_stop()
    assert seen <= {0x201, 0x080, 0x181, 0x281, 0x701, 0x77F}


def test_a_stop_needs_no_object(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    run_up(chain)
    chain.drive.node._server.serve = lambda _: None
    chain.table.quick_stop()
    assert chain.drive.state is State.SWITCH_ON_DISABLED
    assert chain.rail.velocity == 0.0


def test_a_drive_that_restarted_is_set_up_again(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    chain.drive.receive(frames.NMT, frames.pack_nmt(NmtCommand.RESET_NODE, 1))
    assert chain.drive.node.objects.get(0x1016, 1) == 0
    chain.table.enable(0.0)
    assert chain.drive.node.objects.get(0x1016, 1) == 127 << 16 | 500
    chain.table.exchange(0, 0.0)
    chain.table.disable()


def test_a_drive_that_was_stopped_is_found(make_chain) -> None:
    chain = make_chain()
    chain.drive.receive(frames.NMT, frames.pack_nmt(NmtCommand.STOP, 1))
    chain.table.open()
    chain.table.enable(0.0)
    chain.table.disable()


def hold(chain: Chain, duration: float) -> None:
    """Hold the place, a cycle a millisecond of the manual clock."""
    first = 0 if chain.table._last_cycle is None else chain.table._last_cycle + 1
    for cycle in range(first, first + round(duration / H)):
        chain.clock.advance(H)
        chain.table.exchange(cycle, 0.0)


def test_heartbeats_go_both_ways(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    beats: list[tuple[int, bool]] = []

    def tap(_time: float, identifier: int, _data: bytes, sent: bool) -> None:
        if identifier in (0x701, 0x77F):
            beats.append((identifier, sent))

    chain.bus.tap = tap
    chain.table.enable(0.0)
    hold(chain, 2.0)
    assert beats.count((0x701, False)) == pytest.approx(20, abs=1)
    assert beats.count((0x77F, True)) == pytest.approx(20, abs=1)
    chain.table.disable()


def test_a_drive_whose_heartbeat_is_lost_is_named(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    chain.table.enable(0.0)
    hold(chain, 0.3)
    chain.drive.node._period = 0.0
    start = chain.clock.now()
    with pytest.raises(DeviceTimeout, match=r"node 1 of bench has sent no heartbeat for 0\.5 s"):
        hold(chain, 2.0)
    assert chain.clock.now() - start == pytest.approx(0.5, abs=0.11)
    # its process data are answered: it is stopped in order
    chain.table.quick_stop()
    assert chain.drive.state is State.SWITCH_ON_DISABLED


def test_a_host_whose_heartbeat_is_lost_is_left_by_its_drive(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    chain.table.enable(0.0)
    hold(chain, 0.3)
    send = chain.bus.send
    chain.bus.send = lambda identifier, data: None if identifier == 0x77F else send(identifier, data)
    start = chain.clock.now()
    with pytest.raises(DriveFault, match="reports error 8130: communication lost") as fault:
        hold(chain, 2.0)
    assert fault.value.code == 0x8130
    assert chain.clock.now() - start == pytest.approx(0.5, abs=0.11)
    chain.table.quick_stop()
    assert chain.drive.state is State.FAULT


def test_an_emergency_of_another_node_of_ours_ends_the_run(make_chain) -> None:
    chain = make_chain()
    chain.table.open()
    chain.table.enable(0.0)
    hold(chain, 0.01)
    chain.table._link.emergencies[2] = frames.Emergency(0x5000, 0x81, bytes(5))
    with pytest.raises(DriveStopped, match="node 2 of bench reports error 5000"):
        hold(chain, 0.01)
    chain.table.quick_stop()


def test_steering_is_for_before_a_run(make_chain) -> None:
    chain = make_chain()
    with pytest.raises(DeviceNotReady, match="steered before it is open"):
        chain.table.steer(0)
    with chain.table as table:
        table.steer(states.SHUTDOWN)
        table.steer(states.SHUTDOWN)
        assert table.state is State.READY_TO_SWITCH_ON
        assert table.powered
    assert chain.drive.state is State.SWITCH_ON_DISABLED


def without(index: str) -> str:
    """The EDS less one object."""
    sections = SERVO_DRIVE.split("\n\n")
    kept = [text for text in sections if not text.startswith((f"[{index}]", f"[{index}sub"))]
    assert len(kept) < len(sections)
    return "\n\n".join(kept)


@pytest.mark.parametrize("index", ["1019", "60C5", "6085", "6060", "6502"])
def test_an_eds_that_lacks_what_is_needed_is_one_sentence(make_chain, index: str) -> None:
    chain = make_chain(eds=without(index), stop_deceleration=1.0)
    with pytest.raises(EdsError, match=f"EDS of node 1 of bench declares no object {index}.*, which is needed"):
        chain.table.open()


def test_an_eds_without_units_is_refused_at_once(make_chain) -> None:
    with pytest.raises(EdsError, match="tells no unit of position"):
        make_chain(eds=without("60A8"))


@pytest.mark.parametrize(
    ("was", "told", "sentence"),
    [
        ("0x60400010", "0x60400020", r"has 60400020 in object 1600:01; the cycle needs 60400010"),
        ("0x60640020", "0x60630020", r"has 60630020 in object 1A00:02; the cycle needs 60640020"),
        ("$NODEID+0x200", "$NODEID+0x300", r"has 301 in object 1400:01; the cycle needs 201"),
        ("0x21000020", "0x21000010", r"has 21000010 in object 1A01:01; the cycle needs 20"),
    ],
)
def test_an_eds_that_maps_something_else_is_of_no_use(make_chain, was: str, told: str, sentence: str) -> None:
    """The device may be just as its EDS says: the cycle's frames are fixed."""
    chain = make_chain(eds=SERVO_DRIVE.replace(f"DefaultValue={was}", f"DefaultValue={told}"))
    with pytest.raises(EdsError, match=sentence):
        chain.table.open()
