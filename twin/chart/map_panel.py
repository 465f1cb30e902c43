"""The map's panel: wrong cells against trajectories per second, each point with its name beside it."""

from __future__ import annotations

import math
import textwrap
from typing import Any

import numpy as np

from twin.chart.measure import Point
from twin.chart.style import LARGE, SMALL, style
from twin.chart.survey import Chart

LANE = 0.27
ZERO = -2.9
"""Height of the uppermost point with no wrong cell; the others are at log10 of the percentage."""


def draw_map(figure: Any, chart: Chart) -> None:
    """Draw the points of the map, and the map itself beside them."""
    if chart.truth is None:
        return
    axes = figure.add_axes((0.058, 0.375, 0.625, 0.25))
    small = figure.add_axes((0.735, 0.395, 0.253, 0.205))
    points = sorted((p for p in chart.points if p.case == "map" and not p.refused), key=lambda p: p.time)
    whole = chart.truth.codes.size
    right = [p for p in points if not p.wrong]
    wrong = [p for p in points if p.wrong]
    for lane, point in enumerate(right):
        _put(axes, point, whole, ZERO - LANE * lane, 0.0)
    for place, point in enumerate(wrong):
        _put(axes, point, whole, math.log10(100.0 * point.error), 6.0 * (-1) ** place)
    low = ZERO - LANE * len(right)
    axes.axhspan(low, ZERO + 0.45, color="#e6f2fa", zorder=0)
    axes.text(
        0.012,
        (ZERO + 0.2 - low) / (1.6 - low),
        "none wrong",
        transform=axes.transAxes,
        va="center",
        fontsize=LARGE,
        weight="bold",
        color="#0072B2",
    )
    axes.set_ylim(low, 1.6)
    ticks = [p for p in (-2, -1, 0, 1) if p > ZERO]
    axes.set_yticks([*ticks, ZERO], [*(f"{10.0**k:g} %" for k in ticks), "none"])
    axes.set_xscale("log")
    fastest = max((1.0 / p.time for p in points), default=1.0)
    slowest = min((1.0 / p.time for p in points), default=1.0)
    axes.set_xlim(0.4 * slowest, 100.0 * fastest)
    axes.tick_params(labelsize=SMALL)
    axes.grid(alpha=0.3, axis="x")
    axes.set_xlabel(
        "trajectories decided per second, one by one on one processor (overturning_map: on all)   (right: better)",
        fontsize=LARGE,
    )
    axes.set_ylabel("wrong cells   (down: better)", fontsize=LARGE)
    side = chart.truth.axis.size
    axes.set_title(
        f"d  Overturning map of a single sine, {side} x {side} cells",
        fontsize=LARGE + 1,
        loc="left",
        weight="bold",
    )
    _draw_truth(small, chart)


def _put(axes: Any, point: Point, whole: int, height: float, shift: float) -> None:
    look = style(point.solver) | {"ls": ""}
    if point.solver.startswith("overturning_map"):
        look |= {"markersize": 13.0}
    axes.plot([1.0 / point.time], [height], **look)
    axes.annotate(
        _label(point, whole),
        (1.0 / point.time, height),
        xytext=(9, shift),
        textcoords="offset points",
        va="center",
        fontsize=SMALL - 0.5,
        weight="bold" if point.solver.startswith("overturning_map") else "normal",
    )


def _label(point: Point, whole: int) -> str:
    name = point.solver.removeprefix("model ") + (" model" if point.solver.startswith("model ") else "")
    if point.setting is not None:
        name += f", {1e3 * point.setting:g} ms" if point.knob == "step" else f", {point.setting:g}"
    said = [f"{_rate(1.0 / point.time)}/s"]
    if point.wrong:
        said.append(f"{point.wrong} of {point.cells} wrong")
    if point.undecided:
        said.append(f"{point.undecided} called undecided")
    if not point.wrong and point.cells < whole:
        said.append(f"on {point.cells} cells")
    return f"{name}: {', '.join(said)}"


def _rate(value: float) -> str:
    if value >= 1e6:
        return f"{value / 1e6:.2g} million"
    if value >= 1e4:
        return f"{round(value / 1e3):d} 000"
    return f"{float(f'{value:.2g}'):g}"


def _draw_truth(axes: Any, chart: Chart) -> None:
    truth = chart.truth
    if truth is None:
        return
    from matplotlib.colors import ListedColormap

    colours: Any = ListedColormap
    falls = int(np.sum(truth.codes == 1))
    undecided = int(np.sum(truth.codes == 2))
    half = 0.5 * float(truth.axis[1] - truth.axis[0])
    extent = (float(truth.axis[0]) - half, float(truth.axis[-1]) + half) * 2
    axes.imshow(
        truth.codes,
        origin="lower",
        extent=extent,
        cmap=colours(["#f2f2f2", "#D55E00", "black"]),
        vmin=0,
        vmax=2,
        aspect="equal",
        interpolation="nearest",
    )
    axes.set_xlabel("W = omega / p", fontsize=SMALL)
    axes.set_ylabel("A = a0 / (g tan alpha)", fontsize=SMALL)
    axes.tick_params(labelsize=SMALL)
    said = f"The truth (taylor): {falls} of {truth.codes.size} cells overturn (dark), {undecided} undecided."
    axes.set_title("\n".join(textwrap.wrap(said, 44)), fontsize=SMALL, loc="left")
