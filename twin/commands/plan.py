"""`twin plan`: nothing moves."""

from __future__ import annotations

import argparse
import json
from datetime import UTC, datetime

from twin.campaign import is_campaign
from twin.commands.emulator_words import emulator_lines
from twin.commands.inputs import capacity_for, device_of, emulator_numbers, scene_of
from twin.commands.mechanics import mechanics_of
from twin.commands.progress import compiling
from twin.commands.table_response import response_of
from twin.commands.tuned_run import known_answers
from twin.errors import InputError
from twin.plan import plan_run
from twin.plan_data import as_data
from twin.plan_page.origin import origin_of
from twin.plan_page.page import check_ending, write_page
from twin.plan_report import sentences


def run(options: argparse.Namespace) -> int:
    """Plan the scene, or what else is asked, and print it; 0 feasible as asked and the block stays up, 1 otherwise."""
    if is_campaign(options.scene):
        from twin.commands.plan_campaign import plan_campaign

        return plan_campaign(options)
    if options.find is not None:
        from twin.commands.plan_find import find

        return find(options)
    for name in ("campaign", "levels", "restitution"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name} belongs to --find GOAL: give that too")
    scene = scene_of(options)
    entry = device_of(scene)
    capacity = capacity_for(scene)
    emulator = emulator_lines(emulator_numbers(scene), scene, capacity)
    if options.out is not None:
        check_ending(options.out)
    mechanics = mechanics_of(scene, capacity)
    with compiling(quiet=options.json):
        plan = plan_run(
            scene,
            capacity,
            lambda rehearsal: known_answers(options.tuned, entry, rehearsal),
            mechanics,
            lambda rehearsal: response_of(options, entry, rehearsal),
        )
    if options.out is not None:
        made = datetime.now(UTC)
        write_page(
            plan,
            options.out,
            origin_of(options.arguments, scene_argument=options.scene, record=options.record, made=made),
        )
    if options.json:
        print(json.dumps({**as_data(plan), "emulator": emulator}, indent=2, allow_nan=False))
    else:
        *lines, verdict = sentences(plan)
        print("\n".join([*lines, *emulator, verdict]))
        if options.out is not None:
            print(f"page       {options.out}")
    return 0 if plan.feasible and plan.stays_up else 1
