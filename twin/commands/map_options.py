"""What the options of `twin map` ask, as a `Question`."""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable
from pathlib import Path

from twin.errors import InputError, did_you_mean
from twin.map.axis import GAP_UNITS, VELOCITY_UNITS, amplitude_units, frequency_units, length_units, read_axis
from twin.map.blocks import Question
from twin.map.grid import CONSTANT, COSINE, DOUBLE_PULSE, KINDS, LASTING_SINE, SINE, make_grid
from twin.map.overturning import checked
from twin.rocking.methods import METHODS, MODELS
from twin.rocking.models.ladder import AUTO
from twin.rocking.restitution import Improved, Restitution
from twin.scene import Scene
from twin.scene_parts import DoublePulsePart

DEFAULTS = {
    "amplitude": "0.1:10:100",
    "frequency": "0.1:10:100",
    "length": "0.05:5:100",
    "velocity": "0.01:1:100",
    "gap": "2:200:100mm",
}
"""Axes that are not given."""
WAVE_AXES = ("amplitude", "frequency")
AXES = {
    SINE: WAVE_AXES,
    COSINE: WAVE_AXES,
    LASTING_SINE: WAVE_AXES,
    CONSTANT: ("amplitude", "length"),
    DOUBLE_PULSE: ("velocity", "gap"),
}


def question_of(options: argparse.Namespace, scene: Scene) -> Question:
    """Return what is asked of the scene's block; raises `InputError` in one sentence."""
    kind = _kind(options, scene)
    for name in DEFAULTS:
        if getattr(options, name) is not None and name not in AXES[kind]:
            raise InputError(f"--{name} is no axis of a {kind} map; its axes are --{' and --'.join(AXES[kind])}")
    block = scene.block.block()
    units = {
        "amplitude": amplitude_units(block),
        "frequency": frequency_units(block),
        "length": length_units(block),
        "velocity": VELOCITY_UNITS,
        "gap": GAP_UNITS,
    }
    names = {
        "amplitude": "amplitudes",
        "frequency": "frequencies",
        "length": "durations",
        "velocity": "peak_velocities",
        "gap": "stop_gaps",
    }
    axes = {names[axis]: read_axis(f"--{axis}", _text(options, axis), units[axis]) for axis in AXES[kind]}
    if kind == LASTING_SINE and options.duration is None:
        raise InputError("a lasting sine needs --duration, in s")
    if kind != LASTING_SINE and options.duration is not None:
        raise InputError(f"--duration is the length of a lasting sine; a map of kind {kind} has none")
    tilt = scene.block.initial_rotation_deg if options.initial_tilt is None else options.initial_tilt
    own = scene.excitation if isinstance(scene.excitation, DoublePulsePart) else None
    try:
        grid = make_grid(
            block,
            kind,
            **axes,
            duration=options.duration,
            rebound=0.0 if own is None else own.rebound,
            pulse_acceleration=100.0 if own is None else own.pulse_acceleration_m_s2,
        )
        return checked(
            Question(
                grid,
                restitution=_restitution(options.restitution, scene),
                method=_known("--method", options.method, METHODS),
                model=_known("--model", options.model, (*MODELS, AUTO)),
                initial_rotation=math.radians(tilt),
                times=options.full,
                peaks=options.full,
            )
        )
    except ValueError as error:
        raise InputError(str(error)) from None


def export_path(path: Path) -> Path:
    """Return `path` itself; raises `InputError` where its ending is none of a map's."""
    if path.suffix.lower() not in (".npz", ".csv"):
        raise InputError(f"--out {path}: a map ends in .npz or .csv")
    return path


def _text(options: argparse.Namespace, axis: str) -> str:
    given = getattr(options, axis)
    return DEFAULTS[axis] if given is None else given


def _kind(options: argparse.Namespace, scene: Scene) -> str:
    """Return the kind asked for, or that of the scene's excitation where there are maps of it, or a sine."""
    asked = scene.excitation.kind if options.kind is None else options.kind
    kind = asked.replace("_", " ").replace("-", " ")
    if kind in KINDS:
        return kind
    if options.kind is None:
        return SINE
    raise InputError(f"--kind is {asked!r}{did_you_mean(kind, KINDS)}")


def _known(flag: str, name: str | None, known: Iterable[str]) -> str | None:
    if name is None or name in known:
        return name
    raise InputError(f"{flag} is {name!r}{did_you_mean(name, known)}")


def _restitution(text: str | None, scene: Scene) -> Restitution:
    """Return what --restitution says: a number, improved:K, housner; or the scene's."""
    if text is None:
        return scene.block.restitution
    if text == "housner":
        return None
    try:
        return Improved(float(text.removeprefix("improved:"))) if text.startswith("improved:") else float(text)
    except ValueError as error:
        reason = f": {error}" if "half width" in str(error) else ""
        raise InputError(f"--restitution is {text!r}; give a number, improved:K or housner{reason}") from None
