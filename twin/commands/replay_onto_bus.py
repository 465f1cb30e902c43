"""`twin replay --to-bus`: the recorded cycles as CAN frames for other tools to listen to."""

from __future__ import annotations

import argparse
import json
import sys

from devices.errors import DeviceError
from recordings.bus_replay import play_on_bus
from recordings.run import Run
from twin.commands.connection import bus_arguments, bus_of
from twin.commands.player import Player
from twin.errors import InputError

LISTEN = 0.3
"""How long the bus must have been silent before anything is sent, s: three heartbeats, 300 cycles."""


def onto_bus(options: argparse.Namespace, recorded: Run, player: Player) -> int:
    """Send every recorded cycle; 0 where the whole run was sent."""
    options.bus = options.to_bus
    _confirm(options)
    with bus_of(options) as bus:
        try:
            if bus.receive(LISTEN) is not None:
                raise InputError(f"--to-bus: somebody else is talking on {bus}; a replay wants a bus of its own")
            if not options.json:
                print(f"sending    {recorded.path} to {bus}; target frames say 'disable voltage'", flush=True)
            sent = play_on_bus(recorded, bus.send, pace=player.pace, each=player.show)
        except DeviceError as error:
            raise InputError(str(error)) from None
        name = str(bus)
    player.clear()
    whole = sent.cycles == len(recorded.cycles)
    if options.json:
        said = {"file": str(recorded.path), "bus": name, "cycles": sent.cycles, "frames": sent.frames, "whole": whole}
        print(json.dumps(said, indent=2))
    else:
        print(f"sent       {sent.cycles} of {len(recorded.cycles)} cycles, {sent.frames} frames")
    return 0 if whole else 1


def _confirm(options: argparse.Namespace) -> None:
    """Ask where a real table may be listening; a bus inside this machine needs no answer."""
    interface, channel = options.to_bus, options.channel
    if interface == "virtual":
        raise InputError("--to-bus virtual ends at this process, and nobody could listen: use udp_multicast")
    local = interface == "udp_multicast" and bus_arguments(options).get("hop_limit", 0) == 0
    if local or (interface == "socketcan" and str(channel).startswith("vcan")):
        return
    where = str(channel or interface)
    if not sys.stdin.isatty():
        raise InputError(f"--to-bus {interface} may have a real table on it: it is confirmed at a terminal only")
    question = f"Frames of a replay go onto {where}, where no drive may be powered. Type {where} to go on: "
    print(question, end="", file=sys.stderr, flush=True)
    if sys.stdin.readline().strip() != where:
        raise InputError(f"--to-bus {interface} was not confirmed: nothing was sent")
