"""The map around the run's point: outcomes in greys and hatches, the table's reach, the point and its spread."""

from __future__ import annotations

from typing import Any

import numpy as np

from twin.plan_page.chart_of_outcomes import (
    DOUBT,
    FALLS_AT_ONCE,
    FALLS_LATER,
    NAMES,
    NONE,
    ROCKS,
    STEADY,
    OutcomeChart,
)
from twin.plan_page.drawing import DARK, INK, SMALL, TINY
from twin.rocking.compiled import FloatArray

FACES = {STEADY: "1.0", ROCKS: "0.93", FALLS_LATER: "0.72", FALLS_AT_ONCE: "0.45", DOUBT: "0.0", NONE: "1.0"}
HATCHES = {FALLS_LATER: "....", NONE: "xx"}
BEHIND: dict[str, Any] = {"facecolor": "white", "edgecolor": "none", "pad": 0.3, "alpha": 0.8}
VISIBLE = 0.02
"""Share of the map from which on a standard deviation can be seen on it; less is drawn enlarged as well."""
WINDOW = 3.0
"""Standard deviations to either side of the point in the enlarged window."""


def draw_chart(axes: Any, chart: OutcomeChart, table: str) -> None:
    """Draw the map with the table's reach and the run's point; its key is drawn by `chart_key`."""
    axes.pcolormesh(
        chart.columns,
        chart.rows,
        chart.kinds,
        cmap=_shades(),
        vmin=-0.5,
        vmax=len(NAMES) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    for kind, hatch in HATCHES.items():
        inside = (chart.kinds == kind).astype(float)
        if inside.any():
            axes.contourf(
                chart.columns, chart.rows, inside, levels=[0.5, 1.5], colors="none", hatches=[hatch], alpha=0.0
            )
    fallen = np.isin(chart.kinds, (FALLS_LATER, FALLS_AT_ONCE)).astype(float)
    if 0.0 < fallen.mean() < 1.0:
        axes.contour(chart.columns, chart.rows, fallen, levels=[0.5], colors=INK, linewidths=0.6)
    axes.set_xlim(chart.columns[0], chart.columns[-1])
    axes.set_ylim(chart.rows[0], chart.rows[-1])
    if chart.reach is not None:
        _reach(axes, *chart.reach, chart.rows)
    _point(axes, chart)
    axes.set_xlabel(chart.column_label, fontsize=SMALL, labelpad=1.0)
    axes.set_ylabel(chart.row_label, fontsize=SMALL, labelpad=1.0)
    axes.tick_params(labelsize=SMALL, length=2.0, pad=1.5)
    handles = chart_key(chart, table)
    axes.legend(
        handles=handles,
        loc="upper left",
        bbox_to_anchor=(-0.02, -0.135),
        ncols=2,
        fontsize=TINY,
        frameon=False,
        borderpad=0.0,
        handlelength=2.0,
        columnspacing=1.0,
        labelspacing=0.35,
    )


def _reach(axes: Any, at: FloatArray, tops: FloatArray, rows: FloatArray) -> None:
    low, high = float(rows[0]), float(rows[-1])
    edge = np.clip(np.nan_to_num(tops, nan=low, posinf=high), low, high)
    axes.fill_between(at, edge, high, facecolor="none", edgecolor=DARK, hatch="\\\\\\", lw=0.0)
    axes.plot(at, edge, color="white", lw=2.6)
    axes.plot(at, edge, color=INK, lw=1.5)


def _point(axes: Any, chart: OutcomeChart) -> None:
    point = chart.point
    across = float(chart.columns[-1] - chart.columns[0]), float(chart.rows[-1] - chart.rows[0])
    widest = max(deviation / span for deviation, span in zip(point.deviations, across, strict=True))
    if widest >= VISIBLE:
        _ellipses(axes, chart)
    for probability, factor in chart.levels.items():
        if chart.rows[0] < factor * point.row < chart.rows[-1]:
            x = point.column + np.array([-0.06, 0.06]) * across[0]
            axes.plot(x, [factor * point.row] * 2, color="white", lw=2.2)
            axes.plot(x, [factor * point.row] * 2, color=INK, lw=1.1)
            said, side = f" {probability:.0%} fall", "bottom" if factor == max(chart.levels.values()) else "top"
            axes.text(x[1], factor * point.row, said, fontsize=TINY - 0.4, va=side, ha="left", bbox=BEHIND)
    if chart.asked is not None:
        axes.plot(*chart.asked, marker="x", ms=6.0, mew=1.4, color=INK, ls="none")
    axes.plot(point.column, point.row, marker="o", ms=5.0, mfc="white", mec=INK, mew=1.2, ls="none")
    if 0.0 < widest < VISIBLE:
        _enlarged(axes, chart)


def _ellipses(axes: Any, chart: OutcomeChart) -> None:
    for sigmas, style in ((1.0, "-"), (2.0, "--")):
        x, y = chart.point.outline(sigmas)
        axes.plot(x, y, color="white", lw=2.2)
        axes.plot(x, y, color=INK, lw=0.9, ls=style)


def _enlarged(axes: Any, chart: OutcomeChart) -> None:
    """Draw the ellipses where they can be seen: a window of its own, in the corner farthest from the run's point."""
    from matplotlib.patches import Rectangle

    point = chart.point
    halves = [
        max(WINDOW * d, 0.01 * value) for d, value in zip(point.deviations, (point.column, point.row), strict=True)
    ]
    right = point.column < 0.5 * float(chart.columns[0] + chart.columns[-1])
    place: Any = (0.665 if right else 0.02, 0.02, 0.315, 0.3)
    window = axes.inset_axes(place)
    window.pcolormesh(
        chart.columns,
        chart.rows,
        chart.kinds,
        cmap=_shades(),
        vmin=-0.5,
        vmax=len(NAMES) - 0.5,
        shading="nearest",
        rasterized=True,
    )
    window.set_xlim(point.column - halves[0], point.column + halves[0])
    window.set_ylim(point.row - halves[1], point.row + halves[1])
    window.set_xticks([])
    window.set_yticks([])
    _ellipses(window, chart)
    window.plot(point.column, point.row, marker="+", ms=5.0, mew=0.8, color=INK, ls="none")
    rectangle: Any = Rectangle
    window.add_patch(
        rectangle((0.0, 0.0), 1.0, 1.0, fill=False, ec=INK, lw=0.9, transform=window.transAxes, clip_on=False)
    )
    percent = " x ".join(
        f"±{100.0 * half / value:.2g} %" for half, value in zip(halves, (point.column, point.row), strict=True)
    )
    window.text(
        0.5,
        1.03,
        percent,
        ha="center",
        va="bottom",
        fontsize=TINY - 0.4,
        transform=window.transAxes,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.6},
    )


def _shades() -> Any:
    from matplotlib.colors import ListedColormap

    return ListedColormap([FACES[kind] for kind in range(len(NAMES))])


def chart_key(chart: OutcomeChart, table: str) -> list[Any]:
    """Return what a legend of the map says."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    line: Any = Line2D
    patch: Any = Patch
    handles = [
        patch(facecolor=FACES[kind], edgecolor="0.3", lw=0.4, hatch=HATCHES.get(kind, ""), label=NAMES[kind])
        for kind in range(len(NAMES))
        if NAMES[kind] and bool(np.any(chart.kinds == kind))
    ]
    if chart.reach is not None:
        handles.append(patch(facecolor="white", edgecolor=DARK, hatch="\\\\\\", lw=0.0, label=f"beyond {table}"))
        handles.append(line([], [], color=INK, lw=1.5, label="most it can run"))
    handles.append(line([], [], marker="o", mfc="white", mec=INK, ls="none", ms=5, label="this run"))
    if max(chart.point.deviations) > 0.0:
        handles.append(line([], [], color=INK, lw=0.9, label="1 standard deviation"))
        handles.append(line([], [], color=INK, lw=0.9, ls="--", label="2 standard deviations"))
    if chart.asked is not None:
        handles.append(line([], [], marker="x", color=INK, mew=1.4, ls="none", ms=5, label="as asked"))
    return handles
