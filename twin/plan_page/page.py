"""`write_page`: the plan on one page, to be printed and signed."""

from __future__ import annotations

from pathlib import Path

from twin.errors import InputError
from twin.plan import Plan
from twin.plan_page.chart_of_outcomes import outcome_chart
from twin.plan_page.content import content_of
from twin.plan_page.origin import Origin
from twin.plan_page.paper import set_page, write_paper
from twin.plan_page.spread import Spread
from twin.plan_page.web import write_web

PAPER, WEB = (".pdf", ".png", ".svg"), (".html", ".htm")


def check_ending(path: Path) -> None:
    """Raise `InputError` where a page of that name could not be written in any format."""
    if path.suffix.lower() not in (*PAPER, *WEB):
        raise InputError(f"--out {path}: a page ends in .pdf, .png, .svg or .html")


def write_page(plan: Plan, path: Path, origin: Origin | None = None) -> None:
    """Write the page of `plan`; the ending of `path` decides the format.

    Parameters
    ----------
    plan : Plan
    path : Path
        .pdf, .png and .svg are A4; .html has its tables as text. None of them needs another file, or a network.
    origin : Origin, optional
        What made it: see `twin.plan_page.origin.origin_of`. Versions alone are said without it.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    check_ending(path)
    content = content_of(plan, origin)
    chart = outcome_chart(plan, spread_of(plan))
    if path.suffix.lower() in WEB:
        write_web(plan, content, chart, path)
    else:
        write_paper(set_page(plan, content, chart), path)


def spread_of(plan: Plan) -> Spread:
    """Return how uncertain the block and the table's gain are, as the scene has it."""
    spreads = plan.scene.spreads
    return Spread(
        slenderness=0.01 * spreads.slenderness_percent.deviation,
        size=0.01 * spreads.size_percent.deviation,
        gain=0.01 * spreads.table.gain_percent.deviation,
        restitution=spreads.restitution.deviation,
    )
