"""One command played on a table, and what was measured on the way."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from devices.clock import Clock
from devices.positioning import bring_to
from devices.table import ShakeTable
from excitation.table_run import TableRun
from twin.cycle import CycleRecord, Event, Missed
from twin.live import perform
from twin.live_loop import Ends, Watch
from twin.live_twin import LiveTwin
from twin.rocking.compiled import FloatArray
from twin.scene_trips import TripsPart
from twin.tuning.window import Trace

LONGEST_GAP = 5
"""Cycles in a row the host may miss: what was measured beside them is taken as linear between."""
TRIES = 3
"""Runs that are made for one that has no longer gap."""


class BrokenOffError(Exception):
    """A run was not performed to its end; the message says why, and the table was stopped."""


class Player:
    """Plays commands of one motion on an open table, which is powered off between two runs.

    Parameters
    ----------
    table : ShakeTable
        Open.
    motion : TableRun
        Gives phases and length; the commands are variants of it.
    twin : callable
        Makes a new predicted block for each run: the live cycle has one, though nothing stands on the table.
    clock : Clock
    trips : TripsPart
        As for a run.
    positioning_acceleration : float
        m/s2.
    stopped : callable
        Asked every cycle for a reason to stop.
    """

    def __init__(
        self,
        table: ShakeTable,
        motion: TableRun,
        twin: Callable[[], LiveTwin],
        clock: Clock,
        *,
        trips: TripsPart,
        positioning_acceleration: float,
        stopped: Callable[[], Ends | None] = lambda: None,
    ) -> None:
        self._table, self._motion, self._twin, self._clock = table, motion, twin, clock
        self._trips = trips
        self._gentle = positioning_acceleration
        self._stopped = stopped
        self.runs = 0

    def __call__(self, command: FloatArray) -> Trace:
        """Perform `command`, where to be at each sample of the run, m; return what was measured.

        Raises
        ------
        BrokenOffError
            Where it was stopped, or the host could not keep up in `TRIES` runs.
        DeviceError
            Where the table does not come up or go down in order.
        """
        gap = 0
        for _ in range(TRIES):
            kept = self._perform(command)
            gap = kept.longest_gap
            if gap <= LONGEST_GAP:
                return kept.trace(command.size - 1)
        raise BrokenOffError(f"host: it missed {gap} cycles in a row, the last of {TRIES} runs one after another")

    def _perform(self, command: FloatArray) -> Measured:
        table, kept = self._table, Measured()
        start = float(command[0])
        if not bring_to(table, start, self._gentle, self._clock, stopped=lambda: self._stopped() is not None):
            raise BrokenOffError("operator: stop was asked")
        table.enable(start)
        report = perform(
            table,
            self._motion,
            self._twin(),
            kept,
            self._clock,
            trips=self._trips,
            targets=command[1:].tolist(),
            watch=Watch(stopped=self._stopped),
        )
        if report.tripped is not None:
            raise BrokenOffError(report.tripped)
        table.disable()
        self.runs += 1
        return kept


class Measured:
    """A sink that keeps what the table measured."""

    def __init__(self) -> None:
        self._numbers: list[int] = []
        self._positions: list[float] = []
        self._accelerations: list[float] = []
        self.longest_gap = 0

    def cycle(self, record: CycleRecord) -> None:
        """Keep an executed cycle."""
        self._numbers.append(record.cycle)
        self._positions.append(record.position)
        self._accelerations.append(record.acceleration)

    def missed(self, missed: Missed) -> None:
        """Note a gap."""
        self.longest_gap = max(self.longest_gap, missed.last - missed.first + 1)

    def event(self, event: Event) -> None:
        """Nothing is made of events."""

    def trace(self, size: int) -> Trace:
        """Return the samples of cycles 0 to `size` - 1; what is missing is linear between its neighbours."""
        numbers = np.arange(size)
        return Trace(
            np.interp(numbers, self._numbers, self._positions), np.interp(numbers, self._numbers, self._accelerations)
        )
