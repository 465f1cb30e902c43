"""What several commands' parsers have in common."""

from __future__ import annotations

import argparse
import sys
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


def device(command: argparse.ArgumentParser) -> None:
    """Add --device."""
    command.add_argument(
        "--device",
        default="emulator",
        metavar="NAME",
        help="emulator (default: nothing real moves), or a real table's name: it needs --arm and its name typed",
    )
    command.add_argument(
        "--arm", action="store_true", help="really move a real table (--device NAME); without it that is a dry run"
    )


def driver(command: argparse.ArgumentParser) -> None:
    """Add --driver."""
    command.add_argument(
        "--driver",
        default="cia402",
        metavar="NAME",
        help="how the real table is spoken to: cia402 (default), or hil: a Quanser board, wired as [hil] of the "
        "capacity file says",
    )


def tuned(command: argparse.ArgumentParser) -> None:
    """Add --tuned."""
    command.add_argument(
        "--tuned",
        type=Path,
        default=Path("tuned"),
        metavar="FOLDER",
        help="where corrected commands of `twin tune` are kept (default: ./tuned)",
    )


def recording(command: argparse.ArgumentParser, name: str = "file", *, optional: bool = False) -> None:
    """Add a recording's name: a file, or a sample that ships."""
    command.add_argument(
        name,
        nargs="?" if optional else None,
        metavar="FILE.mcap",
        help="a recording, or the name of a sample that ships (see `twin samples`)"
        + ("; without it the first sample" if optional else ""),
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


def faults(command: argparse.ArgumentParser) -> None:
    """Add --fault, which may be given again."""
    command.add_argument(
        "--fault",
        action=_Fault,
        default=[],
        metavar="NAME@T[:VALUE]",
        help="what shall go wrong on the emulated table, and when (s, table's clock); may be given again, adds to the "
        "scene's [[fault]]; `--fault list` says what there is",
    )


class _Fault(argparse.Action):
    """Collects faults; `list` prints those there are and ends the program, as --help does."""

    def __call__(
        self,
        parser: argparse.ArgumentParser,
        namespace: argparse.Namespace,
        values: object,
        option_string: str | None = None,  # noqa: ARG002 - argparse's signature
    ) -> None:
        if values == "list":
            from devices.faults.catalogue import FAULTS

            width = max(map(len, FAULTS))
            sys.stdout.write("".join(f"{name:{width}}  {kind.line}\n" for name, kind in FAULTS.items()))
            parser.exit()
        setattr(namespace, self.dest, [*getattr(namespace, self.dest), values])
