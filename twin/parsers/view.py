"""The parser of `twin view`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "view",
        "open a recording in Rerun",
        "exit codes: 0 shown or written, 2 bad input",
    )
    parser.add_argument("file", type=Path, metavar="FILE.mcap")
    parser.add_argument("--out", type=Path, metavar="FILE.rrd", help="write a Rerun file instead of opening a viewer")
