"""The parser of `twin import`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "import",
        "make a recording of what another system measured: CSV with a column map, points of a camera system, PEER AT2",
        "exit codes: 0 written, 2 bad input",
    )
    parser.add_argument("file", type=Path, metavar="FILE", help="a text table, or an .at2 record of the base")
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="WHAT=COLUMN[UNIT] ...",
        help="which column is what: time or rate, displacement and acceleration of the base, rotation of the block; "
        "points of a camera system as NAME.x and NAME.z (two or more on the block; those called base... on the table), "
        'or as displacements NAME.dx and NAME.dz from NAME.x0 and NAME.z0. As in "time=t[ms] displacement=x[mm] '
        'rotation=phi[deg]"; #2 is the second column',
    )
    parser.add_argument(
        "--scene",
        default=arguments.DEFAULT_SCENE,
        metavar="SCENE",
        help="the block it was measured on (default: b6l_sine)",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.mcap", help="default: the file's name with .mcap, in this folder"
    )
    parser.add_argument(
        "--bandwidth", type=float, metavar="HZ", help="of an acceleration made from a displacement (default: 20)"
    )
    parser.add_argument("--scale", type=float, default=1.0, metavar="X", help="factor on an AT2 record (default: 1)")
    parser.add_argument("--separator", choices=(";", "tab", ",", "space"), help="between columns (default: found out)")
    parser.add_argument("--decimal", choices=(".", ","), help="decimal sign (default: found out)")
