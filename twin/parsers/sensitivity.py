"""The parser of `twin sensitivity`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "sensitivity",
        "compare the three models over tilt, amplitude and slenderness, and perturb a scene's start",
        "exit codes: 0 done, 2 bad input",
    )
    arguments.scene(parser)
    parser.add_argument("--out", type=Path, metavar="FILE.png", help="draw it (.png, .svg or .pdf)")
    parser.add_argument(
        "--tilt-spread", type=float, metavar="DEG", help="deviation of the starts' tilt (default: the scene's [twin])"
    )
    parser.add_argument(
        "--rate-spread", type=float, metavar="DEG/S", help="deviation of the starts' rate (default: p times the tilt's)"
    )
    parser.add_argument("--draws", type=int, metavar="N", help="perturbed starts (default: 1000; 200 of a record)")
    parser.add_argument(
        "--cells", type=int, metavar="N", help="rows and columns of a grid (default: 61; 13 of a record)"
    )
    parser.add_argument(
        "--quasi-linear",
        type=int,
        default=7,
        metavar="N",
        help="rows and columns at which the quasi-linear model is stepped, where it has no closed form; slow: "
        "0.2 s a cell (default: 7; 0: none)",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the perturbed starts (default: 1)")
