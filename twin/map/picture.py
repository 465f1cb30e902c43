"""A map as a picture: the outcomes in colour, what the table can run, and in dimensionless and SI units."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from excitation import Capacity
from twin.errors import InputError
from twin.map.blocks import Question
from twin.map.capacity import reachable
from twin.map.grid import CONSTANT, COSINE, DOUBLE_PULSE, LASTING_SINE, SINE, Grid
from twin.map.store import MapStore
from twin.rocking.batch.codes import IMPOSSIBLE, OVERTURNED, ROCKED, STAYED, UNDECIDED
from twin.rocking.compiled import FloatArray

Picture = NDArray[np.uint8]

MOST_PIXELS = 1200
"""A larger map is drawn from every second, third, ... of its rows and columns."""

COLOURS = {
    "stayed": "#f4f1e8",
    "rocked": "#bcd4e6",
    "overturned without impact": "#8c1c13",
    "overturned after 1 impact": "#d7552f",
    "overturned after 2 impacts": "#eb9c4d",
    "overturned after 3 or more": "#f6d186",
    "undecided": "#000000",
    "no such pulse": "#ffffff",
}
"""What is told apart, in the order of its numbers in the picture."""


def draw_map(
    store: MapStore,
    path: Path,
    capacity: Capacity | None,
    *,
    title: str = "",
    brake: float | None = None,
    coast: float = 0.0,
    payload: float | None = None,
) -> None:
    """Write the picture of a finished map; the ending of `path` decides the format.

    Parameters
    ----------
    store : MapStore
    path : Path
    capacity : Capacity or None
        The table whose limits are drawn on it, and `brake`, `coast`, `payload` as for `excitation.clip`.
    title : str
        Drawn above.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure: Any = Figure(figsize=(9.5, 6.2), layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"--picture {path}: a picture ends in .png, .svg or .pdf")
    grid = store.question.grid
    columns, rows, kinds = sampled(store)
    axes = figure.add_subplot()
    mesh = {"cmap": ListedColormap(list(COLOURS.values())), "vmin": -0.5, "vmax": len(COLOURS) - 0.5}
    axes.pcolormesh(columns, rows, kinds, shading="nearest", rasterized=True, **mesh)
    handles = [
        Patch(facecolor=colour, edgecolor="0.4", label=f"{name} ({_share(kinds, k)})")
        for k, (name, colour) in enumerate(COLOURS.items())
        if bool(np.any(kinds == k))
    ]
    if capacity is not None and len(rows) > 1:
        axes.set_ylim(*axes.get_ylim())
        at, tops = reachable(grid, capacity, brake=brake, coast=coast, payload=payload)
        handles += _draw_reach(axes, at, tops, float(axes.get_ylim()[0]), float(axes.get_ylim()[1]), capacity.name)
    _label(axes, grid)
    figure.legend(handles=handles, loc="outside right upper", fontsize=8, frameon=False)
    axes.set_title("\n".join(filter(None, (title, caption(store.question)))), fontsize=10)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise InputError(f"--picture {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def sampled(store: MapStore) -> tuple[FloatArray, FloatArray, Picture]:
    """Return columns, rows and indices into `COLOURS` of a map thinned to what a picture shows, read row by row."""
    grid = store.question.grid
    width = len(grid.columns)
    every = (-(-len(grid.rows) // MOST_PIXELS), -(-width // MOST_PIXELS))
    rows = range(0, len(grid.rows), every[0])
    picture: Picture = np.zeros((len(rows), len(range(0, width, every[1]))), dtype=np.uint8)
    for line, row in enumerate(rows):
        codes = store.read("outcome", row * width, (row + 1) * width)[:: every[1]]
        impacts = np.asarray(store.read("impacts", row * width, (row + 1) * width)[:: every[1]], dtype=np.int32)
        fallen = 2 + np.minimum(impacts, 3)
        conditions = [codes == STAYED, codes == ROCKED, codes == OVERTURNED, codes == UNDECIDED, codes == IMPOSSIBLE]
        picture[line] = np.select(conditions, [0, 1, fallen, 6, 7])
    return grid.columns[:: every[1]], grid.rows[:: every[0]], picture


def caption(question: Question) -> str:
    """Return in a line what the map is of."""
    grid = question.grid
    words = {SINE: "one sine", COSINE: "one cosine", LASTING_SINE: f"sine lasting {grid.duration or 0.0:g} s"}
    parts = [
        f"{words.get(grid.kind, grid.kind)} on {1e3 * grid.block.width:g} x {1e3 * grid.block.height:g} mm",
        f"{question.model or 'nonlinear'}" + (f" by {question.method}" if question.method else ""),
    ]
    if question.initial_rotation:
        parts.append(f"tilted by {math.degrees(question.initial_rotation):g} deg")
    return ", ".join(parts)


def _share(kinds: Picture, k: int) -> str:
    return f"{100.0 * np.count_nonzero(kinds == k) / kinds.size:.3g} %"


def _draw_reach(axes: Any, at: FloatArray, tops: FloatArray, bottom: float, top: float, name: str) -> list[Any]:
    """Hatch what the table cannot run; return the legend's entries."""
    edge = np.clip(np.nan_to_num(tops, nan=bottom, posinf=top), bottom, top)
    if len(at) == 1:
        left, right = axes.get_xlim()
        at, edge = np.linspace(float(left), float(right), 2), np.repeat(edge, 2)
    limits = axes.get_xlim()
    beyond = axes.fill_between(
        at,
        edge,
        top,
        facecolor="none",
        edgecolor="black",
        hatch="///",
        linewidth=0.0,
        alpha=0.45,
        label=f"beyond {name}",
    )
    (line,) = axes.plot(at, edge, color="black", lw=1.6, label=f"most that {name} can run")
    axes.set_xlim(*limits)
    return [line, beyond]


def _label(axes: Any, grid: Grid) -> None:
    """Name the axes, in SI units on the far sides."""
    if grid.kind == DOUBLE_PULSE:
        axes.set_xlabel("stop gap [m]")
        axes.set_ylabel("peak velocity [m/s]")
        return
    lift, p = grid.block.uplift_acceleration, grid.block.frequency_parameter
    axes.set_ylabel("amplitude a0 / (g tan alpha)")
    right = axes.secondary_yaxis("right", functions=(_times(lift), _times(1.0 / lift)))
    right.set_ylabel("a0 [m/s²]")
    if grid.kind == CONSTANT:
        axes.set_xlabel("duration [s]")
        top = axes.secondary_xaxis("top", functions=(_times(p), _times(1.0 / p)))
        top.set_xlabel("duration p t")
        return
    to_hertz = p / (2.0 * math.pi)
    axes.set_xlabel("frequency omega / p")
    top = axes.secondary_xaxis("top", functions=(_times(to_hertz), _times(1.0 / to_hertz)))
    top.set_xlabel("frequency [Hz]")


def _times(factor: float) -> Callable[[FloatArray], FloatArray]:
    return lambda values: values * factor
