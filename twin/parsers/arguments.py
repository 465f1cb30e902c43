"""What several commands' parsers have in common."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TypeAlias

Commands: TypeAlias = "argparse._SubParsersAction[argparse.ArgumentParser]"  # pyright: ignore[reportPrivateUsage]
"""What `argparse` makes of `add_subparsers`."""
DEFAULT_SCENE = "b6l_sine"


def command(commands: Commands, name: str, purpose: str, codes: str) -> argparse.ArgumentParser:
    """Add a command with `--json`; `codes` say what its exit codes mean."""
    added = commands.add_parser(name, help=purpose, description=purpose[0].upper() + purpose[1:] + ".", epilog=codes)
    added.add_argument("--json", action="store_true", help="print one JSON object instead of text")
    return added


def scene(command: argparse.ArgumentParser) -> None:
    """Add SCENE, --record and --scale."""
    command.add_argument(
        "scene",
        nargs="?",
        default=DEFAULT_SCENE,
        metavar="SCENE",
        help=f"name of a shipped scene (see `twin scenes`) or path of a .toml file (default: {DEFAULT_SCENE})",
    )
    command.add_argument(
        "--record", type=Path, metavar="FILE.at2", help="shake with this earthquake record (PEER AT2 or CSV) instead"
    )
    command.add_argument(
        "--scale", type=float, default=1.0, metavar="X", help="factor on the record's acceleration (default: 1)"
    )


def bus(command: argparse.ArgumentParser, default: str = "virtual") -> None:
    """Add --bus, --channel and --bus-option."""
    command.add_argument(
        "--bus",
        default=default,
        metavar="INTERFACE",
        help="python-can interface: virtual (inside this process), udp_multicast (`twin emulate` is the other one, on "
        f"this machine), socketcan and others for real tables (default: {default})",
    )
    command.add_argument("--channel", metavar="NAME", help="the interface's channel, e.g. can0")
    command.add_argument(
        "--bus-option",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="passed on to python-can untouched, may be given again, e.g. bitrate=1000000, or port=43200 for a second "
        "udp_multicast run on one machine",
    )
