"""The parser of `twin recover`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "recover",
        "copy what is whole in a recording that was cut off or damaged to a clean, indexed file, and say what was lost",
        "exit codes: 0 the file was whole, or lacked nothing but its end, 1 something was lost, 2 bad input",
    )
    parser.add_argument("file", type=Path, metavar="FILE.mcap")
    parser.add_argument(
        "--out", type=Path, metavar="CLEAN.mcap", help="where to write (default: FILE-recovered.mcap beside it)"
    )
