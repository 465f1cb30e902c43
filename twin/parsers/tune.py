"""The parser of `twin tune`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "tune",
        "play a scene's pulse without its specimen, again and again, and correct the command until the table does it",
        "exit codes: 0 the error fell and the corrected command is kept, 1 nothing is kept (it says why), 2 bad input",
    )
    arguments.scene(parser)
    arguments.device(parser)
    arguments.driver(parser)
    arguments.bus(parser)
    arguments.tuned(parser)
    parser.add_argument(
        "--corrections", type=int, default=10, metavar="N", help="largest number of corrections (default: 10)"
    )
    parser.add_argument(
        "--repeats",
        type=int,
        default=3,
        metavar="N",
        help="runs of each command, 2 or more: how they differ tells chance from error (default: 3)",
    )
    parser.add_argument(
        "--payload-kg",
        type=float,
        metavar="M",
        help="dead mass fixed to the table in the specimen's place (default: the specimen's mass; 0: empty table)",
    )
    parser.add_argument("--out", type=Path, metavar="TUNE.png", help="draw what it came to (.png, .svg or .pdf)")
