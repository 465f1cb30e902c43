"""A recorded run as frames: what other CAN tools hear is what was recorded, to a count."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest

from devices.cia301 import frames
from devices.cia301.buses import open_bus
from devices.cia402.frames import unpack_actual, unpack_target
from devices.quanser_st3.driver import DRIVE_NODE, SENSOR_NODE
from recordings import read_run
from recordings.bus_replay import DISABLE_VOLTAGE, BusReplay, frames_of, play_on_bus
from recordings.run import Run
from recordings.samples import sample_path
from twin.cycle import CycleRecord

RECORD = CycleRecord(239, 0.239, 0, 0.0, 0.0123456789, -0.0012345, 1.234567, -0.0321, 0.0, 0.0, 0x1237)


@pytest.fixture(scope="module")
def run() -> Run:
    return read_run(sample_path("sine"))


def test_the_frames_of_a_cycle() -> None:
    found = frames_of(RECORD)
    assert [frame.identifier for frame in found] == [
        frames.RPDO1 + DRIVE_NODE,
        frames.SYNC,
        frames.TPDO1 + DRIVE_NODE,
        frames.TPDO2 + DRIVE_NODE,
        frames.TPDO1 + SENSOR_NODE,
    ]
    assert unpack_target(found[0].data) == (DISABLE_VOLTAGE, 12_345_679)
    assert frames.unpack_sync(found[1].data) == 240
    assert unpack_actual(found[2].data) == (0x1237, -1_234_500)
    assert frames.unpack_long(found[3].data, "acceleration") == 1_234_567
    assert frames.unpack_long(found[4].data, "rotation") == -32_100


def test_what_was_not_there_has_no_frame() -> None:
    blank = replace(RECORD, target_position=math.nan, rotation=math.nan)
    assert [frame.identifier for frame in frames_of(blank)] == [0x080, 0x181, 0x281]


def test_no_frame_could_ever_enable_a_drive(run: Run) -> None:
    """CiA 402: without bit 1 of the controlword every state but a fault goes to "switch on disabled"."""
    for record in itertools.islice(run.cycles, 50):
        for identifier, data in frames_of(record):
            if identifier == frames.RPDO1 + DRIVE_NODE:
                assert not unpack_target(data)[0] & 0b10


def test_another_tool_hears_every_cycle(run: Run) -> None:
    with open_bus("virtual", "bus-replay") as ours, open_bus("virtual", "bus-replay") as tool:
        sent = play_on_bus(run, ours.send)
        heard: dict[int, list[bytes]] = {}
        while (frame := tool.receive()) is not None:
            heard.setdefault(frame[0], []).append(frame[1])
    assert sent == BusReplay(len(run.cycles), sum(map(len, heard.values())))
    assert {len(found) for found in heard.values()} == {len(run.cycles)}
    positions = [unpack_actual(data)[1] * 1e-9 for data in heard[0x181]]
    assert positions == pytest.approx(run.cycles.position.tolist(), abs=0.6e-9)
    rotations = [frames.unpack_long(data, "r") * 1e-6 for data in heard[0x182]]
    assert rotations == pytest.approx(run.cycles.rotation.tolist(), abs=0.6e-6)


def test_the_pace_can_end_it(run: Run) -> None:
    class Ten:
        left = 10

        def wait(self, time: float) -> bool:
            self.left -= 1
            return self.left >= 0

    sent: list[int] = []
    assert play_on_bus(run, lambda identifier, _: sent.append(identifier), pace=Ten()).cycles == 10
    assert sent.count(frames.SYNC) == 10
