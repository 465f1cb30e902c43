"""The parser of `twin run`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "run",
        "perform a scene live, prediction beside measurement, and record it",
        "exit codes: 0 performed and recorded, 1 tripped (the table was stopped) or not recorded whole, 2 bad input",
    )
    arguments.scene(parser)
    parser.add_argument(
        "--device",
        default="emulator",
        metavar="NAME",
        help="emulator (default: nothing real moves), or the name of a real table, which asks for confirmation first",
    )
    arguments.bus(parser)
    parser.add_argument(
        "--reset", action="store_true", help="acknowledge a fault the drive is still in, after its cause is gone"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.mcap", help="where to record (default: ./runs/SCENE-TIME.mcap)"
    )
    parser.add_argument(
        "--view", action="store_true", help="open a Rerun viewer (on 127.0.0.1) and follow the run in it"
    )
    parser.add_argument("--no-rrd", action="store_true", help="write no .rrd beside the recording")
