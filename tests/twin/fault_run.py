"""One fault over the whole chain on a manual clock: live loop, bus, emulated table, and a witness beside it.

The witness looks at the emulated plant itself, not at what anybody says of it.
"""

from __future__ import annotations

import argparse
import itertools
from dataclasses import dataclass, field
from typing import Any

import pytest

from devices.catalogue import find_device
from devices.cia402.states import State
from devices.clock import ManualClock
from devices.errors import DeviceError
from devices.faults.fault import Fault
from tests.twin.conftest import Kept
from twin.commands import connection
from twin.commands.connection import Connection, connect
from twin.commands.replay import live_twin
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import Rehearsal, rehearse
from twin.run_report import RunReport
from twin.scene import Scene
from twin.scene_faults import FaultPart

_channels = itertools.count()
STANDSTILL = 1e-4
"""m/s, the emulated drive's own."""
TELLING = ("fault", "trip", "stopped", "stop failed")
AFTERWARDS = 2.0
"""How long the table is watched after the host has done what it could, s."""


class Killed(BaseException):
    """The host's process is no more."""


@dataclass(frozen=True)
class Look:
    """What the witness saw at the end of a cycle of the plant: time s; set-point m; true velocity, acceleration."""

    time: float
    setpoint: float
    position: float
    velocity: float
    acceleration: float
    powered: bool
    state: State | None


@dataclass
class Suffered:
    """What became of a run."""

    scene: Scene
    rehearsal: Rehearsal
    fault: Fault
    report: RunReport
    kept: Kept
    looks: list[Look] = field(default_factory=list)
    began: float = 0.0
    over: float = 0.0
    error: DeviceError | None = None
    emulator: Any = None

    @property
    def standstill(self) -> float | None:
        """Time from the fault until the table stands for good, s; None where it does not."""
        moving = [k for k, look in enumerate(self.looks) if abs(look.velocity) > STANDSTILL]
        if not moving or moving[-1] == len(self.looks) - 1:
            return None if moving else 0.0
        return max(0.0, self.looks[moving[-1] + 1].time - self.began)

    @property
    def since(self) -> list[Look]:
        """What was seen from the fault on."""
        return [look for look in self.looks if look.time >= self.began]

    @property
    def state(self) -> State:
        """The drive's, in the end."""
        return self.emulator.drive.state

    @property
    def story(self) -> list[str]:
        """The names of the recording's events that tell of the fault and what came of it, in order."""
        return [event.name for event in self.kept.events if event.name in TELLING]

    def said(self, name: str) -> str:
        """The recording's first event of that name."""
        return next(event.message for event in self.kept.events if event.name == name)


def suffer(scene: Scene, fault: Fault) -> Suffered:
    """Perform `scene` with one fault, on a manual clock, and watch the table until it stands or time is up."""
    part = FaultPart(
        name=fault.name,
        at_s=fault.at,
        magnitude=None if fault.kind.size is None else fault.magnitude,
        duration_s=None if fault.kind.lasts is None else min(fault.duration, 1e6),
    )
    scene = scene.with_faults([part])
    clock = ManualClock()
    entry = find_device(scene.table.device)
    made: list[Any] = []

    def watched(*arguments: Any, **options: Any) -> Any:
        made.append(real(*arguments, **options))
        return made[-1]

    real = connection.emulate
    options = argparse.Namespace(bus="virtual", channel=f"test-fault-{next(_channels)}", bus_option=[])
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(connection, "emulate", watched)
        with connect(options, scene, entry, entry.capacity, clock=clock) as link:
            rehearsal = rehearse(scene, entry.capacity)
            suffered = Suffered(scene, rehearsal, fault, RunReport(), Kept(), emulator=made[0])
            _witness(suffered, clock)
            _perform(suffered, link, clock)
            try:
                link.table.close()
            except DeviceError as error:
                suffered.error = error
            suffered.over = clock.now()
            _afterwards(suffered, clock)
    return suffered


def _perform(suffered: Suffered, link: Connection, clock: ManualClock) -> None:
    scene, rehearsal = suffered.scene, suffered.rehearsal
    injector = link.faults._injector
    assert injector is not None

    def kill() -> None:
        raise Killed

    injector._kill = kill
    link.faults.announce(suffered.kept)
    link.table.enable(0.0)
    began = clock.now()
    suffered.began = began + suffered.fault.at
    live = link.faults.clock
    if hasattr(live, "_killed"):
        live._killed = kill
    try:
        suffered.report = perform(
            link.table,
            rehearsal.motion,
            live_twin(scene),
            suffered.kept,
            live,
            trips=scene.trips,
            after=rehearsal.after,
            targets=link.faults.targets(rehearsal, None),
            watch=Watch(stopped=link.faults.stopped, release=link.release),
        )
        if suffered.report.tripped is None:
            link.table.disable()
    except Killed:
        link.table._powered = False  # nobody is left to close it
    except DeviceError as error:
        suffered.error = error


def _witness(suffered: Suffered, clock: ManualClock) -> None:
    plant, drive = suffered.emulator.plant, getattr(suffered.emulator, "drive", None)
    advance = plant.advance

    def seen(*setpoint: float) -> None:
        advance(*setpoint)
        given, powered = (setpoint[0], plant.powered) if setpoint else (plant.position, True)
        state = drive.state if drive else None
        look = Look(clock.now(), given, plant.position, plant.velocity, plant.acceleration, powered, state)
        suffered.looks.append(look)

    plant.advance = seen


def _afterwards(suffered: Suffered, clock: ManualClock) -> None:
    """Nobody sends anything any more: what does the table do?"""
    emulator, h = suffered.emulator, 1.0 / suffered.scene.twin.cycle_hz
    for _ in range(round(AFTERWARDS / h)):
        clock.advance(h)
        emulator.service()
