"""The cycles of a run, one after the other: exchange, predict, judge, hand on; and the way down where it must end."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from devices.clock import Clock
from devices.errors import DeviceError, DriveFault, DriveStopped, SetpointRefused
from devices.plausibility import Plausibility
from devices.sample import Sample
from devices.table import ShakeTable
from excitation import TableRun
from twin.cycle import CycleRecord, Event, Level, Missed, Sink
from twin.foresight import advice_words
from twin.run_report import RunReport
from twin.trips import Name, Seen, Trip, Trips

if TYPE_CHECKING:
    from twin.forecast.forecast import Forecast
    from twin.live_twin import LiveTwin

PREDICTED = {
    "uplift": "the block lifts",
    "impact": "impact at {rate:+.4f} rad/s",
    "rest": "the block comes to rest",
    "overturned": "the block has fallen, at {rate:+.4f} rad/s",
}
"""What an event of the predicted block says; rates are those just before it."""
ADVICE_LASTS = 0.02
"""Advice is said once it has been the same for this long, s: near a boundary it may change with every sample."""
ACTIONS = {"indicate": "indicated", "ramp_down": "the table is ramped down", "cut_power": "the power is cut"}


class Status(NamedTuple):
    """What somebody beside the table is shown: time s, phase, rotations rad, cycles missed, forecast, first trip."""

    time: float
    phase: str
    predicted: float
    measured: float
    missed: int
    forecast: Forecast | None
    trip: str | None


class Ends(NamedTuple):
    """Why a run shall stop, as its owner says it: the trip's name and a sentence."""

    name: Name
    reason: str


@dataclass(frozen=True, slots=True)
class Watch:
    """What a run's owner has a say in; every callable is asked in every cycle, so it must be quick.

    Attributes
    ----------
    stopped : callable
        Returns a reason to stop (operator, recorder), or None.
    cut : callable
        Whether the power is to be cut now, whatever ramp is under way.
    release : callable
        Called once, after the first sample: lets go of a block held at its initial tilt.
    progress : callable or None
        Called with a `Status` every cycle; it must not block.
    """

    stopped: Callable[[], Ends | None] = lambda: None
    cut: Callable[[], bool] = lambda: False
    release: Callable[[], None] = lambda: None
    progress: Callable[[Status], None] | None = None


class _PowerCut(Exception):  # noqa: N818 - it says what is asked
    """The operator asked for the power during a ramp."""


class Loop:
    """One run. See `twin.live.perform`."""

    def __init__(
        self,
        table: ShakeTable,
        run: TableRun,
        targets: Sequence[float],
        twin: LiveTwin,
        sink: Sink,
        clock: Clock,
        trips: Trips,
        watch: Watch,
    ) -> None:
        self.report = RunReport()
        self._table = table
        self._twin = twin
        self._sink = sink
        self._clock = clock
        self._trips = trips
        self._watch = watch
        self._sensors = Plausibility(table.capacity, table.cycle_time)
        self._seen = Seen()
        self._target = run.displacement(0.0)
        self._targets = targets
        self._phases = list(run.phases)
        self._phase = ""
        self._advice, self._advice_since, self._advice_said = "none", 0.0, "none"

    def run(self) -> None:
        """Execute or miss every cycle, or stop the table."""
        dt, last = self._table.cycle_time, len(self._targets) - 1
        begin = self._clock.now()
        k = 0
        while k <= last:
            lateness = self._clock.wait_until(begin + k * dt)
            gone = min(int(lateness / dt), last + 1 - k)
            if gone > 0:
                self._missed(k, k + gone - 1)
                k += gone
            else:
                self._cycle(k, lateness)
                if (ends := self._watch.stopped()) is not None:
                    self._report(ends.name, k * dt, ends.reason)
                self.report.timing.works.append(self._clock.now() - begin - k * dt - lateness)
                k += 1
            if self._trips.stopping is not None:
                self._stop(k - 1)
                return

    def _missed(self, first: int, last: int) -> None:
        self._sink.missed(Missed(first, last, time.time_ns()))
        self.report.missed += last - first + 1
        if (trip := self._trips.missed(first, last, last * self._table.cycle_time)) is not None:
            self._announce(trip)

    def _cycle(self, k: int, lateness: float) -> None:
        answered, target = self._target, self._targets[k]
        try:
            sample = self._table.exchange(k, target)
        except DeviceError as error:
            # Of a set-point that was refused nothing was sent: its cycle is the first of the way down.
            if not isinstance(error, SetpointRefused):
                self._sink.missed(Missed(k, k, time.time_ns()))
                self.report.missed += 1
            self._report(_cause(error), k * self._table.cycle_time, f"{type(error).__name__}: {error}")
            return
        self._target = target
        if self.report.executed == 0:
            self._watch.release()
        self._take(sample, target, lateness)
        self.report.executed += 1
        self.report.timing.starts.append(lateness)
        self.report.timing.answers.append(self._table.answer_time)
        self._judge(k, answered, sample)

    def _judge(self, k: int, answered: float, sample: Sample) -> None:
        if (nonsense := self._sensors.judge(k, answered, sample.position, sample.acceleration)) is not None:
            self._report("sensor", sample.time, nonsense)
            if self._trips.stopping is not None:
                # What else this sample would say makes no more sense.
                return
        seen, foresight = self._seen, self._twin.foresight
        seen.cycle, seen.time = k, sample.time
        seen.command, seen.position, seen.rotation = answered, sample.position, sample.rotation
        if foresight is not None:
            seen.estimate, seen.lying = foresight.rotation_before, foresight.observer.overturned
            if (latest := foresight.latest) is not None:
                seen.probability = latest.going_on.probability
                seen.probability_if_stopped = latest.stopping.probability
        for trip in self._trips.judge(seen):
            self._announce(trip)

    def _take(self, sample: Sample, target: float, lateness: float) -> None:
        """Predict from the measured acceleration, and hand on what the cycle left behind."""
        twin = self._twin
        began = time.thread_time_ns()
        predicted = twin.measure(sample.time, sample.acceleration, sample.rotation)
        foresight = twin.foresight
        forecast = None if foresight is None else foresight.forecast
        estimate = None if foresight is None else foresight.estimate
        self.report.timing.thoughts.append(1e-9 * (time.thread_time_ns() - began))
        now = time.time_ns()
        self._sink.cycle(
            CycleRecord(
                sample.cycle,
                sample.time,
                now,
                lateness,
                target,
                sample.position,
                sample.acceleration,
                sample.rotation,
                predicted,
                twin.block.angular_velocity,
                sample.status,
                forecast,
                estimate,
            )
        )
        self.report.see(predicted, sample.rotation)
        for event in twin.block.events:
            words = PREDICTED[event.name].format(rate=event.rate)
            self._say(event.time, "info", event.name, f"predicted: {words}", now)
        while self._phases and self._phases[0].start <= sample.time:
            phase = self._phases.pop(0)
            self._phase = phase.name
            self._say(phase.start, "info", "phase", f"{phase.name} until {phase.end:.3f} s", now)
        latest = None if foresight is None else foresight.latest
        if latest is not None:
            self._advise(sample.time, latest, now)
        if self._watch.progress is not None:
            trip = self._trips.latched[0].name if self._trips.latched else None
            self._watch.progress(
                Status(sample.time, self._phase, predicted, sample.rotation, self.report.missed, latest, trip)
            )

    def _advise(self, moment: float, latest: Forecast, now: int) -> None:
        """Say what is advised where it is something else, and has been for a while."""
        if latest.advice != self._advice:
            self._advice, self._advice_since = latest.advice, moment
        if self._advice != self._advice_said and moment - self._advice_since >= ADVICE_LASTS:
            self._advice_said = self._advice
            level: Level = "info" if self._advice == "continue" else "warning"
            words = advice_words(latest)
            self._say(moment, level, "advice", words, now)
            if level == "warning" or self.report.advice:
                self.report.advice.append((moment, words))

    def _report(self, name: Name, moment: float, reason: str) -> None:
        if (trip := self._trips.report(name, moment, reason)) is not None:
            self._announce(trip)

    def _announce(self, trip: Trip) -> None:
        self.report.trips.append(trip)
        level: Level = "error" if trip.stops else "warning"
        message = f"{trip.name}: {trip.reason}; {ACTIONS[trip.action]}"
        self._say(trip.time, level, "trip", message, time.time_ns())

    def _ramp(self, sample: Sample) -> None:
        """Take a cycle of the way down: it has no set-point of ours and no schedule to be late for."""
        self.report.stopping += 1
        self._take(sample, math.nan, math.nan)
        if self._watch.cut():
            raise _PowerCut

    def _stop(self, last: int) -> None:
        """Stop the table as the hardest trip asks, record the way down, and say how it ended."""
        trip = self._trips.stopping
        if trip is None:
            return
        moment = last * self._table.cycle_time
        self.report.tripped = f"{trip.name}: {trip.reason}"
        if self._twin.foresight is not None:
            self._twin.foresight.ramp_down(moment)
        try:
            if trip.cuts_power:
                self._table.cut_power(self._coast, last)
            else:
                try:
                    self._table.quick_stop(self._ramp, last)
                except _PowerCut:
                    self._say(moment, "error", "trip", "operator: the power is cut during the ramp", time.time_ns())
                    self._table.cut_power(self._coast)
        except DeviceError as error:
            failed = f"the stop failed, THE TABLE MAY STILL BE MOVING: {error}"
            self.report.tripped += f"; and {failed}"
            self._say(moment, "error", "stop failed", failed, time.time_ns())
        else:
            rest = f"the table is at rest at {self._table.position * 1e3:+.2f} mm, power off"
            self._say(moment, "info", "stopped", rest, time.time_ns())

    def _coast(self, sample: Sample) -> None:
        """Take a cycle without power."""
        self.report.stopping += 1
        self._take(sample, math.nan, math.nan)

    def _say(self, moment: float, level: Level, name: str, message: str, now: int) -> None:
        self._sink.event(Event(moment, now, level, name, message))


def _cause(error: DeviceError) -> Name:
    """Return the trip an error of the table's belongs to."""
    if isinstance(error, SetpointRefused):
        return "capacity"
    return "drive" if isinstance(error, (DriveFault, DriveStopped)) else "connection"
