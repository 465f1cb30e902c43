"""What several commands begin with: the scene and the table's capacity, looked up by name."""

from __future__ import annotations

import argparse
import math
from collections.abc import Generator, Mapping
from contextlib import contextmanager

from devices.capacity_file import load_capacity, load_own_tables
from devices.catalogue import CatalogueEntry, find_device
from devices.errors import UnknownDevice
from devices.own_table import OwnNumbers
from excitation import Capacity
from twin.errors import InputError
from twin.scene import Scene, load_scene
from twin.text_file import read_text


def scene_of(options: argparse.Namespace) -> Scene:
    """Return the scene asked for, with the record of `--record` in it."""
    scene = load_scene(options.scene)
    if not math.isfinite(options.scale):
        raise InputError(f"--scale is {options.scale}; it must be finite")
    if options.record is not None:
        return scene.with_record(options.record, options.scale)
    if options.scale != 1.0:
        raise InputError("--scale belongs to a record: give --record too")
    return scene


def device_of(scene: Scene) -> CatalogueEntry:
    """Return the catalogue's entry of the scene's table; raises `InputError`."""
    try:
        return find_device(scene.table.device)
    except UnknownDevice as error:
        raise InputError(f"scene {scene.name}: table.device: {error}") from None


def capacity_for(scene: Scene) -> Capacity:
    """Return the capacity of the scene's table: its own file's, or the device's; raises `InputError`."""
    device = device_of(scene)
    if scene.table.capacity_file is None:
        return _placed(device.capacity, scene)
    with _file_of(scene) as text:
        return _placed(load_capacity(text, device.machine), scene)


def own_tables(scene: Scene) -> Mapping[str, Mapping[str, object]]:
    """Return what the scene's capacity file says beside the capacity; empty without one. Raises `InputError`."""
    if scene.table.capacity_file is None:
        return {}
    with _file_of(scene) as text:
        return load_own_tables(text)


def emulator_numbers(scene: Scene) -> OwnNumbers | None:
    """Return what the scene's emulated table is made of; None where its emulator has nothing to set.

    Raises
    ------
    InputError
        Where the table `[emulator]` of its capacity file makes no sense.
    """
    table = own_tables(scene).get("emulator", {})
    try:
        return device_of(scene).parameters(table)
    except ValueError as error:
        raise InputError(f"{scene.folder / (scene.table.capacity_file or '')}: {error}") from None


@contextmanager
def _file_of(scene: Scene) -> Generator[str]:
    """Hand out the text of the scene's capacity file; what is wrong with it is one sentence with its name."""
    path = scene.folder / (scene.table.capacity_file or "")
    try:
        yield read_text(path)
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None


def _placed(capacity: Capacity, scene: Scene) -> Capacity:
    """Return the capacity where the scene is: a mass falls with its gravity."""
    if capacity.machine is None:
        return capacity
    return capacity.model_copy(update={"machine": capacity.machine.in_gravity(scene.block.gravity_m_s2)})
