"""The parser of `twin replay`."""

from __future__ import annotations

from pathlib import Path

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "replay",
        "feed a recorded base motion to the same live code and compare the predictions",
        "exit codes: 0 the predictions agree (with --set and the others: it was done), 1 they do not (it was not "
        "done to the end), 2 bad input",
    )
    arguments.recording(parser, optional=True)
    parser.add_argument(
        "--speed",
        type=float,
        metavar="X",
        help="0.1 to 100; 1 is real time (default: as fast as it goes; in real time where no file is named and on a "
        "bus). At a terminal: space pauses, . or the right arrow is one sample, + and - change the speed, q quits",
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="what if: any key of the scene, as in block.restitution=0.9; may be given again; none takes a key away. "
        "Where it changes how the base moves, the emulated table performs the changed scene",
    )
    parser.add_argument(
        "--onto-emulator", action="store_true", help="send the recorded set-points to the scene's emulated table"
    )
    parser.add_argument(
        "--to-bus",
        metavar="INTERFACE",
        help="send the recorded cycles as CAN frames, for other tools to listen to: udp_multicast (stays on this "
        "machine), socketcan and others",
    )
    parser.add_argument("--channel", metavar="NAME", help="the bus's channel, e.g. vcan0")
    parser.add_argument(
        "--bus-option", action="append", default=[], metavar="KEY=VALUE", help="passed on to python-can, as port=43200"
    )
    parser.add_argument(
        "--out", type=Path, metavar="FILE.mcap", help="of --set or --onto-emulator: write what it came to"
    )
