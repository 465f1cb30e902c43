"""The parser of `twin emulate`."""

from __future__ import annotations

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "emulate",
        "be the emulated table and specimen of a scene, in a process of its own, until Ctrl-C",
        "exit codes: 0 stopped by Ctrl-C, 2 bad input",
    )
    arguments.scene(parser)
    arguments.bus(parser, "udp_multicast")
    arguments.faults(parser)
