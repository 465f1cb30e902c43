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
    arguments.device(parser)
    arguments.driver(parser)
    arguments.bus(parser)
    arguments.faults(parser)
    arguments.tuned(parser)
    parser.add_argument(
        "--untuned", action="store_true", help="send the command as asked, though `twin tune` corrected it"
    )
    parser.add_argument(
        "--gain", type=float, metavar="X", help="share of the whole pulse to run, above 0 to 1: staged levels"
    )
    parser.add_argument(
        "--fast", action="store_true", help="simulated time: as fast as it goes, on the emulator in this process"
    )
    parser.add_argument(
        "--reset",
        action="store_true",
        help="acknowledge the trip or fault the last run left behind, once its cause is gone; it is recorded",
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.mcap", help="where to record (default: ./runs/SCENE-TIME.mcap)"
    )
    parser.add_argument(
        "--view", action="store_true", help="open a Rerun viewer (on 127.0.0.1) and follow the run in it"
    )
    parser.add_argument("--operator", metavar="NAME", help="who stands beside the table; goes into the recording")
    parser.add_argument("--note", metavar="TEXT", help="what the recording shall say of the specimen or the day")
    parser.add_argument(
        "--can-traffic",
        action="store_true",
        help="record every CAN frame too (about 5 a cycle; `twin export --to blf` gives them to other CAN tools)",
    )
    parser.add_argument("--no-rrd", action="store_true", help="write no .rrd beside the recording")
