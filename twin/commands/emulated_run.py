"""A scene performed on its emulated table, on a clock that never waits: the same frames and code as a live run."""

from __future__ import annotations

import argparse
from dataclasses import dataclass, field

from devices.clock import ManualClock
from twin.commands.connection import EMULATOR, connect, emulated
from twin.commands.inputs import capacity_for
from twin.commands.outlook import twin_of_run
from twin.cycle import CycleRecord, Event, Missed
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import Rehearsal, rehearse
from twin.run_report import RunReport
from twin.scene import Scene


@dataclass
class Kept:
    """A sink that keeps everything in memory."""

    cycles: list[CycleRecord] = field(default_factory=list[CycleRecord])
    gaps: list[Missed] = field(default_factory=list[Missed])
    events: list[Event] = field(default_factory=list[Event])

    def cycle(self, record: CycleRecord) -> None:
        """Keep an executed cycle."""
        self.cycles.append(record)

    def missed(self, missed: Missed) -> None:
        """Keep a gap."""
        self.gaps.append(missed)

    def event(self, event: Event) -> None:
        """Keep an event."""
        self.events.append(event)


def virtual_options() -> argparse.Namespace:
    """Return the options of an emulator inside this process."""
    return argparse.Namespace(device=EMULATOR, bus="virtual", channel=None, bus_option=[], fault=[])


def perform_emulated(scene: Scene) -> tuple[Rehearsal, RunReport, Kept]:
    """Perform a scene from beginning to end; equal scenes give equal runs, but for the host's clock.

    Raises
    ------
    InputError
        Its table has no emulator, or the scene cannot be made.
    DeviceError
        The emulated table gave up.
    """
    entry = emulated(scene)
    capacity = capacity_for(scene)
    rehearsal = rehearse(scene, capacity)
    kept = Kept()
    with connect(virtual_options(), scene, entry, capacity) as link, link.table as table:
        table.enable(rehearsal.motion.displacement(0.0))
        report = perform(
            table,
            rehearsal.motion,
            twin_of_run(rehearsal),
            kept,
            ManualClock(),
            trips=scene.trips,
            after=rehearsal.after,
            watch=Watch(release=link.release),
        )
    return rehearsal, report, kept
