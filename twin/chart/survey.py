"""`twin chart`: speed against accuracy, measured here and now."""

from __future__ import annotations

import csv
import math
import os
import platform
from collections.abc import Callable
from dataclasses import dataclass, field
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from excitation import Record
from twin.chart.failures import Row, rows
from twin.chart.measure import (
    MapTruth,
    Point,
    Reference,
    batch_points,
    make_reference,
    map_points,
    map_truth,
    trajectory_points,
    verdict_point,
)
from twin.chart.peers import peer_solvers
from twin.chart.solvers import Solver, own_solvers
from twin.chart.task import Task, sine
from twin.chart.verdict import Finding, Verdict, examine
from twin.errors import InputError

PACKAGES = {"heyoka": "heyoka", "SciPy events": "scipy", "CVODE": "scikit-sundae"}
COLUMNS: tuple[str, ...] = (
    *("panel", "method", "knob", "setting", "case", "error", "error_unit", "impact_time_error_s", "time_s"),
    *("per_second", "repeats", "cells", "wrong", "undecided", "verdict", "reason"),
)


@dataclass(slots=True)
class Chart:
    """What was measured.

    Attributes
    ----------
    quick : bool
    solvers : list of Solver
        In the order of the columns.
    absent : list of str
        Peers that are not installed.
    references : list of Reference
        One for each trajectory.
    truth : MapTruth or None
    points : list of Point
    findings : list of Finding
    """

    quick: bool
    solvers: list[Solver]
    absent: list[str]
    references: list[Reference] = field(default_factory=list[Reference])
    truth: MapTruth | None = None
    points: list[Point] = field(default_factory=list[Point])
    findings: list[Finding] = field(default_factory=list[Finding])

    def finding(self, row: Row, solver: Solver) -> Finding:
        """Return what became of `solver` in a row."""
        return next(f for f in self.findings if f.row.number == row.number and f.solver == solver.name)

    @property
    def machine(self) -> str:
        """The machine and the versions, in one line."""
        names = ["numba", *(PACKAGES[s.name] for s in self.solvers if s.peer)]
        packages = ", ".join(f"{name} {_version(name)}" for name in names)
        processors = os.cpu_count() or 1
        return f"{processors} processors, {platform.machine()}, Python {platform.python_version()}, {packages}"


Job = tuple[str, Callable[[], None]]
"""What it says on the progress bar, and the work."""


def new_chart(*, quick: bool) -> Chart:
    """Return an empty chart with every solver that is installed."""
    peers, absent = peer_solvers()
    return Chart(quick, own_solvers() + peers, absent)


def jobs(chart: Chart, record: Record | None) -> list[Job]:
    """Return the work that fills a chart, in order; each job may be seen as one tick of a progress bar."""
    quick, solvers = chart.quick, chart.solvers
    default = solvers[0]
    cases = [Task("free", rotation=0.15), Task("sine", sine(3.0, 3.0))]
    if record is not None:
        cases.append(Task("record", record))
    checkers = [s for s in solvers if s.name in ("dop853", "heyoka")]
    budget = 0.02 if quick else 0.4
    work: list[Job] = []
    for task in cases:

        def refer(task: Task = task) -> None:
            chart.references.append(make_reference(task, default, checkers))

        work.append((f"reference of {task.name}", refer))
        for solver in solvers:

            def measure(task: Task = task, solver: Solver = solver) -> None:
                reference = next(r for r in chart.references if r.task is task)
                chart.points += trajectory_points(solver, reference, budget, quick=quick)

            work.append((f"{task.name}: {solver.name}", measure))
    work += _map_jobs(chart, default)
    for row in rows(quick=quick):
        for solver in solvers:

            def put_through(row: Row = row, solver: Solver = solver) -> None:
                chart.findings.append(examine(solver, row))

            work.append((f"{row.number} {row.name}: {solver.name}", put_through))
    return work


def _map_jobs(chart: Chart, default: Solver) -> list[Job]:
    quick = chart.quick
    side, budget = (20, 0.2) if quick else (100, 12.0)

    def draw() -> None:
        chart.truth = map_truth(default, side)

    def engine() -> None:
        if chart.truth is not None:
            chart.points += [*batch_points(chart.truth, 0.2 if quick else 2.0), verdict_point(chart.truth)]

    work: list[Job] = [("map: the truth", draw), ("map: overturning_map", engine)]
    for solver in chart.solvers:
        if solver.name == "closed-form":
            continue  # no closed form on a moving base

        def measure(solver: Solver = solver) -> None:
            if chart.truth is not None:
                chart.points += map_points(solver, chart.truth, budget, quick=quick)

        work.append((f"map: {solver.name}", measure))
    return work


def table(chart: Chart) -> list[dict[str, object]]:
    """Return every point and every finding, one dictionary of `COLUMNS` each; None where there is no value."""
    lines: list[dict[str, object]] = []
    for point in chart.points:
        on_map = point.case == "map"
        refused = bool(point.refused)
        line = _empty_line()
        line |= {
            "panel": "map" if on_map else "trajectory",
            "method": point.solver,
            "knob": point.knob or None,
            "setting": point.setting,
            "case": "single sine map" if on_map else point.case,
            "error": number(point.error),
            "error_unit": "share of cells" if on_map else "rad",
            "impact_time_error_s": number(point.impact_error),
            "time_s": number(point.time),
            "per_second": None if refused else number(1.0 / point.time),
            "repeats": point.repeats or None,
            "verdict": Verdict.REFUSED.value if refused else None,
            "reason": point.refused or None,
        }
        if on_map and not refused:
            line |= {"cells": point.cells, "wrong": point.wrong, "undecided": point.undecided}
        lines.append(line)
    for finding in chart.findings:
        line = _empty_line()
        line |= {
            "panel": "failures",
            "method": finding.solver,
            "case": f"{finding.row.number} {finding.row.name}",
            "wrong": finding.wrong,
            "cells": finding.right + finding.wrong + finding.refused,
            "verdict": finding.verdict.value,
            "reason": finding.detail or None,
        }
        lines.append(line)
    return lines


def _empty_line() -> dict[str, object]:
    empty: dict[str, object] = {}
    return empty | dict.fromkeys(COLUMNS)


def write_table(chart: Chart, path: Path) -> None:
    """Write `table` as CSV; raises `InputError` where the file cannot be written."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("w", encoding="utf-8", newline="") as file:
            writer = csv.DictWriter(file, COLUMNS)
            writer.writeheader()
            writer.writerows(table(chart))
    except OSError as error:
        raise InputError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def number(value: float) -> float | None:
    """Return a finite number itself, None otherwise."""
    return value if math.isfinite(value) else None


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return ""
