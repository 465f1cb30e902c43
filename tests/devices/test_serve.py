"""The emulator in a loop of its own, here driven by a scripted stop signal and a manual clock."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.cia301 import frames
from devices.cia402.states import State

if TYPE_CHECKING:
    from collections.abc import Callable

H = 1e-3


class Script:
    """A stop signal that lets a cycle of the bus clock pass at each look, and is set after `looks`."""

    def __init__(self, rig, looks: int, each: Callable[[], object] = lambda: None) -> None:
        self.rig, self.looks, self.each = rig, looks, each

    def is_set(self) -> bool:
        self.looks -= 1
        self.rig.clock.advance(H)
        self.each()
        return self.looks < 0


def moving(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.01 * (1.0 - math.cos(math.tau * 2.0 * (k + 1) * H)) for k in range(100)])
    rig.heard()


def emergencies(rig) -> list[int]:
    return [frames.unpack_emergency(data).code for identifier, data in rig.heard() if identifier == 0x081]


def test_a_silent_host_is_noticed_by_the_drives_own_clock(rig) -> None:
    moving(rig)
    rig.emulator.serve(Script(rig, 20))
    # set before patience ended, it still leaves no moving table behind
    assert rig.emulator.drive.at_ease
    assert rig.emulator.drive.state is State.FAULT
    assert emergencies(rig) == [0x8700]


def test_it_stops_within_its_watchdog_and_its_ramp(rig) -> None:
    moving(rig)
    cycle, speed = rig.emulator.drive.cycle, rig.emulator.plant.velocity
    calm: list[int] = []
    drive = rig.emulator.drive
    rig.emulator.serve(Script(rig, 250, lambda: calm.append(drive.cycle) if drive.at_ease else None))
    assert emergencies(rig) == [0x8700]
    # 20 cycles of patience at no more than the capacity's acceleration, then 1 m/s2, then the loop settles
    assert calm[0] - cycle <= 21 + (speed + 9.81 * 0.02) / 1.0 / H + 40


def test_a_host_that_only_holds_is_waited_for_longer(rig) -> None:
    rig.table.enable(0.0)
    rig.follow([0.0] * 5)
    rig.emulator.serve(Script(rig, 60), idle_limit=0.05)
    assert emergencies(rig) == [0x8700]
    assert rig.emulator.drive.state is State.FAULT


def test_a_host_at_work_is_served(rig) -> None:
    sync = iter(range(100, 160))
    rig.heard()
    rig.emulator.serve(Script(rig, 60, lambda: rig.tap.send(0x080, frames.pack_sync(next(sync, 159) % 240 + 1))))
    answers = [identifier for identifier, _ in rig.heard()]
    assert answers.count(0x181) >= 59
    assert rig.emulator.drive.state is State.SWITCH_ON_DISABLED


def test_heartbeats_go_on_without_sync(rig) -> None:
    rig.heard()
    rig.emulator.serve(Script(rig, 150))
    beats = [identifier for identifier, _ in rig.heard()]
    assert set(beats) == {0x701, 0x702}
    assert beats.count(0x701) in (1, 2)
