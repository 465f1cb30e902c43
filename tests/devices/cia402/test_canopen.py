"""The independent proof, both ways: canopen's CiA 402 master drives our drive, our host drives a servo of canopen's.

Both were recorded as BLF (`record.py`), and are played again here: bytes in, bytes out, and leftovers fail.
"""

from __future__ import annotations

import itertools

import pytest

from devices.cia301.buses import open_bus
from devices.cia402.states import State
from devices.clock import ManualClock, WallClock
from tests.devices.cia402 import canopen_master, host_session
from tests.devices.cia402.canopen_servo import local_servo
from tests.devices.cia402.host_session import HEARTBEAT_OF_THE_HOST
from tests.devices.cia402.traffic import DATA, Frame, read_blf, write_blf

NM = 1e-9
HEARTBEAT_OF_THE_DRIVE, BOOT_UP = 0x701, b"\x00"


def test_canopens_master_drives_our_drive() -> None:
    with canopen_master.bench("proof: master") as (rig, node):
        canopen_master.session(rig, node)
        assert rig.drive.state is State.SWITCH_ON_DISABLED
    # the quick stop may meet the last step under way: 15 mm/s, brought down with 2 m/s2
    assert 0.0 <= rig.rail.position - 60 * canopen_master.STEP <= 0.1e-3
    assert rig.drive.node.refused_frames == 0
    assert [e.code for e in node.emcy.log] == [rig.drive.node.objects.get(0x1003, 1), 0]


@pytest.mark.parametrize(("method", "start", "edge"), [(18, 0.0995, 0.102), (17, -0.0995, -0.102), (35, 0.05, 0.05)])
def test_canopens_master_homes_our_drive(method: int, start: float, edge: float) -> None:
    with canopen_master.bench(f"proof: homing {method}", start) as (rig, node):
        assert canopen_master.home(node, method)
        assert node.op_mode == "HOMING"
        node.state = "SWITCH ON DISABLED"
        node.check_statusword(2.0)
        position = node.tpdo[1]["Position actual value"].raw * NM
    # the home is where the switch lets go, found at 2 mm/s in cycles of 2 ms
    assert rig.rail.position - position == pytest.approx(edge, abs=4e-6)
    assert abs(rig.rail.position) <= 0.1


def test_our_host_drives_a_servo_of_canopens() -> None:
    with local_servo("proof: servo") as servo, open_bus("virtual", "proof: servo") as bus:
        samples = host_session.session(bus, WallClock(), lambda: servo.fail(0x7500))
        written = {index: servo.setting(index) for index in (0x1006, 0x607F, 0x60C5, 0x6085, 0x1017)}
        limits = [servo.setting(0x607D, sub) for sub in (1, 2)]
        watched = servo.setting(0x1016, 1)
    assert written == {0x1006: 1000, 0x607F: 500_000, 0x60C5: 10_000_000, 0x6085: 1_000_000, 0x1017: 100}
    assert limits == [-100_000_000, 100_000_000]
    assert watched == 127 << 16 | 500
    # what was sent for cycle k is measured in cycle k + 1
    told = [0.0, *(host_session.motion(k) for k in range(host_session.CYCLES - 1))]
    measured = [sample.position for sample in samples[: host_session.CYCLES]]
    assert measured == pytest.approx(told, abs=0.6 * NM)
    speed = (host_session.motion(119) - host_session.motion(118)) / host_session.H
    assert servo.position * NM - host_session.motion(119) == pytest.approx(speed**2 / 2.0, rel=0.05)
    steepest = max(abs(a - 2 * b + c) for a, b, c in zip(servo.path, servo.path[1:], servo.path[2:], strict=False))
    assert steepest * NM / host_session.H**2 <= 10.0


def test_the_recording_of_our_drive_is_played_again() -> None:
    """A fresh drive, fed what the recorded one heard, says what that one said."""
    frames = [f for f in read_blf(DATA / "canopen_master_our_drive.blf") if f.identifier != HEARTBEAT_OF_THE_DRIVE]
    sent: list[tuple[int, bytes]] = []
    drive = canopen_master.make_drive(lambda identifier, data: sent.append((identifier, data)))
    drive.boot()
    assert sent == [(HEARTBEAT_OF_THE_DRIVE, BOOT_UP)]
    sent.clear()
    expected = [(f.identifier, f.data) for f in frames if f.sent]
    for frame in frames:
        if not frame.sent:
            drive.receive(frame.identifier, frame.data)
    assert len(expected) > 400
    assert sent == expected
    assert drive.state is State.SWITCH_ON_DISABLED


class Played:
    """A bus that is a recording: what is sent must be what was sent then, what is received is what came then."""

    def __init__(self, frames: list[Frame]) -> None:
        self.left = [frame for frame in frames if frame.identifier != HEARTBEAT_OF_THE_HOST]
        self.sent = self.errors = 0

    def send(self, identifier: int, data: bytes) -> None:
        """Compare with the recording."""
        if identifier == HEARTBEAT_OF_THE_HOST:
            return
        frame = self.left.pop(0)
        assert (identifier, bytes(data), True) == (frame.identifier, frame.data, frame.sent), f"after {self.sent}"
        self.sent += 1

    def receive(self, time_limit: float = 0.0) -> tuple[int, bytes] | None:
        """Hand over what came next, if it came before the next was sent."""
        if not self.left or self.left[0].sent:
            return None
        frame = self.left.pop(0)
        return frame.identifier, frame.data


def test_the_recording_of_our_host_is_played_again() -> None:
    bus = Played(read_blf(DATA / "our_host_canopen_servo.blf"))
    samples = host_session.session(bus, ManualClock(), lambda: None)
    assert [frame for frame in bus.left if frame.sent] == []
    assert bus.sent > 400
    assert [s.cycle for s in samples[: host_session.CYCLES]] == list(range(host_session.CYCLES))


def test_a_recording_that_differs_is_noticed() -> None:
    """The two tests above can fail: one bit of one frame is enough."""
    frames = read_blf(DATA / "our_host_canopen_servo.blf")
    place = next(k for k, f in enumerate(frames) if f.identifier == 0x181 and k > 500)
    data = bytes([frames[place].data[0] ^ 0x08, *frames[place].data[1:]])
    frames[place] = frames[place]._replace(data=data)
    with pytest.raises(AssertionError, match="after"):
        host_session.session(Played(frames), ManualClock(), lambda: None)


def test_recordings_are_small_and_kept_whole(tmp_path) -> None:
    for path in sorted(DATA.glob("*.blf")):
        assert path.stat().st_size < 50_000
        frames = read_blf(path)
        write_blf(tmp_path / path.name, frames)
        assert read_blf(tmp_path / path.name) == frames
        assert all(a.time <= b.time for a, b in itertools.pairwise(frames))
