"""`twin plan SCENE --find GOAL`: runs that meet a goal, inside the table's capacity; and a campaign of them."""

from __future__ import annotations

import argparse
import json
from itertools import pairwise
from pathlib import Path

from twin.campaign import LEVELS, campaign_text
from twin.commands.inputs import capacity_for, device_of, scene_of
from twin.commands.progress import compiling
from twin.commands.table_response import response_of
from twin.errors import InputError
from twin.search.find import Search, find_runs
from twin.search.goals import Aim, read_goal
from twin.search.report import as_data, run_parts, sentences


def find(options: argparse.Namespace) -> int:
    """Search, print, write the campaign and the picture; 0 where there is a run to propose, 1 where there is none."""
    goal = read_goal(options.find)
    levels = read_levels(options.levels)
    scene = scene_of(options)
    entry = device_of(scene)
    capacity = capacity_for(scene)
    _check_target(options.campaign)
    if not 1 <= options.proposals <= 50:
        raise InputError(f"--proposals is {options.proposals}; it is 1 to 50")
    with compiling(quiet=options.json):
        search = find_runs(
            scene,
            capacity,
            goal,
            most=options.proposals,
            seed=options.seed,
            restitution=options.restitution,
            response=lambda rehearsal: response_of(options, entry, rehearsal),
        )
    if options.out is not None:
        from twin.search.picture import draw_search

        draw_search(search, options.out)
    written = [] if options.campaign is None else _write(options, search, levels)
    if options.json:
        campaign = None if not written or options.campaign is None else str(options.campaign)
        print(json.dumps({**as_data(search), "campaign": campaign}, indent=2, allow_nan=False))
    else:
        *lines, verdict = sentences(search)
        picture = [f"picture    {options.out}"] if options.out is not None else []
        print("\n".join([*lines, *written, *picture, verdict]))
    return 0 if search.proposals else 1


def read_levels(text: str | None) -> tuple[float, ...]:
    """Return the staged levels of "10,25,50,100"; raises `InputError`."""
    if text is None:
        return LEVELS
    try:
        levels = tuple(float(part) for part in text.split(","))
    except ValueError:
        levels = ()
    ascending = all(earlier <= later for earlier, later in pairwise(levels))
    if not levels or not ascending or not all(0.0 < level <= 100.0 for level in levels):
        raise InputError(
            f"--levels is {text!r:.60}; give percents above 0 to 100 that do not go down, as in 10,25,50,100"
        )
    return levels


def _check_target(path: Path | None) -> None:
    """Refuse before the work what could not be written after it, or would be written over."""
    if path is None:
        return
    if path.suffix.lower() != ".toml":
        raise InputError(f"--campaign {path}: a campaign ends in .toml")
    if path.exists():
        raise InputError(f"--campaign {path} is there already; nothing is written over")


def _write(options: argparse.Namespace, search: Search, levels: tuple[float, ...]) -> list[str]:
    """Write the campaign; return what is said of it."""
    path: Path = options.campaign
    runs, notes = run_parts(search, levels)
    lines = [f"note       {note}" for note in notes]
    if not runs:
        return [*lines, "note       no campaign is written: there is no run for it"] if notes else []
    if search.goal.aim in (Aim.OVERTURN, Aim.NO_IMPACT):
        lines.append(f"note       staged levels may overturn the block too: `twin plan {path}` says which")
    title = f"{search.goal.aim.value}, {search.scene.name}"
    text = campaign_text(title, options.scene, runs, levels, path.parent)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with path.open("x", encoding="utf-8", newline="\n") as file:
            file.write(text)
    except OSError as error:
        raise InputError(f"--campaign {path} cannot be written: {(error.strerror or str(error)).lower()}") from None
    return [*lines, f"campaign   {path}: `twin plan {path}` plans it, `twin run {path}` performs it run by run"]
