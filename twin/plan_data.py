"""A plan as data, for `--json`."""

from __future__ import annotations

import math

from excitation import Clipped
from excitation.released import Settings
from twin.plan import Plan
from twin.plan_report import describe, verdict
from twin.rocking.validity import Validity
from twin.uncertainty.words import data as uncertainty_data
from twin.whole_run.words import whole_run_data


def as_data(plan: Plan) -> dict[str, object]:
    """Return the plan for `--json`; SI units, None where something does not exist."""
    response, margin, clipped = plan.response, plan.margin, plan.clipped
    return {
        "scene": plan.scene.name,
        "feasible_as_asked": plan.feasible,
        "stays_up": plan.stays_up,
        "verdict": verdict(plan),
        "block": {
            "slenderness_rad": plan.block.slenderness,
            "frequency_parameter_rad_s": plan.block.frequency_parameter,
            "restitution": plan.restitution,
            "uplift_acceleration_m_s2": plan.block.uplift_acceleration,
        },
        "table": plan.capacity.model_dump(mode="json"),
        "clip": None if clipped is None else _clip_data(clipped),
        "settings": None if plan.settings is None else settings_data(plan.settings),
        "prediction": None
        if response is None
        else {
            "outcome": response.outcome.value,
            "peak_rotation_rad": response.peak_rotation,
            "uplift_time_s": response.uplift_time,
            "impact_times_s": response.impact_times.tolist(),
            "impact_rates_rad_s": response.impact_rates.tolist(),
            "rest_time_s": response.rest_time,
            "overturning_time_s": response.overturning_time,
            "rotation_error_rad": response.rotation_error,
            "model": response.model,
        },
        "achieved": [achieved.data() for achieved in plan.achieved],
        "sufficient_model": None
        if plan.sufficient is None
        else {"model": plan.sufficient.model, "reason": plan.sufficient.model_reason},
        "contact": None if plan.contact is None else _contact_data(plan.contact),
        "whole_run": None if plan.whole_run is None else whole_run_data(plan.whole_run),
        "margin": None if margin is None else {"smallest": margin.smallest, "up": margin.up, "down": margin.down},
        "futures": None if plan.uncertain is None else uncertainty_data(plan.uncertain),
    }


def settings_data(settings: Settings) -> dict[str, object]:
    """Return what an operator sets on a released machine: its numbers in SI units, what it makes, and the sentence."""
    return {**settings.numbers, "makes": describe(settings.pulse), "text": settings.sentence}


def _contact_data(contact: Validity) -> dict[str, object]:
    """Return the contact's needs; forces as shares of m g, an infinite friction (the block leaves the base) as None."""
    needed = contact.friction_needed
    return {
        "holds": contact.holds,
        "friction_needed": needed if math.isfinite(needed) else None,
        "friction_time_s": contact.friction_time,
        "least_normal": contact.least_normal,
        "least_normal_time_s": contact.least_normal_time,
        "impact_friction": contact.impact_friction,
        "lift_off_time_s": contact.lift_off_time,
        "friction": contact.friction,
        "sliding_time_s": contact.sliding_time,
        "until_s": contact.until,
    }


def _clip_data(clipped: Clipped) -> dict[str, object]:
    return {
        "asked": describe(clipped.asked),
        "given": None if clipped.given is None else describe(clipped.given),
        "changed": clipped.changed,
        "factor": clipped.factor,
        "limits": [
            {"name": limit.name, "asked": limit.asked, "limit": limit.limit, "unit": limit.unit, "text": limit.sentence}
            for limit in clipped.limits
        ],
        "suggestion": None if clipped.suggestion is None else describe(clipped.suggestion),
    }
