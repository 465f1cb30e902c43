"""`twin replay`: the recorded base motion through the live code again."""

from __future__ import annotations

import argparse
import json
import math
import sys
from pathlib import Path

from devices.clock import WallClock
from recordings.errors import RecordingError
from recordings.reader import read_run
from recordings.replay import LARGEST_DIFFERENCE, Replay, replay
from recordings.run import Run
from twin.commands.progress import Progress
from twin.errors import InputError
from twin.live import LiveTwin
from twin.scene import Scene, parse_scene_json


def run(options: argparse.Namespace) -> int:
    """Replay; 0 where the predictions agree with the recorded ones."""
    speed = options.speed
    if speed is not None and not (math.isfinite(speed) and speed > 0.0):
        raise InputError(f"--speed is {speed}; it must be above 0 (1 is real time)")
    try:
        recorded = read_run(options.file)
        scene = scene_in(recorded)
        twin = live_twin(scene)
        with Progress(float(recorded.cycles.time[-1]) if len(recorded.cycles) else 0.0, quiet=options.json) as progress:
            again = replay(
                recorded,
                twin,
                clock=None if speed is None else WallClock(),
                speed=speed or 1.0,
                each=None if speed is None else progress.show,
            )
    except RecordingError as error:
        raise InputError(str(error)) from None
    for problem in recorded.problems:
        print(f"note: {options.file}: {problem}", file=sys.stderr)
    if options.json:
        print(json.dumps(_data(options.file, recorded, again), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(options.file, recorded, again)))
    return 0 if again.agrees else 1


def scene_in(recorded: Run) -> Scene:
    """Return the scene a recording was made of; raises `InputError` where it has none."""
    stored = recorded.metadata.get("scene", {})
    if "json" not in stored:
        raise InputError(f"{recorded.path} does not say which scene it was made of, so it cannot be run again")
    return parse_scene_json(stored["json"], name=stored.get("name", "recorded"), folder=Path())


def live_twin(scene: Scene) -> LiveTwin:
    """Return the twin of a scene, before its first sample."""
    return LiveTwin(scene.block.block(), scene.block.restitution, math.radians(scene.block.initial_rotation_deg))


def _checked(again: Replay) -> str:
    if again.bits_checked:
        said = (
            "identical to the recorded ones, bit for bit" if again.identical else "NOT identical to the recorded ones"
        )
        return f"{said} (same versions and processor)"
    close = "within" if again.agrees else "NOT within"
    why = f"not compared bit for bit: {'; '.join(again.differs)}"
    return f"{close} {LARGEST_DIFFERENCE:g} rad of the recorded ones ({why})"


def _lines(path: Path, recorded: Run, again: Replay) -> list[str]:
    lines = [f"replayed   {path}: {len(recorded.cycles)} cycles"]
    lines.append(f"checked    predictions {_checked(again)}; largest change {again.largest_change:.3g} rad")
    lines.append(f"predicted  peak {again.predicted_peak:.4f} rad")
    if not math.isnan(again.measured_peak):
        lines.append(
            f"measured   peak {again.measured_peak:.4f} rad, largest difference {again.largest_difference:.4f} rad"
        )
    return lines


def _data(path: Path, recorded: Run, again: Replay) -> dict[str, object]:
    def number(value: float) -> float | None:
        return value if math.isfinite(value) else None

    return {
        "file": str(path),
        "complete": recorded.complete,
        "cycles": len(recorded.cycles),
        "agrees": again.agrees,
        "checked": "bits" if again.bits_checked else f"{LARGEST_DIFFERENCE:g} rad",
        "identical": again.identical,
        "differs": again.differs,
        "largest_change_rad": number(again.largest_change),
        "predicted_peak_rad": number(again.predicted_peak),
        "measured_peak_rad": number(again.measured_peak),
        "largest_difference_rad": number(again.largest_difference),
    }
