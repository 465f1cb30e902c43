"""The parser of `twin chart`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "chart",
        "measure speed against accuracy of every method on this machine, and draw it",
        "exit codes: 0 measured, 1 the default method was wrong or refused somewhere, or Ctrl-C, 2 bad input",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("chart.png"),
        metavar="CHART.png",
        help="the picture (.png, .svg or .pdf; default: chart.png); a .csv of every point is written beside it",
    )
    parser.add_argument("--record", type=Path, metavar="FILE.at2", help="an earthquake record too (PEER AT2 or CSV)")
    parser.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="factor on the record's acceleration (default: 1)"
    )
    parser.add_argument("--quick", action="store_true", help="fewer points and a coarser map: under 30 s")
