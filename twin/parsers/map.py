"""The parser of `twin map`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "map",
        "find what every pulse of a grid does to a scene's block",
        "exit codes: 0 the map is done, 1 stopped by Ctrl-C (with --out, --resume goes on), 2 bad input",
    )
    arguments.scene(parser)
    parser.add_argument(
        "--kind",
        metavar="KIND",
        help="sine, cosine, lasting-sine (with --duration), constant or double-pulse (default: the scene's)",
    )
    spans = (
        ("amplitude", "rows of waves and constant pulses, in g tan(alpha), or with the unit g or m/s2"),
        ("frequency", "columns of waves, omega in p, or with the unit Hz or rad/s"),
        ("length", "columns of constant pulses, p times the time, or with the unit s or ms"),
        ("velocity", "rows of double pulses: peak velocity in m/s, or with the unit mm/s"),
        ("gap", "columns of double pulses: stop gap in m, or with the unit mm"),
    )
    for name, purpose in spans:
        parser.add_argument(f"--{name}", metavar="START:STOP:COUNT", help=f"{purpose}, as in 0.1:10:100")
    parser.add_argument("--duration", type=float, metavar="S", help="length of a lasting sine, s")
    parser.add_argument("--full", action="store_true", help="overturning times and peak rotations too")
    parser.add_argument("--method", metavar="NAME", help="cell by cell with this method of `simulate`: slow")
    parser.add_argument("--model", metavar="NAME", help="nonlinear (default), quasi-linear, linearised or auto: slow")
    parser.add_argument("--restitution", metavar="ETA", help="a number, improved:K or housner (default: the scene's)")
    parser.add_argument("--initial-tilt", type=float, metavar="DEG", help="initial rotation (default: the scene's)")
    parser.add_argument("--executor", metavar="dask://HOST:PORT", help="work on this dask cluster (extra `cluster`)")
    parser.add_argument("--out", type=Path, metavar="FILE.npz", help="write the map (.npz or .csv)")
    parser.add_argument("--picture", type=Path, metavar="FILE.png", help="draw it, with what the table can run")
    parser.add_argument("--resume", action="store_true", help="go on with an --out that was stopped")
