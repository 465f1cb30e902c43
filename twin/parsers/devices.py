"""The parser of `twin devices`."""

from __future__ import annotations

import argparse

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "devices",
        "list machines with their capacities, buses that can be opened here, and faults; or ask one machine who it is",
        "exit codes: 0 listed, or it answers; 1 an installed device cannot be used; 2 bad input, or nobody answers",
    )
    actions = parser.add_subparsers(dest="action", metavar="check NAME")
    check = actions.add_parser(
        "check",
        help="talk to one and report its state and versions; nothing moves and nothing is enabled",
        description="Talk to one device and report its state and versions. It is set up as for a run (limits, "
        "watchdogs) and not enabled: nothing moves. Without --bus the emulated one is asked, in this process.",
        epilog="exit codes: 0 it answers, 2 bad input, or nobody answers",
    )
    check.add_argument("name", metavar="NAME", help="name of the device (see `twin devices`)")
    # Given before or behind `check`.
    check.add_argument("--json", action="store_true", default=argparse.SUPPRESS, help="print one JSON object")
    arguments.bus(check)
