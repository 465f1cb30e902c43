"""Opening the table a run asks for: emulated in this process, emulated in another one, or real and confirmed."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Generator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass

import numpy as np

from devices.catalogue import CIA402, CatalogueEntry
from devices.cia301.buses import CanBus, open_bus
from devices.cia402.drive import DriveOptions
from devices.cia402.master import Cia402Table
from devices.clock import Clock, WallClock
from devices.emulation import Emulation
from devices.errors import BusUnavailable, UnknownDevice
from devices.faults.fault import Side
from devices.faults.injector import Injector
from devices.quanser_st3.hil_table import HilTable
from devices.released_table import ReleasedTable
from excitation import Capacity
from twin.commands.drivers import check_driver, driver_of, open_driven
from twin.commands.injection import Injection, injector_for, refuse_faults
from twin.commands.inputs import device_of, emulator_numbers
from twin.errors import InputError, did_you_mean
from twin.rehearsal import planned_settings
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
    """An opened table, how its specimen is let go, the scene's faults for the live loop, its clock, and its bus.

    `specimen` is what stands on a table emulated in this process.
    """

    table: Cia402Table | ReleasedTable | HilTable
    release: Callable[[], None]
    faults: Injection
    clock: Clock
    bus: CanBus | None = None
    specimen: Specimen | None = None

    def frames(self) -> str:
        """Return what was heard on the bus that was no answer."""
        return str(self.table.counts)


@contextmanager
def connect(
    options: argparse.Namespace,
    scene: Scene,
    entry: CatalogueEntry,
    capacity: Capacity,
    *,
    clock: Clock | None = None,
    empty: bool = False,
    payload: float | None = None,
) -> Generator[Connection]:
    """Open the table; raises `InputError` where it cannot be had, before anything moves.

    `clock` is that of host and emulator, the wall clock unless told. `empty` leaves the specimen off an emulated table,
    and its sensor unheard on any; `payload`, kg, is what an emulated table carries, the block's mass unless told.
    """
    cycle_time = 1.0 / scene.twin.cycle_hz
    with ExitStack() as stack:
        if driver_of(options) != CIA402:
            board = open_driven(options, scene, entry, capacity, clock)
            stack.callback(board.close)
            yield Connection(board, _nothing, Injection(None, board.clock), board.clock)
            return
        waiting = _patience(scene, entry)
        idle: Callable[[], None] | None = None
        specimen: Specimen | None = None
        channel = None
        sides: tuple[Side, ...] = ("host", "emulator") if options.bus == "virtual" else ("host",)
        injector = injector_for(scene, clock, *sides)
        if options.bus == "virtual":
            channel = f"twin-{os.getpid()}"
            specimen = None if empty else specimen_of(scene, capacity)
            other = stack.enter_context(bus_of(options, channel))
            emulator = emulate(
                entry,
                other,
                scene,
                capacity,
                specimen,
                shared_clock=True,
                clock=clock,
                injector=injector,
                payload=payload,
            )
            idle = emulator.service
        bus = stack.enter_context(bus_of(options, channel))
        if injector is not None:
            bus = injector.host_bus(bus, lambda: stack.enter_context(bus_of(options, channel)))
        try:
            table = entry.open_table(
                bus,
                capacity=capacity,
                cycle_time=cycle_time,
                clock=clock,
                idle=idle,
                rotation=not empty,
                state_limit=max(3.0, 1.0 + longest_stop(scene, capacity)),
                stop_deceleration=stop_deceleration(scene, capacity),
                following_error=scene.trips.following_error.limit_mm / 1e3,
                **waiting,
            )
        except BusUnavailable as error:
            raise InputError(str(error)) from None
        release = _nothing if specimen is None else specimen.release
        yield Connection(table, release, Injection(injector, clock), clock or WallClock(), bus, specimen)


def emulate(
    entry: CatalogueEntry,
    bus: CanBus,
    scene: Scene,
    capacity: Capacity,
    specimen: Specimen | None,
    *,
    shared_clock: bool = False,
    clock: Clock | None = None,
    injector: Injector | None = None,
    payload: float | None = None,
) -> Emulation:
    """Return the scene's emulated table with its specimen, on a bus; `shared_clock` where the host is on this thread.

    Host and drive then stand still together where the computer stalls, and neither lost the other. A drive in a process
    of its own has a clock of its own and stops after its patience without its host, as a real one does; so does one
    with faults. Its quick stop is the scene's, as if object 6085 had been written; a released machine is set as
    planned.
    """
    own: dict[str, object] = {}
    if (numbers := emulator_numbers(scene)) is not None:
        own["parameters"] = numbers
    together = shared_clock and injector is None
    if capacity.machine is None:
        own["options"] = DriveOptions(stop_deceleration=stop_deceleration(scene, capacity), shared_clock=together)
    else:
        own |= {"settings": planned_settings(scene, capacity), "shared_clock": together}
    emulator = entry.emulator(
        bus if injector is None else injector.node_bus(bus),
        rng=np.random.default_rng(scene.table.seed),
        specimen=specimen,
        set_up=None if specimen is None else specimen.set_up,
        capacity=capacity,
        cycle_time=1.0 / scene.twin.cycle_hz,
        clock=clock,
        initial_rotation=0.0 if specimen is None else specimen.rotation,
        rotation_noise=scene.table.specimen.rotation_noise_rad,
        payload=(scene.block.mass_kg or 0.0) if payload is None else payload,
        **own,
    )
    if injector is not None:
        injector.take_over(emulator, host_here=shared_clock)
        if specimen is not None:
            injector.when("specimen_pushed", lambda fault: specimen.push(fault.magnitude))
    return emulator


def emulated(scene: Scene) -> CatalogueEntry:
    """Return the scene's device where it has an emulator; raises `InputError` in one sentence otherwise."""
    entry = device_of(scene)
    try:
        _ = entry.emulator
    except UnknownDevice as error:
        raise InputError(f"scene {scene.name}: {error}") from None
    return entry


def device_for(options: argparse.Namespace, scene: Scene) -> CatalogueEntry:
    """Return the device of `--device`; raises `InputError`. A real one is still to be armed."""
    if options.device == EMULATOR:
        if driver_of(options) != CIA402:
            raise InputError(
                f"--driver {driver_of(options)} is for a real table, the emulator speaks {CIA402}: "
                f"name the table with --device {scene.table.device}"
            )
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
    refuse_faults(scene, entry.name)
    if not entry.has_driver:
        raise InputError(f"{entry.name} has no driver yet; it can only be planned for")
    if driver_of(options) != CIA402:
        check_driver(options, scene, entry)
    elif options.bus == "virtual":
        raise InputError(f"--device {entry.name} needs the bus it is on: give --bus (and --channel)")
    return entry


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


def _patience(scene: Scene, entry: CatalogueEntry) -> dict[str, float]:
    """Return how long host and drive wait for each other, where the scene says so; raises `InputError`."""
    if scene.table.patience_ms is None:
        return {}
    if entry.capacity.machine is not None:
        raise InputError(f"scene {scene.name}: table.patience_ms: the nodes of {entry.name} cannot be told")
    patience = scene.table.patience_ms / 1e3
    return {"time_limit": patience, "patience": patience}


def _nothing() -> None:
    """Let go of nothing: whoever holds the specimen lets it go."""
