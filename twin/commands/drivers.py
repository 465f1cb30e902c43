"""Which of a device's drivers a command uses: CiA 402 on a bus, or another one that opens what it needs by itself."""

from __future__ import annotations

import argparse

from devices.catalogue import CIA402, CatalogueEntry
from devices.clock import Clock
from devices.errors import DeviceError
from devices.quanser_st3.hil_table import HilTable
from excitation import Capacity
from twin.commands.inputs import own_tables
from twin.errors import InputError, did_you_mean
from twin.scene import Scene
from twin.stopping import longest_stop, stop_deceleration


def driver_of(options: argparse.Namespace) -> str:
    """Return the driver asked for; commands without `--driver` speak CiA 402."""
    return str(getattr(options, "driver", CIA402))


def check_driver(options: argparse.Namespace, scene: Scene, entry: CatalogueEntry) -> None:
    """Raise `InputError` where a driver other than CiA 402 cannot be had here; nothing is opened."""
    name = driver_of(options)
    if name not in (known := entry.driver_names):
        raise InputError(f"{entry.name} has no driver {name!r}{did_you_mean(name, known)}; it has {', '.join(known)}")
    if options.bus != "virtual" or options.channel is not None or options.bus_option:
        raise InputError(f"--driver {name} is on no CAN bus: leave out --bus, --channel and --bus-option")
    try:
        entry.driver(name).check(own_tables(scene).get(name, {}))
    except (DeviceError, ValueError) as error:
        raise InputError(f"--driver {name}: {error}") from None


def open_driven(
    options: argparse.Namespace, scene: Scene, entry: CatalogueEntry, capacity: Capacity, clock: Clock | None
) -> HilTable:
    """Open the table of a driver other than CiA 402; raises `InputError`."""
    name = driver_of(options)
    if scene.table.patience_ms is not None:
        raise InputError(f"scene {scene.name}: table.patience_ms: --driver {name} has a watchdog of its own")
    try:
        return entry.driver(name).open_table(
            own_tables(scene).get(name, {}),
            capacity=capacity,
            cycle_time=1.0 / scene.twin.cycle_hz,
            clock=clock,
            state_limit=max(3.0, 1.0 + longest_stop(scene, capacity)),
            stop_deceleration=stop_deceleration(scene, capacity),
            following_error=scene.trips.following_error.limit_mm / 1e3,
        )
    except (DeviceError, ValueError) as error:
        raise InputError(f"--driver {name}: {error}") from None
