"""The parser of `twin export`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "export",
        "write a recording as CSV, Parquet or MATLAB, or its CAN traffic as BLF",
        "exit codes: 0 written, 2 bad input",
    )
    arguments.recording(parser)
    parser.add_argument("--to", required=True, choices=("csv", "parquet", "mat", "blf"), help="the format")
    parser.add_argument(
        "--out",
        type=Path,
        metavar="FILE",
        help="the file of the cycles (default: the recording's name with the format's ending, in this folder); CSV and "
        "Parquet put the other tables beside it",
    )
