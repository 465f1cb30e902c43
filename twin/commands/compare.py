"""`twin compare`: two recordings, or prediction and measurement of one, impact by impact."""

from __future__ import annotations

import argparse
import json
import math

import numpy as np

from recordings.compare import Side, SignalName, compare, has_rotation, side_of
from recordings.compare_picture import draw_comparison
from recordings.compare_words import data, lines
from recordings.errors import RecordingError
from recordings.run import Run
from twin.commands.recording import block_in, open_recording
from twin.errors import InputError

AUTO = "auto"


def run(options: argparse.Namespace) -> int:
    """Compare; 0 whatever the difference is."""
    asked = _asked_shift(options.shift)
    first = open_recording(options.first)
    second = None if options.second is None else open_recording(options.second)
    try:
        sides = _one(first) if second is None else _two(first, second, options.signal)
        one_clock = second is None or np.array_equal(first.cycles.acceleration, second.cycles.acceleration)
        comparison = compare(*sides, shift=0.0 if one_clock and options.shift is None else asked)
        block = block_in(first)
        if options.out is not None:
            draw_comparison(comparison, options.out, block)
    except RecordingError as error:
        raise InputError(str(error)) from None
    if options.json:
        print(json.dumps({**data(comparison, block), **_files(options)}, indent=2, allow_nan=False))
    else:
        print("\n".join([*lines(comparison, block), *_picture(options)]))
    return 0


def _asked_shift(text: str | None) -> float | None:
    """Return the shift asked for, s; None where the impacts shall say it."""
    if text is None or text == AUTO:
        return None
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"--shift is {text!r}; it must be {AUTO} or a number of seconds")
    return value


def _one(run: Run) -> tuple[Side, Side]:
    if not has_rotation(run, "measured"):
        raise InputError(f"{run.path} has no measured rotation to compare its prediction with: give a second recording")
    return side_of(run, "measured", "measured"), side_of(run, "predicted", "predicted")


def _two(first: Run, second: Run, signal: SignalName | None) -> tuple[Side, Side]:
    chosen = signal or _signal(first, second)
    names = [run.path.stem for run in (first, second)]
    if names[0] == names[1]:
        names = [str(run.path) for run in (first, second)]
    one, two = (side_of(run, chosen, f"{name} ({chosen})") for run, name in zip((first, second), names, strict=True))
    return one, two


def _signal(first: Run, second: Run) -> SignalName:
    """Return measured where both have it; of a what-if, which keeps the measurement, the prediction."""
    if not (has_rotation(first, "measured") and has_rotation(second, "measured")):
        return "predicted"
    same = np.array_equal(first.cycles.rotation, second.cycles.rotation, equal_nan=True)
    return "predicted" if same else "measured"


def _files(options: argparse.Namespace) -> dict[str, object]:
    return {
        "files": [str(name) for name in (options.first, options.second) if name is not None],
        "picture": None if options.out is None else str(options.out),
    }


def _picture(options: argparse.Namespace) -> list[str]:
    return [] if options.out is None else [f"picture    {options.out}"]
