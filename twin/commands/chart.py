"""`twin chart`: measure speed against accuracy here, and draw it."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path
from time import perf_counter

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from excitation import Record
from twin.chart.picture import check_picture, draw_chart
from twin.chart.survey import Chart, jobs, new_chart, number, table, write_table
from twin.chart.verdict import Verdict
from twin.errors import InputError
from twin.text_file import read_text


def run(options: argparse.Namespace) -> int:
    """Measure, draw, and write the table beside the picture; 1 where the default method was wrong, or on Ctrl-C."""
    check_picture(options.out)
    record = _record(options)
    started = perf_counter()
    chart = new_chart(quick=options.quick)
    points = options.out.with_suffix(".csv")
    # A folder that cannot be written is said now, not after minutes.
    write_table(chart, points)
    try:
        _work(chart, record, quiet=options.json)
    except KeyboardInterrupt:
        write_table(chart, points)
        print(f"twin chart: stopped; {points} holds what was measured", file=sys.stderr)
        return 1
    seconds = perf_counter() - started
    write_table(chart, points)
    draw_chart(chart, options.out, None if options.record is None else options.record.name)
    failed = [f for f in chart.findings if f.solver == chart.solvers[0].name and f.verdict is not Verdict.RIGHT]
    failed = [f for f in failed if f.verdict is not Verdict.NOT_APPLICABLE]
    if options.json:
        print(json.dumps(_data(chart, options.out, points, seconds), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(chart, options.out, points, seconds)))
    for finding in failed:
        print(f"twin chart: {finding.solver}, {finding.row.name}: {finding.detail}", file=sys.stderr)
    return 1 if failed else 0


def _work(chart: Chart, record: Record | None, *, quiet: bool) -> None:
    """Do every job, with a bar on the terminal's stderr."""
    console = Console(stderr=True)
    work = jobs(chart, record)
    columns = (TextColumn("{task.description:<44}"), BarColumn(), TimeElapsedColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=quiet or not console.is_terminal) as progress:
        bar = progress.add_task("", total=len(work))
        for name, job in work:
            progress.update(bar, description=name[:44])
            job()
            progress.advance(bar)


def _record(options: argparse.Namespace) -> Record | None:
    if not math.isfinite(options.scale):
        raise InputError(f"--scale is {options.scale}; it must be finite")
    if options.record is None:
        if options.scale != 1.0:
            raise InputError("--scale belongs to a record: give --record too")
        return None
    path: Path = options.record
    read = Record.from_csv if path.suffix.lower() == ".csv" else Record.from_at2
    text = read_text(path)
    try:
        return read(text, scale=options.scale)
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _lines(chart: Chart, picture: Path, points: Path, seconds: float) -> list[str]:
    lines = [f"picture    {picture}", f"points     {points}", f"measured   in {seconds:.0f} s on {chart.machine}"]
    for reference in chart.references:
        mine = [p for p in chart.points if p.case == reference.task.name and not p.refused]
        good = [p for p in mine if p.error <= max(1e-9, reference.floor)]
        checks = ", ".join(f"{name} within {value:.1g} rad" for name, value in reference.checks.items())
        if good:
            fastest = min(good, key=lambda p: p.time)
            lines.append(
                f"{reference.task.name:<10} {fastest.solver} in {1e6 * fastest.time:.3g} us is the fastest within "
                f"1e-9 rad; the reference is checked by {checks or 'no other code'}"
            )
    on_map = [p for p in chart.points if p.case == "map" and not p.refused and not p.wrong]
    if on_map:
        best = min(on_map, key=lambda p: p.time)
        lines.append(
            f"map        {best.solver} decides {1.0 / best.time:.3g} cells a second, none wrong of {best.cells}"
        )
    for solver in chart.solvers:
        found = [f.verdict for f in chart.findings if f.solver == solver.name]
        counts = {v: found.count(v) for v in (Verdict.RIGHT, Verdict.REFUSED, Verdict.WRONG)}
        told = ", ".join(f"{verdict.value} in {count}" for verdict, count in counts.items() if count)
        lines.append(f"failures   {solver.name}: {told}")
    if chart.absent:
        lines.append(f"absent     {', '.join(chart.absent)} (pip install 'shake-table-twin[peers]')")
    return lines


def _data(chart: Chart, picture: Path, points: Path, seconds: float) -> dict[str, object]:
    return {
        "picture": str(picture),
        "csv": str(points),
        "quick": chart.quick,
        "seconds": round(seconds, 1),
        "machine": chart.machine,
        "absent": chart.absent,
        "references": {
            r.task.name: {name: number(value) for name, value in r.checks.items()} for r in chart.references
        },
        "points": table(chart),
    }
