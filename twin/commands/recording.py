"""What the commands that read a recording begin with: the file, or a sample that ships, and what it says of itself."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path
from typing import Any, cast

from pydantic import ValidationError

from recordings.errors import RecordingError
from recordings.reader import read_run
from recordings.run import Run
from recordings.samples import sample_names, sample_path
from twin.errors import InputError, did_you_mean
from twin.foresight import Foresight
from twin.live_twin import LiveTwin
from twin.rocking.block import Block
from twin.scene import Scene, parse_scene_json


def recording_path(name: str) -> Path:
    """Return the path of a recording: a file, or the name of a sample that ships; raises `InputError`."""
    path = Path(name)
    if path.suffix or len(path.parts) > 1 or path.exists():
        return path
    known = sample_names()
    if name not in known:
        raise InputError(f"there is no file {name}, and no sample of that name{did_you_mean(name, known)}")
    return sample_path(name)


def open_recording(name: str) -> Run:
    """Read a recording and say on stderr what is wrong with it; raises `InputError` where it cannot be read."""
    path = recording_path(name)
    try:
        run = read_run(path)
    except RecordingError as error:
        raise InputError(str(error)) from None
    for problem in run.problems:
        print(f"note: {path}: {problem}", file=sys.stderr)
    if run.unknown:
        print(f"note: {path}: topics of a newer version are passed over: {', '.join(run.unknown)}", file=sys.stderr)
    return run


def scene_in(recorded: Run) -> Scene:
    """Return the scene a recording was made of; raises `InputError` where it has none.

    Keys that this version's scenes do not have (any more) are left out, and said on stderr: a prediction is made from
    the block alone, and a recording must be read for years.
    """
    stored = recorded.metadata.get("scene", {})
    if "json" not in stored:
        raise InputError(f"{recorded.path} does not say which scene it was made of, so it cannot be run again")
    text, unknown = _known_keys(stored["json"])
    if unknown:
        print(f"note: {recorded.path}: its scene has keys unknown here: {', '.join(unknown)}", file=sys.stderr)
    return parse_scene_json(text, name=stored.get("name", "recorded"), folder=Path())


def block_in(recorded: Run) -> Block | None:
    """Return the block of a recording's scene; None where it says none that can be used."""
    if "json" not in recorded.metadata.get("scene", {}):
        return None
    try:
        return scene_in(recorded).block.block()
    except InputError:
        return None


def live_twin(scene: Scene, foresight: Foresight | None = None) -> LiveTwin:
    """Return the twin of a scene, before its first sample."""
    tilt = math.radians(scene.block.initial_rotation_deg)
    return LiveTwin(scene.block.block(), scene.block.restitution, tilt, foresight)


def _known_keys(text: str) -> tuple[str, list[str]]:
    """Return a scene's JSON without the keys that no scene has, and their names."""
    try:
        Scene.model_validate_json(text)
    except ValidationError as error:
        faults = [fault["loc"] for fault in error.errors(include_url=False) if fault["type"] == "extra_forbidden"]
    else:
        return text, []
    try:
        tables = json.loads(text)
    except ValueError:
        return text, []
    unknown: list[str] = []
    for place in faults:
        # Of an excitation the place also names its kind.
        path = [name for name in place if not (name == tables.get("excitation", {}).get("kind") and place[0] != name)]
        table: Any = tables
        for name in path[:-1]:
            table = cast("Any", table).get(name, {}) if isinstance(table, dict) else {}
        if isinstance(table, dict) and cast("dict[str, Any]", table).pop(str(path[-1]), None) is not None:
            unknown.append(".".join(map(str, path)))
    return json.dumps(tables), unknown
