"""The chart as a picture: error against time, wrong cells against speed, and where each method fails."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any

from twin.chart.map_panel import draw_map
from twin.chart.measure import Point, Reference
from twin.chart.style import LARGE, SMALL, style
from twin.chart.survey import Chart
from twin.chart.table_panel import draw_table
from twin.errors import InputError

TITLES = {
    "free": "Free rocking from 0.15 rad to rest",
    "sine": "One full sine, W = 3, A = 3 (overturns)",
    "record": "Earthquake record",
}
LEFT, RIGHT, GAP = 0.058, 0.988, 0.022
TOP_ERROR = 3.0
"""rad: errors above this are drawn here."""


def check_picture(path: Path) -> None:
    """Raise `InputError` where the ending of `path` is no picture's."""
    if path.suffix.lower() not in (".png", ".svg", ".pdf"):
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")


def draw_chart(chart: Chart, path: Path, record_name: str | None) -> None:
    """Write the picture; the ending of `path` decides the format; raises `InputError` where it cannot be written."""
    from matplotlib.figure import Figure

    check_picture(path)
    figure: Any = Figure(figsize=(16.0, 19.0))
    _head(figure, chart)
    many = len(chart.references)
    width = (RIGHT - LEFT - GAP * (many - 1)) / many
    for number, reference in enumerate(chart.references):
        axes = figure.add_axes((LEFT + number * (width + GAP), 0.735, width, 0.185))
        points = [p for p in chart.points if p.case == reference.task.name]
        title = TITLES[reference.task.name]
        if reference.task.name == "record" and record_name is not None:
            title = f"Earthquake {record_name if len(record_name) < 34 else record_name[:32] + '…'}"
        _trajectory(axes, points, reference, f"{'abc'[number]}  {title}")
        if number:
            axes.tick_params(labelleft=False)
        else:
            axes.set_ylabel("largest error of rotation [rad]  (down: better)", fontsize=LARGE)
    _legend(figure, chart)
    draw_map(figure, chart)
    draw_table(figure, chart)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=100)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _head(figure: Any, chart: Chart) -> None:
    title = "Speed against accuracy: one rocking block, every method"
    figure.text(0.012, 0.991, title, fontsize=19, va="top", weight="bold")
    absent = f" Not installed, so not drawn: {', '.join(chart.absent)}." if chart.absent else ""
    note = (
        f"Measured on this machine: {chart.machine}. Time of one call from Python: the best of up to 200 runs, garbage "
        "collector off, after one run not counted (compilation); rk4, newmark and dop853 solve twice to state their "
        "error. Block B6L, 0.06 m x 0.27 m, nonlinear equation, "
        f"Housner's restitution.{' A quick chart: fewer points, a coarser map.' if chart.quick else ''}{absent}"
    )
    figure.text(0.012, 0.973, "\n".join(textwrap.wrap(note, 178)), fontsize=SMALL, va="top", color="0.25")


def _trajectory(axes: Any, points: list[Point], reference: Reference, title: str) -> None:
    floor = reference.floor
    for solver in dict.fromkeys(p.solver for p in points):
        mine = [p for p in points if p.solver == solver and not p.refused]
        x = [p.time for p in mine]
        y = [min(max(p.error, floor), TOP_ERROR) for p in mine]
        axes.plot(x, y, **style(solver))
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xlim(8e-6, 2.5)
    axes.set_ylim(3e-17, 2.0 * TOP_ERROR)
    axes.axhspan(1e-18, floor, color="0.9", zorder=0)
    axes.set_xticks([1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0], ["10 µs", "100 µs", "1 ms", "10 ms", "0.1 s", "1 s"])
    axes.set_yticks([10.0**k for k in range(-16, 1, 2)])
    axes.minorticks_off()
    axes.tick_params(labelsize=SMALL)
    axes.grid(alpha=0.3)
    axes.set_xlabel("time of one trajectory   (left: better)", fontsize=LARGE)
    checked = "; ".join(f"{name} within {value:.0e} rad" for name, value in sorted(reference.checks.items()))
    said = f"reference: taylor at 1e-15{'; checked by ' if checked else ''}{checked}"
    wrapped = "\n".join(textwrap.wrap(said, 62))
    axes.text(0.0, -0.19, wrapped, transform=axes.transAxes, va="top", fontsize=SMALL - 1, color="0.25")
    axes.text(
        0.985,
        0.012,
        "below what codes agree to",
        transform=axes.transAxes,
        ha="right",
        fontsize=SMALL - 1,
        color="0.35",
    )
    axes.set_title(title, fontsize=LARGE + 1, loc="left", weight="bold")


def _legend(figure: Any, chart: Chart) -> None:
    from matplotlib.lines import Line2D

    made: Any = Line2D
    handles = [made([], [], **style(s.name), label=_named(s.name, s.knob)) for s in chart.solvers]
    figure.legend(
        handles=handles,
        loc="center",
        bbox_to_anchor=(0.5, 0.6595),
        ncols=math.ceil(len(handles) / 2),
        fontsize=SMALL + 0.5,
        columnspacing=1.6,
        frameon=False,
        title="in brackets: what is varied along a line",
        title_fontsize=SMALL,
    )


def _named(name: str, knob: str) -> str:
    if name.startswith("model "):
        return f"{name.removeprefix('model ')} model"
    return f"{name} ({knob})" if knob else name
