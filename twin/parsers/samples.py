"""The parser of `twin samples`."""

from __future__ import annotations

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    arguments.command(commands, "samples", "list the recordings that ship with the package", "exit codes: 0")
