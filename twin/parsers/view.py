"""The parser of `twin view`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "view",
        "show a recording in Rerun: 3D, signals, phase plane, events, what the file says of itself",
        "exit codes: 0 shown or written, 2 bad input",
    )
    arguments.recording(parser)
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--out", type=Path, metavar="FILE.rrd", help="write a Rerun file instead of opening a viewer")
    where.add_argument("--png", type=Path, metavar="FILE.png", help="draw the window into a picture instead")
    where.add_argument(
        "--web", action="store_true", help="serve the viewer to a browser on this machine (127.0.0.1), until Ctrl-C"
    )
    parser.add_argument(
        "--at", type=float, metavar="S", help="with --png: the instant (default: that of the largest prediction)"
    )
    parser.add_argument(
        "--map", type=Path, metavar="MAP.npz", help="a map of `twin map --out`, with the run's place on it"
    )
    parser.add_argument("--follow", action="store_true", help="the recording is being written: show what comes")
