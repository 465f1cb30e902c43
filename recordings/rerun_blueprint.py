"""How the Rerun window is laid out for a run: 3D, texts and the block's state on the left, signals on the right."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import rerun.blueprint as rrb
from rerun.blueprint.encodings import TimelineColumn

if TYPE_CHECKING:
    from recordings.geometry import Geometry
    from recordings.run import Cycles

TIMELINE = "time"

MEASURED = (70, 140, 255)
PREDICTED = (255, 150, 40)
ESTIMATED = (90, 200, 120)
TARGET = (150, 150, 150)
LATENESS = (200, 120, 220)
STOPPED = (230, 90, 90)
BACKGROUND = (24, 26, 32)
FUTURES_SPAN = 1.5
"""How far ahead the futures are drawn, s."""
PHASE_REACH = (-1.4, 1.4)
"""What the phase plane shows, in alpha and in p alpha."""


class Line(NamedTuple):
    """A line of a plot: column of Cycles, factor to the unit in the view's name, label, colour and width in points."""

    column: str
    factor: float
    label: str
    colour: tuple[int, int, int]
    width: float


# Lines are drawn in the order of their paths: the wide one first, so that the other stays visible where they agree.
CYCLE_LINES = {
    "rotation/measured": Line("rotation", 1.0, "measured", MEASURED, 3.0),
    "rotation/predicted": Line("predicted_rotation", 1.0, "predicted", PREDICTED, 1.5),
    "acceleration/measured": Line("acceleration", 1.0, "measured", MEASURED, 1.5),
    "position/commanded": Line("target_position", 1e3, "set-point", TARGET, 3.5),
    "position/measured": Line("position", 1e3, "measured", MEASURED, 1.5),
    "lateness/cycle": Line("lateness", 1e3, "lateness", LATENESS, 1.5),
}
OPTIONAL_LINES = {
    "/estimate": {"rotation/estimated": Line("rotation_rad", 1.0, "estimated", ESTIMATED, 1.5)},
    "/forecast": {
        "forecast/continue": Line("continue_probability", 1.0, "if it goes on", PREDICTED, 2.0),
        "forecast/stop": Line("stop_probability", 1.0, "if stopped now", STOPPED, 1.5),
    },
}
"""Lines of topics that not every recording has: topic -> entity -> field of the message."""
VIEWS = {
    "rotation": ("Rotation of the block [rad]", 4.0),
    "forecast": ("Probability of overturning, as forecast [-]", 1.6),
    "acceleration": ("Base acceleration [m/s²]", 3.0),
    "position": ("Base position [mm]", 2.4),
    "lateness": ("Lateness of the cycle [ms]", 1.6),
}
"""Plots from the top: name, and share of the height."""


@dataclass(frozen=True)
class Shown:
    """What a window has: topics with lines of their own, a map, its size in cells and its name, the panels around."""

    topics: frozenset[str] = frozenset()
    map_size: tuple[int, int] | None = None
    map_name: str = ""
    panels: bool = True


def blueprint(geometry: Geometry | None, cycles: Cycles | None = None, shown: Shown | None = None) -> rrb.Blueprint:
    """Lay the window out.

    Where `cycles` are known already, the plots begin at their range; otherwise Rerun finds it as they come.
    """
    shown = shown or Shown()
    reach = max(geometry.height, 2.0 * geometry.width) if geometry else 0.3
    scene = rrb.Spatial3DView(
        origin="/world",
        name="Table and block (blue: measured, orange: predicted)",
        background=BACKGROUND,
        eye_controls=rrb.EyeControls3D(
            position=(0.4 * reach, -1.9 * reach, 0.9 * reach), look_target=(0.0, 0.0, 0.4 * reach), eye_up=(0, 0, 1)
        ),
        line_grid=rrb.LineGrid3D(visible=False),
    )
    planes: list[rrb.View] = []
    if geometry is not None:
        planes.append(_plane("/phase", "Phase plane (alpha, p alpha)", PHASE_REACH, PHASE_REACH))
    if geometry is not None and "/forecast" in shown.topics:
        name = "Futures: rotation in alpha, the next 1.5 s"
        planes.append(_plane("/futures", name, (-0.05, 1.05 * FUTURES_SPAN), (-1.8, 1.8)))
    if shown.map_size is not None:
        rows, columns = shown.map_size
        planes.append(_plane("/map", shown.map_name, (-0.16 * columns, 1.06 * columns), (-0.06 * rows, 1.16 * rows)))
    left: list[rrb.Container | rrb.View] = [rrb.Horizontal(*planes)] if planes else []
    middle = rrb.Vertical(scene, *left, _texts(shown), row_shares=[4, 4, 3] if planes else [3, 2])
    parts: list[rrb.TimePanel | rrb.TopPanel] = [
        rrb.TimePanel(timeline=TIMELINE, state="collapsed" if shown.panels else "hidden")
    ]
    if not shown.panels:
        parts.append(rrb.TopPanel(state="hidden"))
    return rrb.Blueprint(rrb.Horizontal(middle, _plots(cycles, shown)), *parts, collapse_panels=True)


def _texts(shown: Shown) -> rrb.Tabs:
    colours = [] if shown.map_size is None else [rrb.TextDocumentView(origin="/map_colours", name="Map's colours")]
    return rrb.Tabs(
        rrb.TextDocumentView(origin="/about", name="About this run"),
        rrb.TextDocumentView(origin="/clip", name="Clip report"),
        *colours,
        rrb.TextLogView(
            origin="/events",
            name="Events",
            columns=rrb.TextLogColumns(
                timeline_columns=[TimelineColumn(TIMELINE, visible=False)],
                text_log_columns=["LogLevel", "Body"],
            ),
        ),
    )


def _plane(origin: str, name: str, x: tuple[float, float], y: tuple[float, float]) -> rrb.Spatial2DView:
    bounds = rrb.VisualBounds2D(x_range=x, y_range=y)
    return rrb.Spatial2DView(origin=origin, name=name, background=BACKGROUND, visual_bounds=bounds)


def _plots(cycles: Cycles | None, shown: Shown) -> rrb.Vertical:
    entities = [entity for entity in VIEWS if entity != "forecast" or "/forecast" in shown.topics]
    plots = [
        rrb.TimeSeriesView(
            origin=f"/{entity}",
            name=VIEWS[entity][0],
            axis_y=_range(entity, cycles),
            axis_x=rrb.TimeAxis(link=rrb.components.LinkAxis.LinkToGlobal),
            plot_legend=rrb.PlotLegend(corner=rrb.Corner2D.RightTop),
        )
        for entity in entities
    ]
    return rrb.Vertical(*plots, row_shares=[VIEWS[entity][1] for entity in entities])


def _range(view: str, cycles: Cycles | None) -> rrb.ScalarAxis | None:
    """Return the range of all lines of a view with a margin; None where they are constant or have no value."""
    if view == "forecast":
        return rrb.ScalarAxis(range=(-0.05, 1.05))
    if cycles is None:
        return None
    lines = [line for entity, line in CYCLE_LINES.items() if entity.startswith(f"{view}/")]
    values = np.concatenate([getattr(cycles, line.column) * line.factor for line in lines])
    values = values[np.isfinite(values)]
    span = float(np.ptp(values)) if values.size else 0.0
    if not 0.0 < span < np.inf:
        return None
    return rrb.ScalarAxis(range=with_a_label(float(values.min()) - 0.05 * span, float(values.max()) + 0.05 * span))


def with_a_label(low: float, high: float) -> tuple[float, float]:
    """Return a range wide enough that Rerun writes a number on its axis beside 0.

    It writes one at powers of ten only where its grid has no room for more: a range that nearly reaches one is made to.

    >>> with_a_label(-0.9, 0.9), with_a_label(-3.0, 3.1)
    ((-1.05, 1.05), (-3.0, 3.1))
    """
    top = max(abs(low), abs(high))
    decade = 10.0 ** math.ceil(math.log10(top)) if top > 0.0 else 0.0
    if not 0.4 * decade < top < decade:
        return low, high
    reach = 1.05 * decade
    return (-reach if -low > 0.25 * decade else low, reach if high > 0.25 * decade else high)
