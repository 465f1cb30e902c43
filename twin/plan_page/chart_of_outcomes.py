"""The map around the run's point: outcomes, what the table can run, and where the run is on it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, SineWave
from twin.map.capacity import reachable
from twin.map.grid import CONSTANT, COSINE, DOUBLE_PULSE, SINE, Grid, make_grid
from twin.map.overturning import overturning_map
from twin.plan import Plan
from twin.plan_page.spread import Ellipse, Spread, ellipse_of
from twin.rehearsal import brake_of, initial_rotation
from twin.rocking.batch.codes import IMPOSSIBLE, OVERTURNED, ROCKED, STAYED, UNDECIDED
from twin.rocking.compiled import FloatArray
from twin.rocking.run import parameters
from twin.simulation import overturns

Kinds = NDArray[np.uint8]

CELLS = 120
"""Columns and rows of the map."""
REACH_COLUMNS = 40
"""At which the table's reach is looked for."""
STEADY, ROCKS, FALLS_LATER, FALLS_AT_ONCE, DOUBT, NONE = range(6)
NAMES = ("does not lift", "rocks and stands", "overturns after impacts", "overturns without impact", "undecided", "")
LEAST_FACTOR, GREATEST_FACTOR, FACTORS, RESTITUTIONS = 0.5, 1.5, 41, 9
"""Of a pulse that has no map: its amplitude times these factors, against the restitution."""
TITLES = {
    SINE: "What one sine does to this block",
    COSINE: "What one cosine does to this block",
    CONSTANT: "Constant pulses, unbraked",
    DOUBLE_PULSE: "Double pulses of rectangular blows",
}
MOST_PIECES = 150_000
"""Of all the pulses of such a map together; a longer record gets a coarser one."""


@dataclass(frozen=True, slots=True)
class OutcomeChart:
    """A map to draw.

    Attributes
    ----------
    title, column_label, row_label : str
    columns, rows : ndarray
        Values along the axes.
    kinds : ndarray of uint8, shape (rows, columns)
        Which of `NAMES`.
    reach : tuple of ndarray, or None
        Columns, and the largest row value the table makes there; None where that is not asked.
    point : Ellipse
        The run as it is given, with its uncertainty.
    asked : tuple of float, or None
        Column and row of the run as it was asked, where that is another one.
    """

    title: str
    column_label: str
    row_label: str
    columns: FloatArray
    rows: FloatArray
    kinds: Kinds
    reach: tuple[FloatArray, FloatArray] | None
    point: Ellipse
    asked: tuple[float, float] | None = None
    levels: Mapping[float, float] = field(default_factory=dict[float, float])
    """Probability of overturning -> factor of the run's row value at which it is reached."""


@dataclass(frozen=True, slots=True)
class _Axes:
    kind: str
    column: float
    row: float
    column_label: str
    row_label: str
    scale: float = 1.0
    """Of the columns as they are drawn, over those of the grid."""
    sense: float = 1.0
    """Of the pulse: a map has those of positive sense."""


def outcome_chart(plan: Plan, spread: Spread) -> OutcomeChart | None:
    """Return the map around the run's point; None where nothing shakes, or nothing can be made."""
    if plan.motion is None or plan.motion.pulse is None or plan.clipped is None:
        return None
    given = plan.motion.pulse
    axes = _axes_of(plan, given)
    if axes is None:
        return _by_restitution(plan, given, spread)
    scene, block = plan.scene, plan.block
    high = 1.9 * axes.row
    rows: FloatArray = np.linspace(min(0.05 * axes.row, 0.2), high, CELLS)
    columns: FloatArray = np.linspace(0.3, 1.9, CELLS) * axes.column
    named = {
        CONSTANT: ("amplitudes", "durations"),
        DOUBLE_PULSE: ("peak_velocities", "stop_gaps"),
    }.get(axes.kind, ("amplitudes", "frequencies"))
    arguments: dict[str, Any] = {named[0]: rows, named[1]: columns / axes.scale}
    if isinstance(given, DoublePulse):
        arguments |= {"rebound": given.rebound, "pulse_acceleration": given.pulse_acceleration}
    found = overturning_map(
        block,
        axes.kind,
        restitution=plan.restitution,
        initial_rotation=axes.sense * initial_rotation(scene),
        **arguments,
    )
    few: FloatArray = np.linspace(float(columns[0]), float(columns[-1]), REACH_COLUMNS)
    arguments[named[1]] = few / axes.scale
    tops = _reach(plan, make_grid(block, axes.kind, **arguments), axes.row)
    asked = _axes_of(plan, plan.clipped.asked)
    moved = asked is not None and plan.clipped.changed and abs(asked.row / axes.row - 1.0) > 1e-6
    return OutcomeChart(
        TITLES[axes.kind],
        axes.column_label,
        axes.row_label,
        columns,
        rows,
        _kinds(found.codes, found.impacts),
        (few, tops),
        ellipse_of(axes.kind, block.slenderness, axes.column, axes.row, spread),
        (asked.column, asked.row) if moved and asked is not None else None,
        _levels(plan),
    )


def _reach(plan: Plan, grid: Grid, row: float) -> FloatArray:
    """Return the largest row value the table makes at each column, nan where none.

    A machine may have a least amplitude: what it can run is looked for from the least row up, or from that of the run.
    """
    scene, capacity = plan.scene, plan.capacity
    found = np.full(grid.columns.size, np.nan)
    for low in (float(grid.rows[0]), 0.5 * row, row):
        missing = np.flatnonzero(np.isnan(found))
        if not missing.size:
            break
        part = replace(grid, rows=np.array([low, float(grid.rows[-1])]), columns=grid.columns[missing])
        found[missing] = reachable(
            part,
            capacity,
            brake=None if capacity.machine is not None else brake_of(scene, capacity),
            coast=scene.table.coast_s,
            payload=scene.block.mass_kg,
        )[1]
    return found


def _axes_of(plan: Plan, pulse: Pulse) -> _Axes | None:
    """Return which map a pulse is a point of, and where; None where it is on none."""
    lift, p = plan.block.uplift_acceleration, plan.block.frequency_parameter
    amplitude = "amplitude a0 / (g tan α)"
    if isinstance(pulse, (SineWave, CosineWave)) and pulse.cycles == 1.0:
        kind = SINE if isinstance(pulse, SineWave) else COSINE
        frequency, sense = 2.0 * math.pi * pulse.frequency / p, math.copysign(1.0, pulse.amplitude)
        return _Axes(kind, frequency, abs(pulse.amplitude) / lift, "frequency ω / p", amplitude, sense=sense)
    if isinstance(pulse, ConstantPulse):
        sense = math.copysign(1.0, pulse.amplitude)
        return _Axes(CONSTANT, p * pulse.duration, abs(pulse.amplitude) / lift, "duration p t", amplitude, p, sense)
    if isinstance(pulse, DoublePulse):
        return _Axes(
            DOUBLE_PULSE, 1e3 * pulse.stop_gap, abs(pulse.peak_velocity), "stop gap, mm", "peak velocity, m/s", 1e3
        )
    return None


def _kinds(codes: NDArray[np.uint8], impacts: NDArray[np.int32]) -> Kinds:
    conditions = [codes == STAYED, codes == ROCKED, codes == OVERTURNED, codes == UNDECIDED, codes == IMPOSSIBLE]
    fallen = np.where(impacts == 0, FALLS_AT_ONCE, FALLS_LATER)
    return np.select(conditions, [STEADY, ROCKS, fallen, DOUBT, NONE]).astype(np.uint8)


def _by_restitution(plan: Plan, given: Pulse, spread: Spread) -> OutcomeChart:
    """Return what other amplitudes of the run do to blocks of other restitution: for records and longer waves."""
    assert plan.motion is not None  # noqa: S101 - asked before
    pieces, tilt = plan.motion.shaking.pieces, initial_rotation(plan.scene)
    if tilt != 0.0:
        pieces = plan.motion.pieces
    share = min(1.0, math.sqrt(MOST_PIECES / (len(pieces) * FACTORS * RESTITUTIONS)))
    factors = np.linspace(LEAST_FACTOR, GREATEST_FACTOR, max(11, 1 + 2 * round(0.5 * share * FACTORS)))
    width = max(3.0 * spread.restitution, 0.02)
    low, high = max(plan.restitution - width, 0.0), min(plan.restitution + width, 1.0)
    etas = np.linspace(low, high, max(5, 1 + 2 * round(0.5 * share * RESTITUTIONS)))
    kinds: Kinds = np.zeros((factors.size, etas.size), dtype=np.uint8)
    lift = plan.block.uplift_acceleration
    for i, factor in enumerate(factors.tolist()):
        shaken = pieces.copy()
        shaken[:, 2:5] *= factor
        moves = factor * given.peak_acceleration > lift
        for j, eta in enumerate(etas.tolist()):
            falls = overturns(parameters(plan.block, eta), shaken, rotation=tilt)
            stands = ROCKS if moves or tilt else STEADY
            kinds[i, j] = DOUBT if falls is None else FALLS_LATER if falls else stands
    return OutcomeChart(
        f"What other amplitudes of this {given.kind} do",
        "restitution",
        "amplitude / that of the plan",
        etas,
        factors,
        kinds,
        None,
        ellipse_of("restitution", plan.block.slenderness, plan.restitution, 1.0, spread),
        levels=_levels(plan),
    )


def _levels(plan: Plan) -> dict[float, float]:
    known = {} if plan.uncertain is None else plan.uncertain.levels
    return {probability: factor for probability, factor in known.items() if factor is not None}
