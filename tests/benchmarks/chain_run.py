"""One scene through the chain that `twin run --fast` uses, and what becomes of it if it is stopped in any cycle.

A stop is really made. In the cycle asked about the process is copied (`os.fork`: host, bus, drive, table and block, to
the bit); in the copy the run's owner asks for a stop as Ctrl-C does, and the loop's trip, the master's quick stop and
the drive's ramp follow. Then the block is left alone on the table that stands, until it rests or lies. `repeated` makes
the same stop in a run from its beginning: where there is no fork, and to check.
"""

from __future__ import annotations

import dataclasses
import math
import os
from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import NoReturn

from devices.clock import ManualClock
from devices.sample import Sample
from devices.table import ShakeTable
from tests.benchmarks.forecast_study import Follower
from twin.commands.connection import Connection, connect, emulated
from twin.commands.emulated_run import virtual_options
from twin.commands.inputs import capacity_for
from twin.commands.outlook import twin_of_run
from twin.cycle import CycleRecord, Event, Missed
from twin.live import perform
from twin.live_loop import Ends, Status, Watch
from twin.live_twin import LiveTwin
from twin.rehearsal import Rehearsal, make_motion, rehearse
from twin.rocking.response import Outcome
from twin.run_report import RunReport
from twin.scene import Scene
from twin.specimen import Specimen

AFTER = 1.0
"""How long a run is followed after the shaking, s, where the block neither rests nor lies before."""
ALONE, PATIENCE = 0.005, 60.0
"""The block alone on a table that stands: in steps of, and for at most, s."""
CAN_COPY = hasattr(os, "fork")


@dataclass
class Performed:
    """What became of a run that was not stopped.

    Attributes
    ----------
    fell : float or None
        When the block lay, s.
    alarm : float or None
        When the scene's forecast trip latched, s.
    alarm_in_pulse : float or None
        The same counted from the pulse on: before it only the plan speaks.
    advised : dict of str to float
        When each advice was first given from the pulse on, s.
    right, instants : int
        Cycles of the shaking whose forecast was what came, of all.
    said : dict of int to (str, float)
        Advice and probability in each cycle asked about.
    stops : dict of int to bool
        Whether the block falls if the run is stopped in that cycle.
    cycles : int
    """

    fell: float | None = None
    alarm: float | None = None
    alarm_in_pulse: float | None = None
    advised: dict[str, float] = field(default_factory=dict[str, float])
    right: int = 0
    instants: int = 0
    said: dict[int, tuple[str, float]] = field(default_factory=dict[int, "tuple[str, float]"])
    stops: dict[int, bool] = field(default_factory=dict[int, bool])
    cycles: int = 0


class Nobody:
    """A sink that keeps nothing."""

    def cycle(self, record: CycleRecord) -> None:
        """Take a cycle."""

    def missed(self, missed: Missed) -> None:
        """Take a gap."""

    def event(self, event: Event) -> None:
        """Take an event."""


class Owner:
    """A run's owner: asks in the cycles of interest what a stop would do, and ends the run when the shaking is over.

    Cycles of interest are those `asked`; with `first` also those in which an alarm or an advice is first given.
    """

    def __init__(
        self, specimen: Specimen, rehearsal: Rehearsal, twin: LiveTwin, asked: Iterable[int], *, first: bool
    ) -> None:
        self.done = Performed()
        self.copied: int | None = None
        self._specimen = specimen
        self._twin = twin
        self._motion = rehearsal.motion
        self._step = 1.0 / rehearsal.scene.twin.cycle_hz
        self._asked = set(asked)
        self._first = first
        self._whole, self._pulse = Follower(), Follower()
        self._status: Status | None = None
        self._outcomes: list[Outcome] = []

    def progress(self, status: Status) -> None:
        """Take what the cycle left."""
        self._status = status

    def stopped(self) -> Ends | None:
        """Say why the run shall stop, if it shall."""
        status = self._status
        if status is None:
            return None
        t, motion, specimen = status.time, self._motion, self._specimen
        if specimen.overturned:
            self.done.fell = t
            return Ends("operator", "the block lies")
        if self._of_interest(status) and self._falls_if_stopped(round(t / self._step)):
            return Ends("operator", "stop was asked")
        if t > motion.shaking_end + 0.05 and (specimen.resting or t > motion.shaking_end + AFTER):
            return Ends("operator", "the shaking is over")
        return None

    def finish(self, report: RunReport) -> Performed:
        """Follow the block to its end, and count."""
        done, status = self.done, self._status
        assert status is not None
        if done.fell is None and (alone := left_alone(self._specimen)) is not None:
            done.fell = status.time + alone
        done.alarm = next((trip.time for trip in report.trips if trip.name == "forecast"), None)
        done.alarm_in_pulse, done.advised = self._pulse.alarm, dict(self._pulse.advised)
        done.instants = len(self._outcomes)
        done.right = sum((outcome is Outcome.OVERTURNED) == (done.fell is not None) for outcome in self._outcomes)
        done.cycles = report.executed
        return done

    def _of_interest(self, status: Status) -> bool:
        t, forecast, k = status.time, status.forecast, round(status.time / self._step)
        if forecast is None:
            return k in self._asked
        known = self._known()
        self._whole.see(t, forecast)
        if t >= self._motion.pulse_start:
            self._pulse.see(t, forecast)
            if t < self._motion.shaking_end:
                self._outcomes.append(forecast.going_on.outcome)
        if k not in self._asked and not (self._first and self._known() != known):
            return False
        self.done.said[k] = forecast.advice, forecast.going_on.probability
        return True

    def _known(self) -> tuple[bool, bool, int]:
        return self._whole.alarm is None, self._pulse.alarm is None, len(self._pulse.advised)

    def _falls_if_stopped(self, k: int) -> bool:
        """Ask a copy of the run whether the block falls if it is stopped now; True in the copy itself."""
        if not CAN_COPY:
            # Asked of a run from the beginning, once this one is over.
            return False
        read, write = os.pipe()
        copy = os.fork()
        if copy == 0:
            os.close(read)
            self.copied = write
            # What the host foresees on the way down changes nothing of it, and costs most.
            self._twin.foresight = None
            return True
        os.close(write)
        with os.fdopen(read, "rb") as answer:
            said = answer.read()
        os.waitpid(copy, 0)
        if said not in (b"falls", b"stands"):
            raise RuntimeError(f"the copy of a run that was stopped in cycle {k} said {said!r}")
        self.done.stops[k] = said == b"falls"
        return False


def short(scene: Scene) -> Rehearsal:
    """Return the scene's run, no longer than its block is followed."""
    rehearsal = rehearse(scene, capacity_for(scene))
    capacity, motion, after = rehearsal.capacity, rehearsal.motion, AFTER + 0.2
    if capacity.machine is None:
        motion, after = make_motion(scene, capacity, rehearsal.given, wait=after), 0.0
    return dataclasses.replace(rehearsal, motion=motion, after=after)


def performed(rehearsal: Rehearsal, *, observed: bool, asked: Iterable[int] = (), first: bool = True) -> Performed:
    """Perform a run; find what a stop does in the cycles `asked`, and where an advice or an alarm is first given.

    Parameters
    ----------
    rehearsal : Rehearsal
        See `short`.
    observed : bool
        Whether the host hears the rotation sensor; without it the forecast starts from the free prediction.
    asked : iterable of int
    first : bool
        Whether stops are tried where an advice or an alarm is first given.
    """
    with ExitStack() as stack:
        link, specimen = _connected(stack, rehearsal.scene)
        twin = twin_of_run(rehearsal)
        owner = Owner(specimen, rehearsal, twin, asked, first=first)
        if not observed:
            _deafen(link.table)
        try:
            report = _perform(link, rehearsal, twin, owner.stopped, owner.progress)
        except BaseException as error:
            if owner.copied is None:
                raise
            failed = repr(error)
            _answer(owner.copied, lambda: failed)
        if owner.copied is not None:
            _answer(owner.copied, lambda: "stands" if left_alone(specimen) is None else "falls")
        done = owner.finish(report)
    if not CAN_COPY:
        done.stops = {k: repeated(rehearsal, k) for k in done.said}
    return done


def repeated(rehearsal: Rehearsal, cycle: int) -> bool:
    """Return whether the block falls if the run is stopped in `cycle`: a run from its beginning, stopped there."""
    last = (cycle - 0.5) / rehearsal.scene.twin.cycle_hz
    now = -1.0

    def progress(status: Status) -> None:
        nonlocal now
        now = status.time

    def stopped() -> Ends | None:
        return Ends("operator", "stop was asked") if now > last else None

    with ExitStack() as stack:
        link, specimen = _connected(stack, rehearsal.scene)
        _perform(link, rehearsal, twin_of_run(rehearsal), stopped, progress)
        return left_alone(specimen) is not None


def left_alone(specimen: Specimen) -> float | None:
    """Leave the block on a table that stands; return after how many seconds it lies, None where it rests.

    Raises
    ------
    RuntimeError
        It does neither within `PATIENCE`.
    """
    for k in range(round(PATIENCE / ALONE)):
        if specimen.overturned:
            return k * ALONE
        if specimen.resting:
            return None
        specimen(ALONE, 0.0, 0.0)
    raise RuntimeError(f"the block neither lies nor rests {PATIENCE:g} s after the table stopped")


def _answer(pipe: int, said: Callable[[], str]) -> NoReturn:
    """End the copy of a run with what it found, or with why it could not."""
    try:
        words = said()
    except BaseException as error:  # noqa: BLE001 - the copy must not go on as if it were the run
        words = repr(error)
    os.write(pipe, words.encode())
    os._exit(0)


def _connected(stack: ExitStack, scene: Scene) -> tuple[Connection, Specimen]:
    clock = ManualClock()
    link = stack.enter_context(connect(virtual_options(), scene, emulated(scene), capacity_for(scene), clock=clock))
    stack.enter_context(link.table)
    assert link.specimen is not None
    return link, link.specimen


def _perform(
    link: Connection,
    rehearsal: Rehearsal,
    twin: LiveTwin,
    stopped: Callable[[], Ends | None],
    progress: Callable[[Status], None],
) -> RunReport:
    link.table.enable(rehearsal.motion.displacement(0.0))
    return perform(
        link.table,
        rehearsal.motion,
        twin,
        Nobody(),
        link.faults.clock,
        trips=rehearsal.scene.trips,
        after=rehearsal.after,
        watch=Watch(stopped=stopped, release=link.release, progress=progress),
    )


def _deafen(table: ShakeTable) -> None:
    """Take the rotation out of every sample, as where no sensor is heard."""
    exchange = table.exchange

    def deaf(cycle: int, target_position: float) -> Sample:
        return dataclasses.replace(exchange(cycle, target_position), rotation=math.nan)

    table.exchange = deaf  # type: ignore[method-assign]
