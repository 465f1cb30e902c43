"""The parser of `twin plan`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "plan",
        "clip a scene to its table, predict the block, and say how far from overturning it is; nothing moves",
        "exit codes: 0 the table can do it as asked and the block stays up, 1 it cannot, or clipping changed the "
        "pulse, or the block falls, 2 bad input",
    )
    arguments.scene(parser)
    arguments.tuned(parser)
    parser.add_argument("--out", type=Path, metavar="PLAN.png", help="draw the plan (.png, .svg or .pdf)")
