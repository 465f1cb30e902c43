"""The parser of `twin compare`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "compare",
        "compare two recordings, or prediction and measurement of one, impact by impact",
        "exit codes: 0 compared, 2 bad input",
    )
    arguments.recording(parser, "first")
    parser.add_argument(
        "second",
        nargs="?",
        metavar="SECOND.mcap",
        help="the other recording; without it the prediction of the first against its measurement",
    )
    parser.add_argument(
        "--signal",
        choices=("measured", "predicted"),
        help="which rotation of two recordings (default: measured where both have one and they differ)",
    )
    parser.add_argument(
        "--shift",
        metavar="S",
        default=None,
        help="seconds the second clock is ahead, or auto: by the impacts (default: auto; 0 within one recording and "
        "for a what-if of it: their clock is one)",
    )
    parser.add_argument("--out", type=Path, metavar="PICTURE.png", help="draw it (.png, .svg or .pdf)")
