"""A plan in words and as data."""

from __future__ import annotations

import math

from excitation import Clipped, TableRun
from excitation.released import Settings
from twin.margin import MARGIN_RANGE
from twin.plan import Plan
from twin.rocking.block import Block
from twin.rocking.response import Outcome, Response
from twin.rocking.validity import Validity
from twin.uncertainty.words import lines as uncertainty_lines
from twin.whole_run.words import whole_run_lines


def sentences(plan: Plan) -> list[str]:
    """Return the plan as lines of text: table, clip, prediction, its model and validity, margin, futures, verdict."""
    lines = [f"scene      {plan.scene.name}: {plan.scene.title}", _block_line(plan), _table_line(plan)]
    if plan.capacity.machine is not None:
        sources = (f"{words} [{source}]" for words, source in plan.capacity.machine.described.values())
        lines.append(f"machine    {'; '.join(sources)}")
    if plan.clipped is not None:
        lines += clip_lines(plan.clipped)
    if plan.settings is not None and plan.motion is not None:
        lines += settings_lines(plan.settings, plan.motion)
    if plan.response is None or plan.uncertain is None:
        return [*lines, f"verdict    not feasible: {plan.capacity.name} cannot make this excitation"]
    lines.append(f"predicted  {response_line(plan.response, plan.block.slenderness)}")
    lines += [f"achieved   {achieved.line(plan.block.slenderness)}" for achieved in plan.achieved]
    lines += _model_lines(plan.response, plan.sufficient)
    if plan.contact is not None:
        lines += _contact_lines(plan.contact, plan.block)
    lines.append(_margin_line(plan))
    lines += uncertainty_lines(plan.uncertain)
    lines.append(_stop_line(plan))
    if plan.whole_run is not None:
        lines += whole_run_lines(plan.whole_run)
    if plan.capacity.kinds is not None and plan.capacity.machine is None:
        lines.append(
            f"note       {plan.capacity.name} makes the pulse alone: the way to its start and its end are yours"
        )
    lines.append(f"verdict    {verdict(plan)}")
    return lines


def clip_lines(clipped: Clipped) -> list[str]:
    """Return what the table can make of what was asked."""
    lines = [f"asked      {describe(clipped.asked)}"]
    lines += [f"limit      {limit.sentence}" for limit in clipped.limits]
    if clipped.given is None:
        lines.append("given      nothing: no pulse of this kind fits")
    elif clipped.changed:
        lines.append(f"given      {describe(clipped.given)} ({clipped.factor:.4f} of the amplitude)")
    else:
        lines.append("given      as asked")
    if clipped.suggestion is not None:
        lines.append(f"suggestion {describe(clipped.suggestion)}")
    return lines


def settings_lines(settings: Settings, motion: TableRun) -> list[str]:
    """Return what an operator sets on a released machine, and what it then makes."""
    parts: list[str] = []
    for phase in motion.phases:
        if motion.pulse_start <= phase.start < motion.shaking_end:
            parts.append(f"{phase.name} {motion.peak_in(phase):.3g} m/s2 for {phase.end - phase.start:.3f} s")
    return [f"set        {settings.sentence}", f"makes      {', '.join(parts)}"]


def verdict(plan: Plan) -> str:
    """Return one clause: feasible or not, stays up or falls."""
    if plan.response is None:
        return "not feasible"
    can = "feasible as asked" if plan.feasible else "not feasible as asked: clipped"
    if plan.feasible and plan.settings is not None and plan.clipped is not None:
        # Weights and drops come in steps.
        can = can if plan.settings.pulse == plan.clipped.asked else "feasible, as near as the machine can be set"
    does = {
        Outcome.STAYED: "the block does not move",
        Outcome.ROCKED: "the block rocks and stays up",
        Outcome.OVERTURNED: "THE BLOCK OVERTURNS",
        Outcome.UNDECIDED: "the outcome is undecided: one rounding of an input changes it",
    }
    uncertain = plan.uncertain
    but = ""
    if plan.stays_up and uncertain is not None and uncertain.probability.overturned > 0:
        but = f", but overturns in {uncertain.probability.percent} of its futures"
    elif not plan.stays_up and uncertain is not None and uncertain.probability.overturned < uncertain.probability.count:
        but = f" (in {uncertain.probability.percent} of its futures)"
    return f"{can}; {does[plan.response.outcome]}{but}"


def response_line(response: Response, slenderness: float) -> str:
    """Return the predicted motion in one line."""
    if response.outcome is Outcome.STAYED:
        return "stays: the base acceleration never passes g tan(alpha)"
    peak = f"peak {response.peak_rotation:.4f} rad ({response.peak_rotation / slenderness:.2f} of alpha)"
    count = len(response.impact_times)
    lift = f"uplift at {response.uplift_time:.3f} s"
    if response.outcome is Outcome.OVERTURNED:
        before = [t for t in response.impact_times if t < (response.overturning_time or math.inf)]
        when = "" if response.overturning_time is None else f" at {response.overturning_time:.3f} s"
        return f"overturns{when} after {_counted(len(before), 'impact')}; {lift}"
    rest = "" if response.rest_time is None else f", at rest from {response.rest_time:.3f} s"
    return f"{response.outcome.value}: {peak}; {lift}, {_counted(count, 'impact')}{rest}"


def _model_lines(response: Response, sufficient: Response | None) -> list[str]:
    """Return the model the prediction is of, and the simplest one that would do."""
    if sufficient is None:
        return [f"model      {response.model}"]
    if sufficient.model == response.model:
        return [f"model      {sufficient.model_reason}"]
    return [f"model      {response.model}; enough would be {sufficient.model_reason}"]


def _contact_lines(contact: Validity, block: Block) -> list[str]:
    """Return what the motion asks of the contact, and a warning for each way in which it asks too much."""
    weight = "of the weight"
    force = f"{contact.least_normal:.3f} {weight}"
    if block.mass is not None:
        force = f"{contact.least_normal * block.mass * block.gravity:.4g} N, {force}"
    impacts = "" if contact.impact_friction is None else f", {contact.impact_friction:.3f} at each impact"
    given = "; the scene gives no friction" if contact.friction is None else f"; the scene has {contact.friction:g}"
    needs = "no friction would do"
    if math.isfinite(contact.friction_needed):
        needs = f"needs friction {contact.friction_needed:.3f} (at {contact.friction_time:.3f} s){impacts}{given}"
    lines = [f"contact    {needs}; least normal force {force} (at {contact.least_normal_time:.3f} s)"]
    if contact.lift_off_time is not None:
        lines.append(
            f"WARNING    the base would have to pull at {contact.lift_off_time:.3f} s: "
            "the block leaves it, and the prediction ends there"
        )
    if contact.sliding_time is not None:
        lines.append(
            f"WARNING    friction {contact.friction:g} is not enough from {contact.sliding_time:.3f} s on: "
            "the block slides, and the prediction ends there"
        )
    return lines


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def describe(pulse: object) -> str:
    """Return a pulse with its numbers and what they come to."""
    from excitation import Pulse

    if not isinstance(pulse, Pulse):
        return str(pulse)
    return (
        f"{pulse.kind}: {pulse.peak_acceleration:.3f} m/s2, {pulse.peak_velocity:.3f} m/s, "
        f"{pulse.travel * 1e3:.1f} mm of stroke, {pulse.duration:.3f} s"
    )


def _block_line(plan: Plan) -> str:
    block = plan.block
    how = "Housner" if plan.scene.block.restitution is None else "given"
    return (
        f"block      {block.width * 1e3:g} x {block.height * 1e3:g} mm, alpha {block.slenderness:.4f} rad, "
        f"p {block.frequency_parameter:.3f} rad/s, restitution {plan.restitution:.4f} ({how}), "
        f"lifts above {block.uplift_acceleration:.3f} m/s2"
    )


def _table_line(plan: Plan) -> str:
    capacity = plan.capacity
    texts = sorted(set(capacity.provenance.values()))
    source = f" [{'; '.join(texts)}]" if texts else ""
    return (
        f"table      {capacity.name}: {capacity.stroke * 1e3:g} mm, {capacity.velocity:g} m/s, "
        f"{capacity.acceleration:g} m/s2{source}"
    )


def _stop_line(plan: Plan) -> str:
    if plan.capacity.machine is not None:
        return f"stopping   {plan.capacity.machine.stopping}"
    deceleration, duration, distance = plan.stop
    return (
        f"stopping   from the top speed: {deceleration:.3g} m/s2 for {duration:.2f} s over {distance * 1e3:.0f} mm, "
        "steeper where the stroke left asks for it"
    )


def _margin_line(plan: Plan) -> str:
    margin = plan.margin
    if margin is None:
        return "margin     none: nothing shakes"
    change = "stands" if plan.response is not None and plan.response.outcome is Outcome.OVERTURNED else "overturns"
    nearest = margin.smallest
    if nearest is None:
        searched = f"from {-MARGIN_RANGE:.0%} to {margin.searched_up:+.1%}"
        return f"margin     no change of amplitude {searched} changes the outcome"
    known = [value for value in (margin.down, margin.up) if value is not None]
    both = " and ".join(f"{value:+.2%}" for value in known)
    return f"margin     {nearest:+.2%} of amplitude: then it {change} (nearest changes of outcome: {both})"
