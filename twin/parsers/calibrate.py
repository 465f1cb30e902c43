"""The parser of `twin calibrate`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "calibrate",
        "what a block is, from how it rocked freely, or from which pulses overturned it",
        "exit codes: 0 calibrated, 1 calibrated, but the data show more than rocking, or do not bound the block, "
        "2 bad input",
    )
    parser.add_argument(
        "file",
        metavar="FILE",
        help="a recording (.mcap, or the name of a sample that ships), a table of rotations over time (.csv, .txt; see "
        "--map), or a .csv table of outcomes with a column `overturned`",
    )
    parser.add_argument(
        "--map",
        action="append",
        default=[],
        metavar="WHAT=COLUMN[UNIT] ...",
        help='which column is what, as for `twin import`: "time=t[ms] rotation=phi[deg]" (default: columns time_s and '
        "rotation_rad, rotation_mrad or rotation_deg)",
    )
    parser.add_argument("--separator", choices=(";", "tab", ",", "space"), help="between columns (default: found out)")
    parser.add_argument("--decimal", choices=(".", ","), help="decimal sign (default: found out)")
    parser.add_argument(
        "--scene", metavar="SCENE", help="whose block this nominally is (default: the recording's own scene)"
    )
    parser.add_argument("--width-mm", type=float, metavar="MM", help="nominal width, with --height-mm")
    parser.add_argument("--height-mm", type=float, metavar="MM", help="nominal height")
    parser.add_argument(
        "--geometry-percent",
        type=float,
        metavar="X",
        help="take the nominal slenderness and frequency parameter as known to X %% (one standard deviation; default: "
        "the nominal block is only compared with)",
    )
    parser.add_argument(
        "--fix",
        action="append",
        default=[],
        choices=("slenderness", "frequency"),
        help="keep this of the nominal block; may be given twice",
    )
    parser.add_argument("--from", dest="begin", type=float, metavar="S", help="leave out what is before this time")
    parser.add_argument("--to", dest="end", type=float, metavar="S", help="leave out what is after it")
    parser.add_argument(
        "--edge",
        metavar="FILE",
        help="a recording of the same material on its edges only: says what the material loses and what the base does",
    )
    parser.add_argument("--out", type=Path, metavar="PICTURE.png", help="draw the fit (.png, .svg or .pdf)")
    parser.add_argument(
        "--scene-out",
        metavar="FILE.toml",
        help="write the [block] and [uncertainty] lines a scene would take; - prints them",
    )
    parser.add_argument("--seed", type=int, default=1, metavar="N", help="of the chains for outcomes (default: 1)")
