"""The page on A4: text set to the width there is, the map beside the stops, the run over time, a place to sign."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from twin.errors import InputError
from twin.plan import Plan
from twin.plan_page.chart_drawing import draw_chart
from twin.plan_page.chart_of_outcomes import OutcomeChart
from twin.plan_page.content import Content, Fact, Table
from twin.plan_page.drawing import SMALL, draw_plane, draw_run
from twin.plan_page.typesetting import MONO, SANS, printable, shortened, wrapped

WIDTH, HEIGHT = 210.0 / 25.4, 297.0 / 25.4
"""A4, inches."""
MARGIN = 0.45
POINT = 1.0 / 72.0
"""Inches."""
DOTS = 200
"""Of a picture, to the inch."""
HEAD_WIDTH = 0.62
"""Of the column of heads, inches."""
LARGEST_TYPE, SMALLEST_TYPE = 6.6, 4.4
LEADING = 1.22
CHART_HEIGHT, LEAST_RUN, SIGNATURE = 2.85, 2.8, 0.62
"""Of the row with map and stops, of the panels over time at least, of the place to sign; inches."""


DRAWN = {
    # Text that can be searched and copied, with its type in the file.
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "plan",
    "hatch.linewidth": 0.5,
    # Letters as wide in a picture as on paper.
    "text.hinting": "none",
}
"""How the page is drawn."""


class Sheet:
    """A figure written on from the top, in inches.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    """

    def __init__(self, figure: Any) -> None:
        self.figure = figure
        self.y = HEIGHT - MARGIN
        self.texts: list[Any] = []

    def text(self, x: float, y: float, words: str, size: float, **more: Any) -> None:
        """Write a line whose baseline box begins at `x`, top at `y`, inches from the lower left corner."""
        family = more.pop("family", SANS)
        self.texts.append(
            self.figure.text(
                x / WIDTH,
                y / HEIGHT,
                printable(words, family),
                fontsize=size,
                family=family,
                va=more.pop("va", "top"),
                parse_math=False,
                **more,
            )
        )

    def rule(self, y: float, *, left: float = MARGIN, right: float = WIDTH - MARGIN, width: float = 0.6) -> None:
        """Draw a line across."""
        from matplotlib.lines import Line2D

        line: Any = Line2D
        ends = [left / WIDTH, right / WIDTH], [y / HEIGHT, y / HEIGHT]
        self.figure.add_artist(line(*ends, color="black", lw=width, transform=self.figure.transFigure))

    def axes(self, left: float, bottom: float, width: float, height: float) -> Any:
        """Return axes placed in inches."""
        return self.figure.add_axes((left / WIDTH, bottom / HEIGHT, width / WIDTH, height / HEIGHT))


def set_page(plan: Plan, content: Content, chart: OutcomeChart | None) -> Any:
    """Return the figure of the page, A4 portrait."""
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(WIDTH, HEIGHT), dpi=DOTS, facecolor="white")
    sheet = Sheet(figure)
    _heading(sheet, content)
    foot = _footing(sheet, content)
    chart_height = CHART_HEIGHT
    room = sheet.y - foot - LEAST_RUN - chart_height - 0.25
    _facts(sheet, content.facts, room)
    sheet.y -= 0.08
    _middle(sheet, plan, content, chart, chart_height)
    _run(sheet, plan, foot)
    return figure


def write_paper(figure: Any, path: Path) -> None:
    """Write the figure; raises `InputError` where that is not possible."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    mpl: Any = matplotlib
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with mpl.rc_context(DRAWN):
            figure.savefig(path, dpi=DOTS)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _heading(sheet: Sheet, content: Content) -> None:
    wide = (WIDTH - 2 * MARGIN) / POINT
    made = next((fact.text for fact in content.reproduce if fact.head == "made"), "")
    sheet.text(MARGIN, sheet.y, "PLAN OF A RUN", 7.0, color="0.35")
    sheet.text(WIDTH - MARGIN, sheet.y, made, 7.0, ha="right", color="0.35")
    sheet.y -= 0.15
    title = f"{content.name}: {content.title}" if content.title else content.name
    lines = wrapped(title, wide, 12.0, weight="bold")
    if len(lines) > 2:
        lines = [lines[0], shortened(" ".join(lines[1:]), wide, 12.0, weight="bold")]
    for line in lines:
        sheet.text(MARGIN, sheet.y, line, 12.0, weight="bold")
        sheet.y -= 0.2
    sheet.y -= 0.03
    words = wrapped(content.verdict, wide - 16.0, 8.6, weight="bold")[:3]
    height = 0.155 * len(words) + 0.09
    _box(sheet, sheet.y - height, height, heavy=content.warned)
    for k, line in enumerate(words):
        sheet.text(MARGIN + 0.1, sheet.y - 0.05 - 0.155 * k, line, 8.6, weight="bold")
    sheet.y -= height + 0.07


def _box(sheet: Sheet, bottom: float, height: float, *, heavy: bool) -> None:
    from matplotlib.patches import Rectangle

    rectangle: Any = Rectangle
    sheet.figure.add_artist(
        rectangle(
            (MARGIN / WIDTH, bottom / HEIGHT),
            (WIDTH - 2 * MARGIN) / WIDTH,
            height / HEIGHT,
            facecolor="0.92" if heavy else "white",
            edgecolor="black",
            lw=1.8 if heavy else 0.8,
            transform=sheet.figure.transFigure,
        )
    )


def _set(facts: tuple[Fact, ...], size: float, width: float) -> list[tuple[str, str]]:
    """Return lines (head, text) of facts set in a column of text `width` points wide."""
    lines: list[tuple[str, str]] = []
    for fact in facts:
        for k, line in enumerate(wrapped(fact.text, width, size)):
            lines.append((fact.head if k == 0 else "", line))
    return lines


def _facts(sheet: Sheet, facts: tuple[Fact, ...], room: float) -> None:
    """Write the plan's lines, in the largest type that leaves room for the rest."""
    width = (WIDTH - 2 * MARGIN - HEAD_WIDTH) / POINT
    size = LARGEST_TYPE
    lines = _set(facts, size, width)
    while size > SMALLEST_TYPE and len(lines) * size * LEADING * POINT > room:
        size -= 0.1
        lines = _set(facts, size, width)
    most = int(room / (size * LEADING * POINT))
    if len(lines) > most:
        lines = [*lines[: most - 1], ("…", f"{len(lines) - most + 1} more lines: see `twin plan`")]
    for head, line in lines:
        if head:
            warning = head == "WARNING"
            name = shortened(head, HEAD_WIDTH / POINT - 3.0, size, weight="bold")
            sheet.text(MARGIN, sheet.y, name, size, weight="bold", color="black" if warning else "0.25")
        sheet.text(MARGIN + HEAD_WIDTH, sheet.y, line, size)
        sheet.y -= size * LEADING * POINT


def _middle(sheet: Sheet, plan: Plan, content: Content, chart: OutcomeChart | None, height: float) -> None:
    top = sheet.y
    sheet.rule(top)
    left_width = 2.75
    shown = chart is not None or plan.response is not None
    title = chart.title if chart is not None else "Rotation against its rate" if shown else ""
    sheet.text(MARGIN, top - 0.05, shortened(title, (left_width + 0.3) / POINT, 7.2, weight="bold"), 7.2, weight="bold")
    if shown:
        axes = sheet.axes(MARGIN + 0.38, top - height + 0.83, left_width - 0.38, height - 1.06)
        for side in axes.spines.values():
            side.set_linewidth(0.6)
        if chart is not None:
            draw_chart(axes, chart, shortened(plan.capacity.name, 60.0, 5.6))
        else:
            draw_plane(axes, plan)
    x = MARGIN + left_width + 0.3
    y = top - 0.05
    if content.stops is not None:
        y = _table(sheet, content.stops, x, y, (1.12, 1.28, 0.62, 0.58, 0.52, 0.5), most=11)
    _table(sheet, content.capacity, x, y, (0.72, 0.72, 2.9), most=7)
    sheet.y = top - height - 0.05


def _table(sheet: Sheet, table: Table, x: float, y: float, widths: tuple[float, ...], *, most: int) -> float:
    """Write a table whose upper left corner is at x, y; return where it ends."""
    size, step = 6.0, 6.0 * 1.28 * POINT
    total = WIDTH - MARGIN - x
    scale = total / sum(widths)
    edges = [x + scale * sum(widths[:k]) for k in range(len(widths) + 1)]
    sheet.text(x, y, shortened(table.title, total / POINT, 7.2, weight="bold"), 7.2, weight="bold")
    y -= 0.14
    for k, name in enumerate(table.columns):
        sheet.text(edges[k], y, shortened(name, (edges[k + 1] - edges[k]) / POINT, size), size, color="0.35")
    y -= step
    sheet.rule(y + 0.01, left=x, width=0.5)
    y -= 0.02
    for row in table.rows[:most]:
        for k, cell in enumerate(row):
            weight = "bold" if cell == "FALLS" else "normal"
            words = shortened(cell, (edges[k + 1] - edges[k]) / POINT - 3.0, size, weight=weight)
            sheet.text(edges[k], y, words, size, weight=weight)
        y -= step
    for line in wrapped(table.note, total / POINT, 5.6)[:4] if table.note else ():
        sheet.text(x, y - 0.01, line, 5.6, color="0.2")
        y -= 5.6 * 1.25 * POINT
    return y - 0.08


def _run(sheet: Sheet, plan: Plan, foot: float) -> None:
    if plan.motion is None:
        return
    sheet.rule(sheet.y)
    sheet.text(MARGIN, sheet.y - 0.05, "The run", 7.2, weight="bold")
    top, bottom = sheet.y - 0.33, foot + 0.36
    gap = 0.17
    height = top - bottom - 2 * gap
    left, width = MARGIN + 0.48, WIDTH - 2 * MARGIN - 0.48
    panels: list[Any] = []
    y = top
    for share in (0.27, 0.27, 0.46):
        y -= share * height
        panels.append(sheet.axes(left, y, width, share * height))
        y -= gap
    draw_run(panels, plan)


def _footing(sheet: Sheet, content: Content) -> float:
    """Write what reproduces the page and the place to sign, at the bottom; return where that begins."""
    size = 5.6
    width = (WIDTH - 2 * MARGIN - HEAD_WIDTH) / POINT
    lines: list[tuple[str, str]] = []
    for fact in content.reproduce:
        if fact.head == "made":
            continue
        family = MONO if fact.head in ("command", "sha-256") else SANS
        found = wrapped(fact.text, width, size, family)
        if len(found) > 3:
            found = [*found[:2], shortened(" ".join(found[2:]), width, size, family)]
        lines += [(fact.head if k == 0 else "", line) for k, line in enumerate(found)]
    step = size * 1.25 * POINT
    top = MARGIN + SIGNATURE + len(lines) * step + 0.1
    sheet.rule(top)
    y = top - 0.05
    head = ""
    for name, line in lines:
        head = name or head
        if name:
            shown = shortened(name, HEAD_WIDTH / POINT - 3.0, size, weight="bold")
            sheet.text(MARGIN, y, shown, size, weight="bold", color="0.25")
        sheet.text(MARGIN + HEAD_WIDTH, y, line, size, family=MONO if head in ("command", "sha-256") else SANS)
        y -= step
    each = (WIDTH - 2 * MARGIN) / 3.0
    for k, label in enumerate(("name", "date and time", "signature")):
        left = MARGIN + k * each
        sheet.rule(MARGIN + 0.13, left=left, right=left + each - 0.2, width=0.8)
        sheet.text(left, MARGIN + 0.1, label, SMALL, color="0.35")
    return top
