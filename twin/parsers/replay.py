"""The parser of `twin replay`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "replay",
        "feed a recorded base motion to the same live code and compare the predictions",
        "exit codes: 0 the predictions agree, 1 they do not, 2 bad input",
    )
    parser.add_argument("file", type=Path, metavar="FILE.mcap")
    parser.add_argument(
        "--speed", type=float, metavar="X", help="1 is real time, 0.1 a tenth of it (default: as fast as it goes)"
    )
