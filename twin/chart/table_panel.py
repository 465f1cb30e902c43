"""The table of failures: one word and one colour for each method in each situation."""

from __future__ import annotations

from typing import Any

from twin.chart.style import LARGE, SMALL
from twin.chart.survey import Chart
from twin.chart.verdict import Finding, Verdict

FACE = {
    Verdict.RIGHT: "#cfe6f5",
    Verdict.REFUSED: "#fbe7a1",
    Verdict.WRONG: "#D55E00",
    Verdict.NOT_APPLICABLE: "#f4f4f4",
}
WORD = {
    Verdict.RIGHT: "right",
    Verdict.REFUSED: "refuses",
    Verdict.WRONG: "WRONG",
    Verdict.NOT_APPLICABLE: "–",
}
NAMES = 2.75
"""Width of the column of names, in cells."""


def draw_table(figure: Any, chart: Chart) -> None:
    """Draw every finding of the chart."""
    rows = list({f.row.number: f.row for f in chart.findings}.values())
    columns = chart.solvers
    if not rows:
        return
    axes = figure.add_axes((0.012, 0.004, 0.976, 0.315))
    axes.set_axis_off()
    axes.set_xlim(-NAMES, len(columns))
    axes.set_ylim(len(rows) + 1.45, -1.3)
    axes.set_title("e  Where each method fails", fontsize=LARGE + 1, loc="left", weight="bold")
    own = sum(not s.peer for s in columns)
    models = sum(s.relative > 0.0 for s in columns)
    groups = (
        ("our methods", 0, own - models),
        ("simpler models, to 1 %", own - models, own),
        ("peers, events by their manuals", own, len(columns)),
    )
    for name, start, stop in groups:
        if stop > start:
            axes.text(0.5 * (start + stop), -1.12, name, ha="center", va="center", fontsize=SMALL, color="0.35")
            axes.plot([start + 0.06, stop - 0.06], [-0.88, -0.88], color="0.6", lw=1.0)
    for column, solver in enumerate(columns):
        label = solver.name.removeprefix("model ")
        axes.text(column + 0.5, -0.42, label, ha="center", va="center", fontsize=SMALL, weight="bold")
    for line, row in enumerate(rows):
        axes.text(-NAMES, line + 0.5, f"{row.number:>2}", va="center", fontsize=LARGE, color="0.4")
        axes.text(-NAMES + 0.3, line + 0.5, row.name, va="center", fontsize=LARGE)
        for column, solver in enumerate(columns):
            _cell(axes, column, line, chart.finding(row, solver))
    _key(axes, len(rows))


def _cell(axes: Any, column: int, line: int, finding: Finding) -> None:
    from matplotlib.patches import Rectangle

    box: Any = Rectangle
    verdict = finding.verdict
    axes.add_patch(box((column + 0.02, line + 0.04), 0.96, 0.92, facecolor=FACE[verdict], edgecolor="none"))
    word = WORD[verdict]
    checks = finding.right + finding.wrong + finding.refused
    part = {Verdict.WRONG: finding.wrong, Verdict.REFUSED: finding.refused}.get(verdict, checks)
    if part < checks:
        word += f"\n{part} of {checks}"
    wrong = verdict is Verdict.WRONG
    axes.text(
        column + 0.5,
        line + 0.5,
        word,
        ha="center",
        va="center",
        fontsize=SMALL if part == checks else SMALL - 1.5,
        linespacing=1.05,
        color="white" if wrong else "0.15",
        weight="bold" if wrong else "normal",
    )


def _key(axes: Any, bottom: int) -> None:
    said = (
        "right: within the answer's tolerance, or the error the method states   |   refuses: says it cannot, or calls "
        "the outcome undecided   |   WRONG: a wrong answer, quietly\n"
        "Our methods at their defaults (steps of 1 ms), rows 8 and 9 at steps of their own. Peers at their tightest "
        "(1e-15, 1e-13, 1e-13), held to 1e-8 rad; none can call an outcome undecidable (11)."
    )
    axes.text(-NAMES, bottom + 0.25, said, va="top", fontsize=SMALL - 0.7, color="0.25", linespacing=1.5)
