"""What several commands begin with: the scene and the table's capacity, looked up by name."""

from __future__ import annotations

import argparse
import math

from devices.capacity_file import load_capacity
from devices.catalogue import CatalogueEntry, find_device
from devices.errors import UnknownDevice
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
    known = device_of(scene).capacity
    if scene.table.capacity_file is None:
        return known
    path = scene.folder / scene.table.capacity_file
    try:
        return load_capacity(read_text(path))
    except InputError:
        raise
    except ValueError as error:
        raise InputError(f"{path}: {error}") from None
