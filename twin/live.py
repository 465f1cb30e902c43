"""The live cycle: set-point out, measurement in, prediction beside it, for as long as the motion lasts."""

from __future__ import annotations

import gc
import math
from collections.abc import Sequence

import numpy as np

from devices.clock import Clock
from devices.table import ShakeTable
from excitation import TableRun
from twin.cycle import Sink
from twin.live_loop import Loop, Watch
from twin.live_twin import LiveTwin
from twin.rocking.compiled import FloatArray
from twin.run_report import RunReport
from twin.scene_trips import TripsPart
from twin.trips import Trips


def perform(
    table: ShakeTable,
    motion: TableRun,
    twin: LiveTwin,
    sink: Sink,
    clock: Clock,
    *,
    trips: TripsPart | None = None,
    after: float = 0.0,
    targets: Sequence[float] | None = None,
    watch: Watch | None = None,
) -> RunReport:
    """Perform `motion` on an enabled `table`, predicting from what it measures; stop it safely if anything is wrong.

    Parameters
    ----------
    table : ShakeTable
        Enabled at the motion's start.
    motion : TableRun
    twin : LiveTwin
    sink : Sink
        Takes every cycle, gap and event.
    clock : Clock
    trips : TripsPart, optional
        Levels and actions of the trips; the defaults unless given.
    after : float
        Time the table is held still at the end, s, for the block to come to rest.
    targets : sequence of float, optional
        Set-points to send instead of the motion's own, m, one a cycle: a corrected command (`twin.tuned`). Phases and
        length stay the motion's.
    watch : Watch, optional
        What the run's owner has a say in: operator, recorder, release of the block, display.

    Returns
    -------
    RunReport

    Notes
    -----
    Cycle k begins k cycle times after the first. A cycle that could not begin within its own cycle time is missed, with
    all those after it that are already over: they are recorded as missed and never made up for.
    """
    own: list[float] = set_points(motion, after, table.cycle_time).tolist()
    sent = own if targets is None else targets
    if len(sent) != len(own):
        raise ValueError(f"{len(sent)} set-points are given for {len(own)} cycles")
    judged = Trips(trips or TripsPart(), twin.slenderness, table.capacity, table.cycle_time)
    loop = Loop(table, motion, sent, twin, sink, clock, judged, watch or Watch())
    gc.collect()
    gc.freeze()
    try:
        loop.run()
    finally:
        gc.unfreeze()
    return loop.report


def set_points(motion: TableRun, after: float, cycle_time: float) -> FloatArray:
    """Return where `motion`, and `after` s of standing still behind it, are at the end of each cycle, m."""
    last = math.ceil((motion.duration + after) / cycle_time)
    return motion.displacement(np.arange(1, last + 2, dtype=np.float64) * cycle_time)
