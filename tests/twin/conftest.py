"""A live chain on a manual clock: emulated table and specimen on a virtual bus, a sink that keeps everything."""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from devices.catalogue import find_device
from devices.cia402.master import Cia402Table
from devices.clock import Clock, ManualClock
from twin.commands.connection import connect
from twin.commands.outlook import twin_of_run
from twin.cycle import CycleRecord, Event, Missed
from twin.live import perform
from twin.live_loop import Ends, Watch
from twin.rehearsal import Rehearsal, rehearse
from twin.run_report import RunReport
from twin.scene import Scene, parse_scene
from twin.scene_trips import FollowingErrorTrip

SHORT = """
title = "a quick one"
[block]
width_mm = 60
height_mm = 270
{block}
[excitation]
{excitation}
[table]
device = "quanser_st3"
settle_s = 0.1
[twin]
futures = 20
"""
SINE = 'kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 4'
FREE = 'kind = "none"\nduration_s = 0.6'


def short_scene(excitation: str = SINE, block: str = "") -> Scene:
    """Return a scene that is over in seconds."""
    return parse_scene(SHORT.format(excitation=excitation, block=block), name="short", folder=Path())


class Kept:
    """A sink that keeps everything in memory."""

    def __init__(self) -> None:
        self.cycles: list[CycleRecord] = []
        self.gaps: list[Missed] = []
        self.events: list[Event] = []

    def cycle(self, record: CycleRecord) -> None:
        self.cycles.append(record)

    def missed(self, missed: Missed) -> None:
        self.gaps.append(missed)

    def event(self, event: Event) -> None:
        self.events.append(event)

    def numbers(self) -> list[int]:
        """Every cycle number, executed or missed, in order."""
        missed = [range(gap.first, gap.last + 1) for gap in self.gaps]
        return sorted([record.cycle for record in self.cycles] + list(itertools.chain(*missed)))


_channels = itertools.count()


@contextmanager
def chain(scene: Scene, clock: Clock | None = None) -> Iterator[tuple[Cia402Table, Callable[[], None], Rehearsal]]:
    """Open the scene's emulated table on a virtual bus of its own; host and emulator go by `clock`."""
    entry = find_device(scene.table.device)
    options = argparse.Namespace(bus="virtual", channel=f"test-live-{next(_channels)}", bus_option=[])
    with connect(options, scene, entry, entry.capacity, clock=clock) as link, link.table as table:
        yield table, link.release, rehearse(scene, entry.capacity)


def perform_on(
    scene: Scene,
    clock: Clock | None = None,
    *,
    stopped: Callable[[], Ends | None] = lambda: None,
    limit: float | None = None,
) -> tuple[RunReport, Kept]:
    """Perform a scene on a manual clock; return the report and everything the sink took."""
    kept, clock = Kept(), clock or ManualClock()
    trips = scene.trips
    if limit is not None:
        trips = trips.model_copy(update={"following_error": FollowingErrorTrip(limit_mm=1e3 * limit)})
    with chain(scene, clock) as (table, release, rehearsal):
        table.enable(0.0)
        report = perform(
            table,
            rehearsal.motion,
            twin_of_run(rehearsal),
            kept,
            clock,
            trips=trips,
            after=rehearsal.after,
            watch=Watch(stopped=stopped, release=release),
        )
    return report, kept


@pytest.fixture(scope="session")
def performed() -> tuple[Scene, RunReport, Kept]:
    """One short run of a sine, shared by the tests that only look."""
    scene = short_scene()
    return scene, *perform_on(scene)
