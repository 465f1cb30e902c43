"""The parser of `twin scenes`."""

from __future__ import annotations

from twin.parsers import arguments


def add(commands: arguments.Commands) -> None:
    """Add the command."""
    parser = arguments.command(commands, "scenes", "list the scenes that ship with the package", "exit codes: 0")
    parser.add_argument("name", nargs="?", metavar="SCENE", help="print this scene's TOML, a start for one of your own")
