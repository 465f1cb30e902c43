"""`twin plan`: nothing moves."""

from __future__ import annotations

import argparse
import json

from twin.commands.inputs import capacity_for, scene_of
from twin.commands.progress import compiling
from twin.plan import plan_run
from twin.plan_report import as_data, sentences


def run(options: argparse.Namespace) -> int:
    """Plan the scene, print it, draw it; 0 feasible as asked and the block stays up, 1 otherwise."""
    scene = scene_of(options)
    capacity = capacity_for(scene)
    with compiling(quiet=options.json):
        plan = plan_run(scene, capacity)
    if options.out is not None:
        from twin.plan_picture import draw_plan

        draw_plan(plan, options.out)
    if options.json:
        print(json.dumps(as_data(plan), indent=2, allow_nan=False))
    else:
        print("\n".join(sentences(plan)))
        if options.out is not None:
            print(f"picture    {options.out}")
    return 0 if plan.feasible and plan.stays_up else 1
