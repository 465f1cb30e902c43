"""`twin calibrate`: a block as its free rocking, or the outcomes of its trials, say it is."""

from __future__ import annotations

import argparse
import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from recordings.errors import RecordingError
from recordings.import_map import parse_map
from recordings.import_table import TextTable, read_table, read_text
from recordings.importing import measured_in
from twin.calibration.calibrate import Calibration, calibrate
from twin.calibration.contact import Contact, compare_contact
from twin.calibration.free_part import free_part
from twin.calibration.outcomes import fit_outcomes, names_outcomes, outcome_lines, read_trials
from twin.calibration.outcomes.picture import draw_outcomes
from twin.calibration.picture import ENDINGS, draw_calibration
from twin.calibration.words import data, lines, scene_lines
from twin.commands.progress import compiling
from twin.commands.recording import block_in, open_recording
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking_data.noise import FloatArray
from twin.scene import load_scene

TABLES = (".csv", ".txt", ".tsv", ".asc", ".dat")
ROTATIONS = {"rotation_rad": "rad", "rotation_mrad": "mrad", "rotation_deg": "deg"}
STANDARD_GRAVITY = 9.81


@dataclass(frozen=True, eq=False)
class Rotations:
    """A rotation over time, the base acceleration where it is known (else NaN), and the block of its scene."""

    time: FloatArray
    rotation: FloatArray
    acceleration: FloatArray
    block: Block | None


def run(options: argparse.Namespace) -> int:
    """Calibrate; 0 where the block rocks as a rigid one, 1 where the data show something else."""
    if options.out is not None and options.out.suffix.lower() not in ENDINGS:
        raise InputError(f"--out {options.out}: a picture ends in .png, .svg or .pdf")
    path = Path(options.file)
    try:
        if path.suffix.lower() == ".csv" and names_outcomes(text := read_text(path)):
            return _outcomes(options, text)
        found, read = _calibrated(options, options.file)
        heads, ends = [read], list[str]()
        contact: Contact | None = None
        if options.edge is not None:
            edge, read = _calibrated(options, options.edge)
            contact = compare_contact(found, edge)
            heads.append(read)
    except RecordingError as error:
        raise InputError(str(error)) from None
    if options.out is not None:
        draw_calibration(found, options.out, f"free rocking: {path.name}", contact)
        ends.append(f"picture    {options.out}")
    scene = scene_lines(found)
    if options.scene_out not in (None, "-"):
        _written(Path(options.scene_out), scene)
        ends.append(f"scene      {options.scene_out}")
    if options.json:
        print(json.dumps({"file": options.file, **data(found, contact), "scene": scene}, indent=2, allow_nan=False))
    else:
        print("\n".join([*heads, *lines(found, contact), *ends]))
        if options.scene_out == "-":
            print("\n".join(["", *scene]))
    return 1 if found.suspicions else 0


def _outcomes(options: argparse.Namespace, text: str) -> int:
    gravity = STANDARD_GRAVITY if options.scene is None else load_scene(options.scene).block.gravity_m_s2
    trials = read_trials(text, gravity=gravity)
    with compiling(quiet=options.json):
        fit = fit_outcomes(trials, gravity=gravity, seed=options.seed)
    if options.out is not None:
        draw_outcomes(fit, options.out)
    print(json.dumps(fit.as_data(), indent=2, allow_nan=False) if options.json else "\n".join(outcome_lines(fit)))
    return 0 if fit.trustworthy else 1


def _calibrated(options: argparse.Namespace, name: str) -> tuple[Calibration, str]:
    """Return the calibration of one file, and the line that says what was read."""
    read = _table(options, Path(name)) if Path(name).suffix.lower() in TABLES else _recording(name)
    nominal, gravity = _nominal(options, read.block)
    kept = np.isfinite(read.time)
    kept &= read.time >= (-math.inf if options.begin is None else options.begin)
    kept &= read.time <= (math.inf if options.end is None else options.end)
    time, rotation, acceleration = read.time[kept], read.rotation[kept], read.acceleration[kept]
    if np.count_nonzero(np.isfinite(rotation)) < 2:
        raise InputError(
            f"{name} has no measured rotation{' between --from and --to' if time.size < kept.size else ''}"
        )
    part = free_part(time, rotation, acceleration, gravity)
    inside = (time >= part.begin) & (time <= part.end)
    found = calibrate(
        time[inside],
        rotation[inside],
        nominal=nominal,
        spread=None if options.geometry_percent is None else 0.01 * options.geometry_percent,
        fixed=frozenset(options.fix),
        gravity=gravity,
    )
    rate = 1.0 / float(np.median(np.diff(time)))
    cut = f"; free of shaking from {part.begin:.3f} to {part.end:.3f} s" if part.shaken else ""
    if not np.any(np.isfinite(read.acceleration)):
        cut = "; the base is taken to stand still: its motion is not in the file"
    head = f"read       {name}: {np.count_nonzero(np.isfinite(rotation))} samples at {rate:.6g} Hz, noise "
    return found, f"{head}{1e3 * found.fit.white:.3g} mrad{cut}"


def _recording(name: str) -> Rotations:
    run_ = open_recording(name)
    cycles = run_.cycles
    forward = np.concatenate([[True], np.diff(np.maximum.accumulate(cycles.time)) > 0.0])[: len(cycles)]
    return Rotations(
        cycles.time[forward], cycles.rotation[forward], cycles.acceleration[forward], block_in(run_)
    )  # fmt: skip


def _table(options: argparse.Namespace, path: Path) -> Rotations:
    table = read_table(read_text(path), str(path), separator=options.separator, decimal=options.decimal)
    entries = parse_map(options.map or [_usual_map(table, path)])
    gravity = STANDARD_GRAVITY if options.scene is None else load_scene(options.scene).block.gravity_m_s2
    measured = measured_in(table, entries, str(path), gravity=gravity)
    acceleration = measured.acceleration
    if not {"acceleration", "displacement"} & set(entries) and not any(name.startswith("base") for name in entries):
        acceleration = np.full(measured.cycle.size, np.nan)
    start = 0.0
    if "time" in entries:
        from recordings.import_map import column_of

        start = float(column_of(entries["time"], table, str(path), gravity)[0])
    return Rotations(start + measured.cycle.astype(np.float64) * measured.step, measured.rotation, acceleration, None)


def _usual_map(table: TextTable, path: Path) -> str:
    """Return the map of a table whose columns have the names that say it."""
    heads = {head for column in table.names for head in column}
    rotation = next((name for name in ROTATIONS if name in heads), None)
    if rotation is None or "time_s" not in heads:
        raise InputError(
            f'{path} is a table: say with --map which column is what, as in --map "time=t[s] rotation=phi[deg]"'
        )
    return f"time=time_s[s] rotation={rotation}[{ROTATIONS[rotation]}]"


def _nominal(options: argparse.Namespace, recorded: Block | None) -> tuple[Block | None, float]:
    """Return the nominal block, if any, and gravity, m/s2; raises `InputError` where the options contradict."""
    block = recorded if options.scene is None else load_scene(options.scene).block.block()
    gravity = STANDARD_GRAVITY if block is None else block.gravity
    if (options.width_mm is None) != (options.height_mm is None):
        raise InputError("--width-mm and --height-mm belong together")
    if options.width_mm is not None:
        try:
            block = Block(1e-3 * options.width_mm, 1e-3 * options.height_mm, gravity=gravity)
        except ValidationError:
            raise InputError(
                f"--width-mm {options.width_mm:g} and --height-mm {options.height_mm:g} must be above 0"
            ) from None
    percent = options.geometry_percent
    if percent is not None and not (math.isfinite(percent) and percent > 0.0):
        raise InputError(f"--geometry-percent is {percent:g}; it must be above 0")
    if block is None and (options.fix or percent is not None):
        raise InputError("--fix and --geometry-percent need the nominal block: --width-mm and --height-mm, or --scene")
    return block, gravity


def _written(path: Path, scene: list[str]) -> None:
    try:
        path.write_text("\n".join([*scene, ""]), encoding="utf-8")
    except OSError as error:
        raise InputError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
