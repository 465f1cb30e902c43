"""`twin plan`: nothing moves."""

from __future__ import annotations

import argparse
import json

from twin.commands.emulator_words import emulator_lines
from twin.commands.inputs import capacity_for, device_of, emulator_numbers, scene_of
from twin.commands.progress import compiling
from twin.commands.tuned_run import known_answers
from twin.plan import plan_run
from twin.plan_report import as_data, sentences


def run(options: argparse.Namespace) -> int:
    """Plan the scene, print it, draw it; 0 feasible as asked and the block stays up, 1 otherwise."""
    scene = scene_of(options)
    entry = device_of(scene)
    capacity = capacity_for(scene)
    emulator = emulator_lines(emulator_numbers(scene), scene, capacity)
    with compiling(quiet=options.json):
        plan = plan_run(scene, capacity, lambda rehearsal: known_answers(options.tuned, entry, rehearsal))
    if options.out is not None:
        from twin.plan_picture import draw_plan

        draw_plan(plan, options.out)
    if options.json:
        print(json.dumps({**as_data(plan), "emulator": emulator}, indent=2, allow_nan=False))
    else:
        *lines, verdict = sentences(plan)
        print("\n".join([*lines, *emulator, verdict]))
        if options.out is not None:
            print(f"picture    {options.out}")
    return 0 if plan.feasible and plan.stays_up else 1
