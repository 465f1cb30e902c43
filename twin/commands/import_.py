"""`twin import`: what another system measured, as a recording."""

from __future__ import annotations

import argparse
import hashlib
import json
import math
from pathlib import Path

import numpy as np

from excitation.accelerogram import parse_at2
from recordings.errors import RecordingError
from recordings.geometry import Geometry
from recordings.import_map import parse_map
from recordings.import_run import write_import
from recordings.import_table import read_table, read_text
from recordings.importing import BANDWIDTH, LARGEST_ACCELERATION, Measured, measured_in
from twin.commands.recording import live_twin
from twin.errors import InputError
from twin.provenance import processor, versions
from twin.rocking.track import warm_up
from twin.scene import Scene, load_scene

AT2 = ".at2"


def run(options: argparse.Namespace) -> int:
    """Write the recording; 0 where it is written."""
    path: Path = options.out or Path(f"{options.file.stem}.mcap")
    if path.suffix.lower() != ".mcap":
        raise InputError(f"--out {path}: a recording ends in .mcap")
    scene = load_scene(options.scene)
    warm_up()
    try:
        text = read_text(options.file)
        if options.file.suffix.lower() == AT2:
            measured, scene = _at2(options, scene, text)
        else:
            measured = _table(options, scene, text)
        block = scene.block.block()
        start = options.file.stat().st_mtime_ns
        metadata = _metadata(options, scene, measured, text)
        cycles = write_import(measured, live_twin(scene), path, metadata, Geometry(block.width, block.height), start)
    except RecordingError as error:
        raise InputError(str(error)) from None
    except OSError as error:
        raise InputError(f"{options.file} cannot be read: {(error.strerror or str(error)).lower()}") from None
    predicted = float(np.max(np.abs(cycles.predicted_rotation)))
    if options.json:
        said = {"file": str(options.file), "recording": str(path), "samples": len(cycles), "step_s": measured.step}
        print(json.dumps({**said, "predicted_peak_rad": predicted, "how": measured.words}, indent=2))
    else:
        print(f"imported   {options.file}")
        print("\n".join(f"           {words}" for words in measured.words))
        print(f"predicted  peak {predicted:.4f} rad, of the block of {scene.name}")
        print(f"recording  {path}")
    return 0


def _table(options: argparse.Namespace, scene: Scene, text: str) -> Measured:
    if not options.map:
        raise InputError(f'{options.file} is a table: say with --map which column is what, as in --map "time=t[s] ..."')
    if options.scale != 1.0:
        raise InputError("--scale belongs to an AT2 record")
    bandwidth = BANDWIDTH if options.bandwidth is None else options.bandwidth
    if not (math.isfinite(bandwidth) and bandwidth > 0.0):
        raise InputError(f"--bandwidth is {bandwidth:g} Hz; it must be above 0")
    entries = parse_map(options.map)
    name = str(options.file)
    table = read_table(text, name, separator=options.separator, decimal=options.decimal)
    return measured_in(table, entries, name, gravity=scene.block.gravity_m_s2, bandwidth=bandwidth)


def _at2(options: argparse.Namespace, scene: Scene, text: str) -> tuple[Measured, Scene]:
    if options.map or options.separator or options.decimal or options.bandwidth is not None:
        raise InputError("an AT2 record says itself what is in it: --map, --bandwidth and the like belong to tables")
    if not math.isfinite(options.scale):
        raise InputError(f"--scale is {options.scale}; it must be finite")
    try:
        record = parse_at2(text)
    except ValueError as error:
        raise InputError(f"{options.file}: {error}") from None
    count = len(record.samples)
    acceleration = record.samples * (scene.block.gravity_m_s2 * options.scale)
    if not np.all(np.abs(acceleration) <= LARGEST_ACCELERATION):
        raise InputError(f"{options.file} shakes with more than {LARGEST_ACCELERATION:g} m/s2: is --scale right?")
    blank = np.full(count, np.nan)
    words = [f"{count} samples at {1.0 / record.time_step:.6g} Hz: {record.name}"]
    words.append(f"acceleration: the record, times {options.scale:g}, linear between its samples")
    measured = Measured(np.arange(count, dtype=np.int64), record.time_step, blank, acceleration, blank.copy(), words)
    return measured, scene.with_record(options.file, options.scale)


def _metadata(options: argparse.Namespace, scene: Scene, measured: Measured, text: str) -> dict[str, dict[str, str]]:
    return {
        "scene": {"name": scene.name, "title": scene.title, "json": scene.model_dump_json()},
        "import": {
            "file": options.file.name,
            "sha256_of_text": hashlib.sha256(text.encode()).hexdigest(),
            "map": " ".join(options.map),
            "how": "\n".join(measured.words),
            "host_clock": "unknown: log times count from the file's own date",
        },
        "versions": versions(),
        "processor": processor(),
    }
