"""`twin plan CAMPAIGN.toml`: every run of a campaign planned, a line each; nothing moves."""

from __future__ import annotations

import argparse
import json
from dataclasses import dataclass

from excitation import Clipped
from twin.campaign import Campaign, Step, load_campaign
from twin.commands.inputs import capacity_for, device_of
from twin.commands.progress import compiling
from twin.commands.table_response import response_of
from twin.errors import InputError
from twin.rehearsal import NotPossibleError, Rehearsal, rehearse
from twin.rocking.response import Outcome
from twin.search.proposal import refused, use_words
from twin.uncertainty.population import Population
from twin.uncertainty.probability import Probability
from twin.uncertainty.shaking import shaking_of

FUTURES = 2000
"""Of each run, at most: a campaign has many runs, and `twin plan` of one scene draws them all."""


@dataclass(frozen=True, slots=True)
class PlannedStep:
    """A step and what is expected of it; `rehearsal` and `overturning` are None where the table makes no such pulse."""

    step: Step
    clipped: Clipped | None
    rehearsal: Rehearsal | None
    overturning: Probability | None
    trouble: str = ""

    @property
    def feasible(self) -> bool:
        """Whether the table performs it exactly as asked."""
        return not self.trouble

    @property
    def stays_up(self) -> bool:
        """Whether the block is predicted not to overturn."""
        return self.rehearsal is not None and self.rehearsal.response.outcome in (Outcome.STAYED, Outcome.ROCKED)


def plan_campaign(options: argparse.Namespace) -> int:
    """Plan every run and print a line each; 0 all are feasible as asked and the block stays up, 1 otherwise."""
    for name in ("find", "record", "out", "campaign"):
        if getattr(options, name) is not None:
            raise InputError(f"--{name} belongs to a scene, and {options.scene} is a campaign")
    campaign = load_campaign(options.scene)
    with compiling(quiet=options.json):
        planned = [_planned(options, step) for step in campaign.steps]
    good = all(step.feasible and step.stays_up for step in planned)
    if options.json:
        print(json.dumps(_data(campaign, planned), indent=2, allow_nan=False))
    else:
        print("\n".join(_lines(campaign, planned)))
    return 0 if good else 1


def _planned(options: argparse.Namespace, step: Step) -> PlannedStep:
    entry = device_of(step.scene)
    capacity = capacity_for(step.scene)
    try:
        rehearsal = rehearse(step.scene, capacity)
    except NotPossibleError as refusal:
        return PlannedStep(step, refusal.clipped, None, None, refusal.clipped.limits[0].sentence)
    trouble = ""
    if rehearsal.clipped is not None and not rehearsal.clipped.feasible:
        limits = rehearsal.clipped.limits
        trouble = f"clipped to {rehearsal.clipped.factor:.3f}" + (f": {limits[0].sentence}" if limits else "")
    elif (reason := refused(rehearsal)) is not None:
        trouble = reason
    shaking = shaking_of(rehearsal, response_of(options, entry, rehearsal))
    return PlannedStep(
        step,
        rehearsal.clipped,
        rehearsal,
        Population.of(rehearsal, min(FUTURES, step.scene.spreads.futures)).probability(shaking.variants),
        trouble,
    )


def _lines(campaign: Campaign, planned: list[PlannedStep]) -> list[str]:
    title = f": {campaign.title}" if campaign.title else ""
    lines = [f"campaign   {campaign.name}{title}"]
    lines += [f"{f'run {step.step.number}':<10} {step.step.title}: {_expected(step)}" for step in planned]
    out = sum(not step.feasible for step in planned)
    falls = sum(step.feasible and not step.stays_up for step in planned)
    can = "all feasible as asked" if not out else f"{out} of {len(planned)} NOT FEASIBLE AS ASKED"
    does = "the block stays up in all" if not falls else f"THE BLOCK IS PREDICTED TO OVERTURN IN {falls}"
    return [*lines, f"verdict    {len(planned)} runs, {can}; {does}"]


def _expected(planned: PlannedStep) -> str:
    rehearsal, overturning = planned.rehearsal, planned.overturning
    if rehearsal is None or overturning is None:
        return f"NOT FEASIBLE: {planned.trouble}"
    response = rehearsal.response
    does = response.outcome.value
    if response.outcome is Outcome.ROCKED:
        peak = response.peak_rotation
        does += f", peak {peak:.4f} rad ({peak / rehearsal.block.slenderness:.2f} of alpha)"
    start = f"NOT AS ASKED, {planned.trouble}; " if planned.trouble else ""
    return f"{start}{does}; overturns in {overturning.percent} of futures; {use_words(rehearsal)}"


def _data(campaign: Campaign, planned: list[PlannedStep]) -> dict[str, object]:
    return {
        "campaign": campaign.name,
        "title": campaign.title,
        "runs": [
            {
                "number": step.step.number,
                "run": step.step.run,
                "level_percent": step.step.level,
                "scene": step.step.scene.name,
                "feasible_as_asked": step.feasible,
                "trouble": step.trouble or None,
                "outcome": None if step.rehearsal is None else step.rehearsal.response.outcome.value,
                "peak_rotation_rad": None if step.rehearsal is None else step.rehearsal.response.peak_rotation,
                "overturning": None if step.overturning is None else step.overturning.data(),
                "usage": {} if step.clipped is None else dict(step.clipped.usage),
                "why": step.step.why or None,
            }
            for step in planned
        ],
    }
