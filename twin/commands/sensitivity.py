"""`twin sensitivity`: what hangs on the model, the first tilt and the slenderness; nothing moves."""

from __future__ import annotations

import argparse
import json
import math

from twin.commands.inputs import scene_of
from twin.commands.progress import compiling
from twin.sensitivity.study import Settings, study_scene
from twin.sensitivity.words import as_data, study_lines


def run(options: argparse.Namespace) -> int:
    """Study the scene, print the conclusions, draw them; 0 done."""
    scene = scene_of(options)
    settings = Settings(
        cells=options.cells,
        sparse=options.quasi_linear,
        draws=options.draws,
        tilt_spread=_radians(options.tilt_spread),
        rate_spread=_radians(options.rate_spread),
        seed=options.seed,
    )
    with compiling(quiet=options.json):
        study = study_scene(scene, settings)
    if options.out is not None:
        from twin.sensitivity.picture import draw_study

        draw_study(study, options.out)
    if options.json:
        print(json.dumps(as_data(study), allow_nan=False))
    else:
        print("\n".join(study_lines(study)))
        if options.out is not None:
            print(f"picture    {options.out}")
    return 0


def _radians(degrees: float | None) -> float | None:
    return None if degrees is None else math.radians(degrees)
