"""The page as one HTML file: words and tables as text, pictures as SVG in it, nothing fetched from anywhere."""

from __future__ import annotations

import io
import re
from html import escape
from pathlib import Path
from typing import Any

from twin.errors import InputError
from twin.plan import Plan
from twin.plan_page.chart_drawing import draw_chart
from twin.plan_page.chart_of_outcomes import OutcomeChart
from twin.plan_page.content import Content, Fact, Table
from twin.plan_page.drawing import draw_plane, draw_run
from twin.plan_page.typesetting import shortened

STYLE = """
@page { size: A4; margin: 12mm }
body { font: 10pt/1.35 sans-serif; color: #000; background: #fff; max-width: 190mm; margin: 6mm auto; padding: 0 4mm }
h1 { font-size: 15pt; margin: 0 0 2mm } h2 { font-size: 11pt; margin: 4mm 0 1mm }
.made, .label { color: #555; font-size: 8.5pt } .verdict { border: 1px solid #000; padding: 2mm 3mm; font-weight: bold }
.warned { border-width: 3px; background: #eee } table { border-collapse: collapse; font-size: 8.5pt; width: 100% }
th { text-align: left; font-weight: normal; color: #555; border-bottom: 1px solid #000 }
td, th { padding: .4mm 2mm .4mm 0; vertical-align: top; overflow-wrap: anywhere }
.facts th { font-weight: bold; color: #222; border: 0; white-space: nowrap; width: 18mm }
svg { max-width: 100%; height: auto } .pair { display: flex; gap: 6mm; flex-wrap: wrap }
.pair > * { flex: 1 1 70mm; min-width: 0 } .sign { display: flex; gap: 8mm; margin-top: 14mm; break-inside: avoid }
.sign div { flex: 1; border-top: 1px solid #000 } figure { margin: 2mm 0; break-inside: avoid }
"""
POLICY = "default-src 'none'; style-src 'unsafe-inline'; img-src data:"


def write_web(plan: Plan, content: Content, chart: OutcomeChart | None, path: Path) -> None:
    """Write the page; raises `InputError` where that is not possible."""
    text = page_text(plan, content, chart)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def page_text(plan: Plan, content: Content, chart: OutcomeChart | None) -> str:
    """Return the whole file; everything a user wrote is escaped."""
    title = said(f"{content.name}: {content.title}" if content.title else content.name)
    made = next((fact.text for fact in content.reproduce if fact.head == "made"), "")
    verdict = "verdict warned" if content.warned else "verdict"
    beside = [_table(content.stops)] if content.stops is not None else []
    beside.append(_table(content.capacity))
    parts = [
        "<!DOCTYPE html>",
        '<html lang="en"><head><meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{POLICY}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>Plan of {title}</title><style>{STYLE}</style></head><body>",
        f'<p class="made">Plan of a run. {said(made)}</p>',
        f"<h1>{title}</h1>",
        f'<p class="{verdict}">{said(content.verdict)}</p>',
        _facts(content.facts),
        f'<div class="pair"><div>{_chart(plan, chart)}</div><div>{"".join(beside)}</div></div>',
        _run(plan),
        "<h2>Made by</h2>",
        _facts(content.reproduce),
        '<div class="sign"><div class="label">name</div><div class="label">date and time</div>'
        '<div class="label">signature</div></div>',
        "</body></html>",
    ]
    return "\n".join(part for part in parts if part)


def said(text: str) -> str:
    """Return a text of anybody's as HTML: what would be markup is shown, what no page can hold is left out."""
    return escape("".join(c if c.isprintable() else " " for c in text))


def _facts(facts: tuple[Fact, ...]) -> str:
    rows = "".join(f"<tr><th>{said(fact.head)}</th><td>{said(fact.text)}</td></tr>" for fact in facts)
    return f'<table class="facts">{rows}</table>'


def _table(table: Table) -> str:
    head = "".join(f"<th>{said(name)}</th>" for name in table.columns)
    rows = "".join("<tr>" + "".join(f"<td>{said(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    note = f'<p class="label">{said(table.note)}</p>' if table.note else ""
    return f"<h2>{said(table.title)}</h2><table><tr>{head}</tr>{rows}</table>{note}"


def _chart(plan: Plan, chart: OutcomeChart | None) -> str:
    if chart is None and plan.response is None:
        return ""
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(3.6, 3.9))
    axes = figure.add_axes((0.13, 0.28, 0.84, 0.69))
    if chart is not None:
        draw_chart(axes, chart, shortened(plan.capacity.name, 70.0, 5.6))
    else:
        draw_plane(axes, plan)
    title = chart.title if chart is not None else "Rotation against its rate"
    return f"<h2>{said(title)}</h2>{_svg(figure, 'map', title)}"


def _run(plan: Plan) -> str:
    if plan.motion is None:
        return ""
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(7.4, 4.6))
    panels = [
        figure.add_axes((0.08, bottom, 0.91, height)) for bottom, height in ((0.74, 0.21), (0.47, 0.21), (0.08, 0.33))
    ]
    draw_run(panels, plan)
    return f"<h2>The run</h2>{_svg(figure, 'run', 'Base acceleration, base position and rotation over time')}"


def _svg(figure: Any, name: str, words: str) -> str:
    """Return a figure as SVG for the inside of a page: without its head, its names its own."""
    import matplotlib
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    FigureCanvasAgg(figure)
    kept = io.StringIO()
    mpl: Any = matplotlib
    options = {"svg.fonttype": "path", "svg.hashsalt": name, "hatch.linewidth": 0.5}
    with mpl.rc_context(options):
        figure.savefig(kept, format="svg", dpi=200, metadata={"Date": None, "Creator": None})
    text = kept.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    # Two pictures of one page may not share a name.
    text = re.sub(r'id="([^"]+)"', rf'id="{name}-\1"', text)
    text = re.sub(r'href="#([^"]+)"', rf'href="#{name}-\1"', text)
    text = re.sub(r"url\(#([^)]+)\)", rf"url(#{name}-\1)", text)
    return f'<figure role="img" aria-label="{said(words)}">{text}</figure>'
