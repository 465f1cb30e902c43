"""`twin devices check`: one machine is asked who it is; nothing moves and nothing is enabled."""

from __future__ import annotations

import argparse
import json
import os
from collections.abc import Callable
from contextlib import ExitStack

import numpy as np

from devices.catalogue import CatalogueEntry, find_device
from devices.cia301.buses import CanBus
from devices.cia301.frames import SYNC
from devices.clock import Clock, WallClock
from devices.errors import DeviceError, DeviceTimeout
from devices.sample import Description
from devices.table import ShakeTable
from twin.commands.connection import bus_of
from twin.errors import InputError

EMULATED = "emulated"
"""The hardware version of an emulated node (object 1009)."""
LISTENED = 0.3
"""Time a bus is listened to before anything is sent on it, s: many cycles of a host that runs the table already."""


def check(options: argparse.Namespace) -> int:
    """Report what the device says of itself; raises `InputError` where nobody answers."""
    try:
        entry = find_device(options.name)
        with ExitStack() as stack:
            table, asked = _open(options, entry, stack)
            stack.enter_context(table)
            nodes = table.describe()
            position = table.position
            origin = "the centre of the stroke" if table.follows_setpoints else "where the base is held"
    except DeviceError as error:
        raise InputError(str(error)) from None
    emulated = all(node.hardware == EMULATED for node in nodes)
    if options.json:
        said = {
            "device": entry.name,
            "asked": asked,
            "emulated": emulated,
            "position_m": position,
            "nodes": [_data(node) for node in nodes],
        }
        print(json.dumps(said, indent=2, allow_nan=False))
    else:
        says = "; emulated, as it says itself" if emulated and options.bus != "virtual" else ""
        lines = [f"device     {entry.name}: {entry.description}", f"asked      {asked}{says}"]
        lines += [line for node in nodes for line in _lines(node)]
        lines.append(f"position   {position * 1e3:.3f} mm from {origin}")
        lines.append("answers    yes; nothing moved, nothing was enabled")
        print("\n".join(lines))
    return 0


def _open(options: argparse.Namespace, entry: CatalogueEntry, stack: ExitStack) -> tuple[ShakeTable, str]:
    """Open the table, and say who was asked."""
    if options.bus != "virtual":
        bus = stack.enter_context(bus_of(options))
        _listen(bus, WallClock())
        return _opened(entry, bus, None), f"whoever is on {bus}"
    channel = f"check-{os.getpid()}"
    node, host = (stack.enter_context(bus_of(options, channel)) for _ in range(2))
    emulator = entry.emulator(node, rng=np.random.default_rng(1), specimen=_standing)
    return _opened(entry, host, emulator.service), "THE EMULATED ONE, in this process: no real device was asked"


def _standing(duration: float, start: float, end: float) -> float:  # noqa: ARG001 - a specimen's signature
    """Return the rotation of a specimen that does not rock, rad."""
    return 0.0


def _opened(entry: CatalogueEntry, bus: CanBus, idle: Callable[[], None] | None) -> ShakeTable:
    alone = entry.open_table(bus, capacity=entry.capacity, idle=idle, rotation=False)
    try:
        return entry.open_table(bus, capacity=entry.capacity, idle=idle, rotation=True)
    except DeviceTimeout:
        # A table need not have a sensor of the specimen.
        return alone


def _listen(bus: CanBus, clock: Clock) -> None:
    """Hear for a while who is there; raises `InputError` where a host runs the table: two of them would stop it."""
    end = clock.now() + LISTENED
    while (left := end - clock.now()) > 0.0:
        frame = bus.receive(left)
        if frame is not None and frame[0] == SYNC:
            raise InputError(f"a host is running a table on {bus}: its SYNC is heard, and nothing was sent")


def _lines(node: Description) -> list[str]:
    place = "" if node.node is None else f"node {node.node}"
    identity = f"vendor {node.vendor:X}, product {node.product:X}, revision {node.revision:X}, serial {node.serial}"
    versions = f"hardware {node.hardware or 'untold'}, software {node.software or 'untold'}"
    mode = f", mode {node.mode}" if node.mode else ""
    return [
        f"{place:<11}{node.what}: {node.name or 'without a name'}, {versions}; {identity}",
        f"{'':<11}state {node.state}{mode}",
    ]


def _data(node: Description) -> dict[str, object]:
    return {name: getattr(node, name) for name in node.__slots__}
