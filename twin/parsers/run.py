"""The parser of `twin run`."""

from __future__ import annotations

import argparse
from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "run",
        "perform a scene live, prediction beside measurement, and record it; or a campaign's runs one after another",
        "exit codes: 0 performed and recorded, 1 tripped (the table was stopped), not recorded whole, or a campaign "
        "not at its end, 2 bad input",
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
        "--out",
        type=Path,
        metavar="FILE.mcap",
        help="where to record (default: ./runs/SCENE-TIME.mcap); of a campaign the folder",
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
    parser.add_argument(
        "--yes", action="store_true", help="a campaign on an emulator: go on from run to run without being asked"
    )
    parser.add_argument(
        "--restart", action="store_true", help="begin a campaign again, though some of its runs were performed"
    )
    parser.add_argument(
        "--rrd",
        action=argparse.BooleanOptionalAction,
        help="write a Rerun file beside the recording (default: yes, but with --fast no: it takes as long as the run)",
    )
