"""A released machine's run broken off: what the machine says it makes of it, from every moment on."""

from __future__ import annotations

import numpy as np

from excitation import ReleasedRun
from excitation.pieces import PieceTable, assemble
from twin.rehearsal import Rehearsal
from twin.rocking.compiled import FloatArray
from twin.whole_run.stops import Stop, between


def broken_off(rehearsal: Rehearsal, run: ReleasedRun, times: FloatArray) -> list[Stop] | None:
    """Return the base's motion if the run is broken off at each of `times`, s; None where nothing stops the machine.

    Before its release the machine is simply not released.
    """
    machine, settings = run.machine, rehearsal.settings
    if settings is None or not machine.stoppable:
        return None
    stops: list[Stop] = []
    for time in map(float, times):
        leg = next((phase.name for phase in reversed(run.phases) if phase.start <= time), "wait")
        if leg in ("wait", "rest"):
            stops.append(Stop(np.zeros((0, 7)), 0.0, 0.0, abs(run.displacement(time)), 0.0))
            continue
        x, v = run.displacement(time), run.velocity(time)
        spans = machine.broken_off(settings, leg, x, v, payload=rehearsal.scene.block.mass_kg or 0.0)
        rows = _rest_of(run, time) if spans is None else _later(assemble(spans), time)
        stops.append(_stop(rows, time, x, v))
    return stops


def _later(rows: FloatArray, time: float) -> FloatArray:
    moved = rows.copy()
    moved[:, :2] += time
    return moved


def _rest_of(run: ReleasedRun, time: float) -> FloatArray:
    """Return the run from `time` on: nothing changes it any more."""
    return between(run.pieces, time, run.shaking_end)


def _stop(rows: FloatArray, time: float, x: float, v: float) -> Stop:
    if not len(rows):
        return Stop(rows, 0.0, 0.0, abs(x), 0.0)
    own = rows.copy()
    own[:, :2] -= time
    own[0, 0] = 0.0
    own[1:, 0] = own[:-1, 1]
    table = PieceTable(own)
    t = np.linspace(0.0, float(own[-1, 1]), 200)
    # The table's pieces begin at rest: where the base is and how fast it goes is added.
    path = x + v * t + table.displacement(t)
    return Stop(
        rows,
        float(own[-1, 1]),
        float(np.sum(np.abs(np.diff(path)))),
        float(np.max(np.abs(path))),
        float(np.max(np.abs(table.acceleration(np.nextafter(t, 0.0))))),
    )
