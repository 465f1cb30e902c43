"""The foresight of a recorded run, rebuilt from what the recording holds: to replay it, and to draw its futures."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from pydantic import TypeAdapter, ValidationError

from recordings.errors import RecordingError
from twin.errors import InputError
from twin.forecast.loop import TableLoop
from twin.foresight import Foresight, foresight
from twin.scene import parse_scene_json

FORESIGHT_METADATA = "foresight"
"""Metadata record: `loop` (how the table follows, as JSON), `stroke_m` and `acceleration_m_s2` of its capacity, and
`stoppable_until_s` where nothing stops the table from then on."""
MOST_PIECES = 1_000_000
_LOOP = TypeAdapter(TableLoop)


def foresight_metadata(
    loop: TableLoop, stroke: float, acceleration: float, until: float | None = None
) -> dict[str, str]:
    """Return the metadata record a run with foresight leaves; stroke m, acceleration m/s2, until s."""
    text = _LOOP.dump_json(loop).decode()
    told = {"loop": text, "stroke_m": repr(stroke), "acceleration_m_s2": repr(acceleration)}
    return told if until is None else {**told, "stoppable_until_s": repr(until)}


def foresight_of(metadata: Mapping[str, Mapping[str, str]]) -> Foresight | None:
    """Return the foresight of a run before its first sample; None where it had none.

    Raises
    ------
    RecordingError
        The recording says that there was one, but what it was made of cannot be used.
    """
    told = metadata.get(FORESIGHT_METADATA)
    if not told:
        return None
    try:
        loop = _LOOP.validate_json(told["loop"])
        stroke, acceleration = float(told["stroke_m"]), float(told["acceleration_m_s2"])
        until = float(told["stoppable_until_s"]) if "stoppable_until_s" in told else None
        rows = json.loads(metadata["excitation"]["motion_pieces"])
        if not isinstance(rows, list) or len(rows) > MOST_PIECES:  # pyright: ignore[reportUnknownArgumentType]
            raise ValueError("its motion is no list of pieces")
        pieces = np.asarray(rows, dtype=np.float64).reshape(-1, 7)
        if not np.all(np.isfinite(pieces)):
            raise ValueError("its motion is not finite")
        stored = metadata["scene"]
        scene = parse_scene_json(stored["json"], name=stored.get("name", "recorded"), folder=Path())
        return foresight(scene, pieces, stroke, acceleration, loop, until)
    except (KeyError, ValueError, ValidationError, InputError, RecursionError) as error:
        raise RecordingError(f"the forecast cannot be made again: {' '.join(str(error).split())}") from None
