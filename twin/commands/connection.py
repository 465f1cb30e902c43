"""Opening the table a run asks for: emulated in this process, emulated in another one, or real and confirmed."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np

from devices.catalogue import CatalogueEntry
from devices.cia402.buses import CanBus, open_bus
from devices.cia402.drive import DriveOptions
from devices.cia402.master import Cia402Table
from devices.errors import BusUnavailable, UnknownDevice
from devices.quanser_st3.emulator import EmulatedSt3
from excitation import Capacity
from twin.commands.inputs import device_of
from twin.errors import InputError, did_you_mean
from twin.scene import Scene
from twin.specimen import Specimen, specimen_of
from twin.stopping import longest_stop, stop_deceleration

EMULATOR = "emulator"
LOCAL_BUSES = ("virtual", "udp_multicast")
"""Buses on which an emulator may be assumed: nothing real hears them."""
RESERVED = ("interface", "bustype", "channel", "ignore_config", "config_context")
"""What --bus-option cannot set: other options of the command do, or nobody does."""


@dataclass(frozen=True, slots=True)
class Connection:
    """An opened table, and how the specimen on it is let go."""

    table: Cia402Table
    release: Callable[[], None]

    def frames(self) -> str:
        """Return what was heard on the bus that was no answer."""
        return str(self.table.counts)


@contextmanager
def connect(
    options: argparse.Namespace, scene: Scene, entry: CatalogueEntry, capacity: Capacity
) -> Generator[Connection]:
    """Open the table; raises `InputError` where it cannot be had, before anything moves."""
    cycle_time = 1.0 / scene.twin.cycle_hz
    with ExitStack() as stack:
        idle: Callable[[], None] | None = None
        release: Callable[[], None] = _nothing
        channel = None
        if options.bus == "virtual":
            channel = f"twin-{os.getpid()}"
            specimen = specimen_of(scene)
            other = stack.enter_context(bus_of(options, channel))
            # Host and drive run on one thread: where the computer stalls both do, and neither lost the other.
            emulator = emulate(entry, other, scene, capacity, specimen, shared_clock=True)
            idle, release = emulator.service, specimen.release
        bus = stack.enter_context(bus_of(options, channel))
        try:
            table = entry.open_table(
                bus,
                capacity=capacity,
                cycle_time=cycle_time,
                idle=idle,
                state_limit=max(3.0, 1.0 + longest_stop(scene, capacity)),
            )
        except BusUnavailable as error:
            raise InputError(str(error)) from None
        yield Connection(table, release)


def emulate(
    entry: CatalogueEntry,
    bus: CanBus,
    scene: Scene,
    capacity: Capacity,
    specimen: Specimen,
    *,
    shared_clock: bool = False,
) -> EmulatedSt3:
    """Return the scene's emulated table with its specimen, on a bus; `shared_clock` where the host is on this thread.

    Its quick stop is the scene's, as if object 6085 had been written. A drive in a process of its own has a clock of
    its own and stops after 20 ms without its host, as a real one does.
    """
    return entry.emulator(
        bus,
        rng=np.random.default_rng(scene.table.seed),
        specimen=specimen,
        set_up=specimen.set_up,
        options=DriveOptions(stop_deceleration=stop_deceleration(scene, capacity), shared_clock=shared_clock),
        capacity=capacity,
        cycle_time=1.0 / scene.twin.cycle_hz,
        initial_rotation=specimen.rotation,
        rotation_noise=scene.table.specimen.rotation_noise_rad,
    )


def emulated(scene: Scene) -> CatalogueEntry:
    """Return the scene's device where it has an emulator; raises `InputError` in one sentence otherwise."""
    entry = device_of(scene)
    try:
        _ = entry.emulator
    except UnknownDevice as error:
        raise InputError(f"scene {scene.name}: {error}") from None
    return entry


def device_for(options: argparse.Namespace, scene: Scene) -> CatalogueEntry:
    """Return the device of `--device`; raises `InputError`. A real one is still to be confirmed: `confirm`."""
    if options.device == EMULATOR:
        if options.bus not in LOCAL_BUSES:
            raise InputError(
                f"--bus {options.bus} may have a real table on it: name the table with --device {scene.table.device}"
            )
        if options.bus == "udp_multicast" and bus_arguments(options).get("hop_limit", 0) != 0:
            raise InputError(
                "--bus-option hop_limit opens the bus to the network, where a real table may be: "
                f"name the table with --device {scene.table.device}"
            )
        return emulated(scene)
    entry = device_of(scene)
    if options.device != entry.name:
        raise InputError(
            f"no device named {options.device!r} for this scene{did_you_mean(options.device, (EMULATOR, entry.name))}"
        )
    if not entry.has_driver:
        raise InputError(f"{entry.name} has no driver yet; it can only be planned for")
    if options.bus == "virtual":
        raise InputError(f"--device {entry.name} needs the bus it is on: give --bus (and --channel)")
    return entry


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


def bus_of(options: argparse.Namespace, channel: str | None = None) -> CanBus:
    """Open the bus of `--bus`, `--channel` and `--bus-option`; raises `InputError` where it cannot be had."""
    try:
        return open_bus(options.bus, options.channel or channel, **bus_arguments(options))
    except BusUnavailable as error:
        raise InputError(str(error)) from None


def bus_arguments(options: argparse.Namespace) -> dict[str, int | str]:
    """Return what `--bus-option` gives, whole numbers as such; raises `InputError`."""
    arguments: dict[str, int | str] = {}
    for text in options.bus_option:
        key, equals, value = text.partition("=")
        if not (key.isidentifier() and equals):
            raise InputError(f"--bus-option {text} is not KEY=VALUE")
        if key in RESERVED:
            instead = {"channel": "; give --channel", "interface": "; give --bus", "bustype": "; give --bus"}
            raise InputError(f"--bus-option cannot set {key}{instead.get(key, '')}")
        arguments[key] = int(value) if value.lstrip("-").isdecimal() else value
    return arguments


def _nothing() -> None:
    """Let go of nothing: whoever holds the specimen lets it go."""
