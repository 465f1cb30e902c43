"""A study in words and as data: numbers, and what they compare."""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import MODELS, NONLINEAR, QUASI_LINEAR
from twin.sensitivity.cloud import Cloud, Share
from twin.sensitivity.free import SIMPLER, FreeRocking
from twin.sensitivity.outcomes import Difference, Panel
from twin.sensitivity.pulses import LEFT, NAMES, REFUSED, RIGHT, ROCKS, STAYS, UNDECIDED
from twin.sensitivity.study import Forced, Study

ALLOWED = 0.01
"""Error of the quarter period up to which a simpler model is said to reach."""


def study_lines(study: Study) -> list[str]:
    """Return the study's conclusions, a line each."""
    scene, block = study.scene, study.case.block
    lines = [
        f"scene      {scene.name}: {scene.title}",
        f"block      alpha {block.slenderness:.4f} rad, p {block.frequency_parameter:.4f} rad/s, "
        f"eta {study.case.eta:.4f}",
        f"free       {_free_words(study)}",
        *(f"           {_reach_words(study, model)}" for model in SIMPLER),
    ]
    if study.forced is None:
        lines.append("pulse      none: no outcome hangs on an amplitude")
    else:
        lines += _forced_lines(study, study.forced)
    lines += _cloud_lines(study.cloud)
    return lines


def as_data(study: Study) -> dict[str, object]:
    """Return the study as JSON data, SI units; angles in rad, tilts of panels in alpha."""
    block, cloud = study.case.block, study.cloud
    return {
        "scene": study.scene.name,
        "alpha_rad": block.slenderness,
        "p_rad_s": block.frequency_parameter,
        "restitution": study.case.eta,
        "initial_tilt_rad": study.case.tilt,
        "free": {
            "released_from_alpha": study.ratio,
            "quarter_s": {model: _number(study.at[model][0]) for model in MODELS},
            "rest_s": {model: _number(study.at[model][1]) for model in MODELS},
            "over_tilt": _free_data("tilt_alpha", study.tilt),
            "over_slenderness": _free_data("alpha_rad", study.slenderness),
        },
        "pulse": None if study.forced is None else _forced_data(study, study.forced),
        "perturbed": {
            "tilt_spread_rad": cloud.tilt_spread,
            "rate_spread_rad_s": cloud.rate_spread,
            "draws": len(cloud.tilts),
            "unperturbed": NAMES[cloud.nominal],
            "outcomes": {name: cloud.share(k).count for k, name in enumerate(NAMES[:REFUSED])},
            "changed": _share_data(cloud.changed),
            "changed_over_size": [{"times_spread": size, **_share_data(share)} for size, share in cloud.sizes],
            "linearised_differs": _share_data(cloud.differing),
        },
    }


def difference_words(found: Difference, cells: int) -> str:
    """Return a comparison in words."""
    said = (
        f"the {found.model} model has another outcome in {found.outcome} of {found.compared} cells "
        f"({_percent(found.outcome, found.compared)}) and another side in {found.direction}"
    )
    if found.refused:
        said += f"; it refuses {found.refused}"
    if found.compared + found.refused < cells // 2:
        said += "; compared on a coarse grid: it has no closed form under this pulse and is stepped"
    return said


def _free_words(study: Study) -> str:
    times = study.at
    quarter, rest = times[NONLINEAR]
    if math.isnan(quarter):
        return f"let go from {study.ratio:.3g} alpha it does not come to rest"
    said = f"let go from {study.ratio:.3g} alpha: first quarter {quarter:.4f} s, rest at {rest:.3f} s"
    for model in SIMPLER:
        if math.isnan(times[model][0]):
            said += f"; the {model} model refuses"
        else:
            said += f"; {model} {times[model][0] / quarter - 1.0:+.2%} and {times[model][1] / rest - 1.0:+.2%}"
    return said


def _reach_words(study: Study, model: str) -> str:
    tilt, bulk = study.tilt.reaches(model, ALLOWED), study.slenderness.reaches(model, ALLOWED)
    worst = study.tilt.quarter_errors(model)
    said = f"{model}: quarter period within {ALLOWED:.0%} "
    said += "at no tilt" if tilt is None else f"up to a tilt of {tilt:.2f} alpha"
    said += ", for no slenderness" if bulk is None else f", up to alpha = {bulk:.2f} rad (from {study.ratio:.3g} alpha)"
    if not np.all(np.isnan(worst)):
        at = int(np.nanargmax(np.abs(worst)))
        said += f"; at worst {worst[at]:+.1%}, at {study.tilt.at[at]:.2f} alpha"
    return said


def _forced_lines(study: Study, forced: Forced) -> list[str]:
    panel = forced.nonlinear
    counts = ", ".join(f"{panel.count(k)} {name}" for k, name in enumerate(NAMES) if panel.count(k) or k == UNDECIDED)
    span = f"{panel.tilts[0]:+.2f} to {panel.tilts[-1]:+.2f} alpha by {panel.others[0]:.2g} to {panel.others[-1]:.2g}"
    lines = [
        f"pulse      tilt {span} times the amplitude, {panel.classes.size} cells: {counts}",
        *(f"           {difference_words(found, panel.classes.size)}" for found in forced.differences),
    ]
    if forced.sparse is None:
        lines.append(
            f"           the {QUASI_LINEAR} model is not asked: no closed form under this pulse, stepping too slow"
        )
    limit = study.case.block.gravity / math.tan(study.case.block.slenderness)
    peak = 0.0 if study.case.pulse is None else study.case.pulse.peak_acceleration
    if peak * panel.others[-1] > limit:
        lines.append(
            f"           above {limit / peak:.2f} times the amplitude (g / tan(alpha)) the {QUASI_LINEAR} model "
            "oscillates where it should fall: it is outside its range there"
        )
    slender = forced.slender_difference
    lines.append(
        f"           slenderness {forced.slender.others[0]:.3f} to {forced.slender.others[-1]:.3f} rad, "
        f"this amplitude: {difference_words(slender, slender.compared)}"
    )
    below, above = forced.nearest_tilts(study.case.relative_tilt)
    words = [f"{tilt:+.3f} alpha" for tilt in (below, above) if tilt is not None]
    lines.append(
        f"tilt       at the scene's amplitude from {study.case.relative_tilt:+.3f} alpha: "
        + (f"another outcome or side at {' and '.join(words)}" if words else "the same outcome and side in the panel")
        + f" (in steps of {panel.tilts[1] - panel.tilts[0]:.3f} alpha)"
    )
    return lines


def _cloud_lines(cloud: Cloud) -> list[str]:
    shares = [
        ("stays or rocks", cloud.share(STAYS, ROCKS)),
        (NAMES[LEFT], cloud.share(LEFT)),
        (NAMES[RIGHT], cloud.share(RIGHT)),
    ]
    undecided = cloud.share(UNDECIDED)
    said = "; ".join(f"{name} {share.words}" for name, share in shares)
    if undecided.count:
        said += f"; {undecided.count} undecided"
    sizes = ", ".join(f"{share.value:.1%} at {size:g}x" for size, share in cloud.sizes)
    return [
        f"perturbed  {len(cloud.tilts)} starts about the scene's, tilt +-{math.degrees(cloud.tilt_spread):.3g} deg, "
        f"rate +-{math.degrees(cloud.rate_spread):.3g} deg/s: {said}",
        f"           unperturbed it {NAMES[cloud.nominal]}: {cloud.changed.words} of the starts change that; {sizes} "
        "the spreads",
        f"           the linearised model has another outcome or side for {cloud.differing.words} of them",
    ]


def _forced_data(study: Study, forced: Forced) -> dict[str, object]:
    below, above = forced.nearest_tilts(study.case.relative_tilt)
    return {
        "over_amplitude": _panel_data("amplitude_factors", forced.nonlinear),
        "over_amplitude_linearised": _panel_data("amplitude_factors", forced.linearised),
        "over_amplitude_quasi_linear": None
        if forced.sparse is None
        else _panel_data("amplitude_factors", forced.sparse),
        "over_slenderness": _panel_data("alpha_rad", forced.slender),
        "over_slenderness_linearised": _panel_data("alpha_rad", forced.slender_linearised),
        "differences": [_difference_data(found) for found in forced.differences],
        "slenderness_difference": _difference_data(forced.slender_difference),
        "nearest_tilts_alpha": [below, above],
    }


def _difference_data(found: Difference) -> dict[str, object]:
    return {
        "model": found.model,
        "compared": found.compared,
        "outcome": found.outcome,
        "direction": found.direction,
        "refused": found.refused,
    }


def _panel_data(others: str, panel: Panel) -> dict[str, object]:
    return {
        "tilts_alpha": panel.tilts.tolist(),
        others: panel.others.tolist(),
        "classes": panel.classes.tolist(),
        "class_names": list(NAMES),
        "impacts": panel.impacts.tolist(),
    }


def _free_data(name: str, free: FreeRocking) -> dict[str, object]:
    return {
        name: free.at.tolist(),
        "quarter_s": {model: _numbers(values) for model, values in free.quarters.items()},
        "rest_s": {model: _numbers(values) for model, values in free.rests.items()},
    }


def _share_data(share: Share) -> dict[str, object]:
    return {"share": share.value, "low": share.interval[0], "high": share.interval[1]}


def _numbers(values: FloatArray) -> list[float | None]:
    return [_number(value) for value in values.tolist()]


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _percent(count: int, whole: int) -> str:
    return f"{100.0 * count / whole:.2g} %" if whole else "none compared"
