"""The parser of `twin schema`."""

from __future__ import annotations

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(
        commands,
        "schema",
        "what is in a recording: topics, fields, units, types, version",
        "exit codes: 0 always",
    )
    parser.add_argument("--proto", action="store_true", help="print the messages as a .proto file instead")
