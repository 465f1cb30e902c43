"""Before anything real moves: a dry run unless armed, a typed name, a staged gain, and a latched trip acknowledged."""

from __future__ import annotations

import argparse
import sys

from devices.catalogue import CatalogueEntry
from twin.commands.connection import EMULATOR
from twin.commands.inputs import scene_of
from twin.commands.latch import refuse_latched
from twin.errors import InputError
from twin.scene import Scene


def staged(options: argparse.Namespace) -> Scene:
    """Return the scene asked for, its pulse scaled by `--gain`; raises `InputError`."""
    scene = scene_of(options)
    return scene if options.gain is None else scene.with_gain(options.gain)


def outlives(options: argparse.Namespace) -> bool:
    """Return whether the table is still there after the run: real, or emulated in another process."""
    return options.device != EMULATOR or options.bus != "virtual"


def check_arming(options: argparse.Namespace, entry: CatalogueEntry) -> None:
    """Raise `InputError` where options do not go together, or a trip of that table was not acknowledged."""
    fast = getattr(options, "fast", False)
    if options.arm and options.device == EMULATOR:
        raise InputError("--arm belongs to a real table: name it with --device")
    if fast and outlives(options):
        raise InputError("--fast is simulated time: it needs the emulator in this process (--bus virtual)")
    if outlives(options) and not getattr(options, "reset", False) and (options.arm or options.device == EMULATOR):
        refuse_latched(entry.name)


def dry_run(entry: CatalogueEntry, options: argparse.Namespace) -> bool:
    """Return whether this was all: a real table that is not armed. It says so."""
    if options.device == EMULATOR or options.arm:
        return False
    print(f"dry run    nothing moved: {entry.name} is real, and moves with --arm only", file=sys.stderr)
    return True


def confirm(entry: CatalogueEntry, options: argparse.Namespace) -> None:
    """Ask for a real device's name, typed, after the operator has read what is about to happen; anything else is no.

    An emulator needs no confirmation. The question goes to stderr, so that it is seen where stdout is not.
    """
    if options.device == EMULATOR:
        return
    name = entry.name
    if not sys.stdin.isatty():
        raise InputError(f"--device {name} moves a real table: it is confirmed at a terminal, which this is not")
    question = f"This moves the real table {name}. Stand clear, hand on the emergency stop. Type its name to go on: "
    print(question, end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip() != name:
        raise InputError(f"--device {name} was not confirmed: nothing moved")
