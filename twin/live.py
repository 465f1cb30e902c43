"""The live cycle: set-point out, measurement in, prediction beside it, for as long as the motion lasts."""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable

import numpy as np

from devices.clock import Clock
from devices.errors import DeviceError
from devices.table import Sample, ShakeTable
from excitation import Motion
from twin.cycle import CycleRecord, Event, Level, Missed, Sink
from twin.rocking.block import Block
from twin.rocking.track import TrackedBlock
from twin.run_report import RunReport


class LiveTwin:
    """The twin's state, driven by measured base acceleration alone; a run, a rehearsal and a replay all use it.

    The acceleration is taken as linear between samples; where cycles were missed, across the gap.
    """

    def __init__(self, block: Block, restitution: float | None = None, initial_rotation: float = 0.0) -> None:
        self._block = TrackedBlock(block, restitution, initial_rotation)
        self._time = math.nan
        self._acceleration = 0.0

    @property
    def block(self) -> TrackedBlock:
        """The predicted block."""
        return self._block

    def measure(self, time: float, acceleration: float) -> float:
        """Take the acceleration (m/s2) measured at `time` (s, table's clock); return the rotation predicted there, rad.

        The first sample sets the clock: the block is let go at that instant.
        """
        if time > self._time:
            self._block.advance(time - self._time, self._acceleration, acceleration)
        self._time = time
        self._acceleration = acceleration
        return self._block.rotation


def perform(
    table: ShakeTable,
    motion: Motion,
    twin: LiveTwin,
    sink: Sink,
    clock: Clock,
    *,
    following_error: float,
    after: float = 0.0,
    release: Callable[[], None] = lambda: None,
    stopped: Callable[[], str | None] = lambda: None,
    progress: Callable[[float, float, float], None] | None = None,
) -> RunReport:
    """Perform `motion` on an enabled `table`, predicting from what it measures; stop it safely if anything is wrong.

    Parameters
    ----------
    table : ShakeTable
        Enabled at the motion's start.
    motion : Motion
    twin : LiveTwin
    sink : Sink
        Takes every cycle, gap and event.
    clock : Clock
    following_error : float
        Largest |command - feedback|, m, beyond which the run trips. The command is the one the feedback answers.
    after : float
        Time the table is held still at the end, s, for the block to come to rest.
    release : callable
        Called once, after the first sample: lets go of a block held at its initial tilt. The twin's block begins there.
    stopped : callable
        Asked every cycle for a reason to stop (the operator, the recorder); None to go on.
    progress : callable, optional
        Called now and then with time s, predicted and measured rotation rad; it must not block.

    Returns
    -------
    RunReport

    Notes
    -----
    Cycle k begins k cycle times after the first. A cycle that could not begin within its own cycle time is missed, with
    all those after it that are already over: they are recorded as missed and never made up for.
    """
    loop = _Loop(table, motion, twin, sink, clock, following_error, release, progress)
    last = math.ceil((motion.duration + after) / table.cycle_time)
    gc.collect()
    gc.freeze()
    try:
        loop.run(last, stopped)
    finally:
        gc.unfreeze()
    return loop.report


PREDICTED = {
    "uplift": "the block lifts",
    "impact": "impact at {rate:+.4f} rad/s",
    "rest": "the block comes to rest",
    "overturned": "the block has fallen, at {rate:+.4f} rad/s",
}
"""What an event of the predicted block says; rates are those just before it."""


class _Loop:
    def __init__(
        self,
        table: ShakeTable,
        motion: Motion,
        twin: LiveTwin,
        sink: Sink,
        clock: Clock,
        following_error: float,
        release: Callable[[], None],
        progress: Callable[[float, float, float], None] | None,
    ) -> None:
        self.table = table
        self.motion = motion
        self.twin = twin
        self.sink = sink
        self.clock = clock
        self.following_error = following_error
        self.release = release
        self.progress = progress
        self.report = RunReport()
        self._target = motion.displacement(0.0)
        self._targets: list[float] = []
        self._phases = list(motion.phases)

    def run(self, last: int, stopped: Callable[[], str | None]) -> None:
        """Execute or miss the cycles 0 to `last`, or stop the table."""
        dt = self.table.cycle_time
        ends = np.arange(1, last + 2, dtype=np.float64) * dt
        self._targets = self.motion.displacement(ends).tolist()
        begin = self.clock.now()
        k = 0
        while k <= last:
            lateness = self.clock.wait_until(begin + k * dt)
            gone = int(lateness / dt)
            if gone > 0:
                gone = min(gone, last + 1 - k)
                self.sink.missed(Missed(k, k + gone - 1, time.time_ns()))
                self.report.missed += gone
                k += gone
                continue
            reason = self._cycle(k, lateness)
            reason = reason or stopped()
            if reason is not None:
                self._trip(k, reason)
                return
            self.report.timing.works.append(self.clock.now() - begin - k * dt - lateness)
            k += 1

    def _cycle(self, k: int, lateness: float) -> str | None:
        """Do one cycle; return why it must be the last, or None."""
        answered = self._target
        target = self._targets[k]
        try:
            sample = self.table.exchange(k, target)
        except DeviceError as error:
            self.sink.missed(Missed(k, k, time.time_ns()))
            self.report.missed += 1
            return f"{type(error).__name__}: {error}"
        self._target = target
        if self.report.executed == 0:
            self.release()
        self._take(sample, target, lateness)
        self.report.executed += 1
        self.report.timing.starts.append(lateness)
        error = abs(sample.position - answered)
        if error > self.following_error:
            return (
                f"following error: the table is {error * 1e3:.2f} mm from its command; "
                f"the limit is {self.following_error * 1e3:.2f} mm"
            )
        return None

    def _take(self, sample: Sample, target: float, lateness: float) -> None:
        """Predict from the measured acceleration, and hand on what the cycle left behind."""
        predicted = self.twin.measure(sample.time, sample.acceleration)
        now = time.time_ns()
        self.sink.cycle(
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
                self.twin.block.angular_velocity,
                sample.status,
            )
        )
        self.report.see(predicted, sample.rotation)
        for event in self.twin.block.events:
            words = PREDICTED[event.name].format(rate=event.rate)
            self._say(event.time, "info", event.name, f"predicted: {words}", now)
        while self._phases and self._phases[0].start <= sample.time:
            phase = self._phases.pop(0)
            self._say(phase.start, "info", "phase", f"{phase.name} until {phase.end:.3f} s", now)
        if self.progress is not None:
            self.progress(sample.time, predicted, sample.rotation)

    def _ramp(self, sample: Sample) -> None:
        """Take a cycle of the drive's own ramp: it has no set-point of ours and no schedule to be late for."""
        self.report.stopping += 1
        self._take(sample, math.nan, math.nan)

    def _trip(self, k: int, reason: str) -> None:
        """Stop the table by the drive's own ramp, record the way down, and say why."""
        self.report.tripped = reason
        self._say(k * self.table.cycle_time, "error", "trip", reason, time.time_ns())
        try:
            self.table.quick_stop(self._ramp)
        except DeviceError as error:
            failed = f"the stop failed, THE TABLE MAY STILL BE MOVING: {error}"
            self.report.tripped = f"{reason}; and {failed}"
            self._say(k * self.table.cycle_time, "error", "stop failed", failed, time.time_ns())
        else:
            self._say(k * self.table.cycle_time, "info", "stopped", "the table is at rest, power off", time.time_ns())

    def _say(self, moment: float, level: Level, name: str, message: str, now: int) -> None:
        self.sink.event(Event(moment, now, level, name, message))
