"""The checks of a whole run in words and as data."""

from __future__ import annotations

import math

from twin.rocking.response import Outcome
from twin.whole_run.check import WholeRun
from twin.whole_run.end_stops import Impact
from twin.whole_run.outcome import (
    FALLS_EITHER_WAY,
    SAVES,
    STANDS_EITHER_WAY,
    TOPPLES,
    UNCERTAIN,
    WORDS,
    Comparison,
    Interval,
    StopStudy,
)
from twin.whole_run.phases import PhaseCheck

MOST_INTERVALS = 4
"""Of one comparison, that are named one by one."""
_MORE = " " * 11
_SAID: dict[Comparison, str] = {
    TOPPLES: "STOPPING TOPPLES a block that going on would not",
    SAVES: "stopping saves a block that falls if the run goes on",
    FALLS_EITHER_WAY: "it falls either way: too late",
    UNCERTAIN: "one rounding decides: undecided",
    STANDS_EITHER_WAY: "it stands either way",
}
_HEADS = {"ramp-down": "broken off ", "power cut": "power cut  ", "run broken off": "broken off "}


def whole_run_lines(whole: WholeRun) -> list[str]:
    """Return the lines of the plan: the motion performed, stops at every moment, energy at the end stops."""
    lines = [f"performed  {_limits_line(whole)}"]
    if (moves := whole.positioning) is not None:
        share = moves.performed.acceleration / whole.uplift_acceleration
        rocks = "IT ROCKS IT" if moves.lifts else "it does not rock it"
        lines.append(f"{_MORE}positioning reaches {share:.2f} of what lifts a block at rest: {rocks}")
    lines.append(f"{_MORE}{_block_line(whole)}")
    if whole.ramp_down is not None:
        lines += _stop_lines(whole, whole.ramp_down)
    else:
        lines.append("broken off nothing stops this machine once it is released")
    if whole.power_cut is not None:
        lines += _stop_lines(whole, whole.power_cut)
    return lines + _impact_lines(whole)


def _limits_line(whole: WholeRun) -> str:
    worst, capacity = whole.worst, whole.capacity
    peaks = worst.performed
    shares = {
        "position": (
            peaks.position / whole.soft_limit,
            f"{peaks.position * 1e3:.1f} of {whole.soft_limit * 1e3:.1f} mm",
        ),
        "speed": (peaks.velocity / capacity.velocity, f"{peaks.velocity:.3f} of {capacity.velocity:.3g} m/s"),
        "acceleration": (
            peaks.acceleration / capacity.acceleration,
            f"{peaks.acceleration:.3f} of {capacity.acceleration:.3g} m/s2",
        ),
    }
    name, (share, numbers) = max(shares.items(), key=lambda item: item[1][0])
    how = "as planned" if whole.mechanics.follows_exactly else "as the closed loop makes it"
    line = f"{how}, nearest to a limit in the {worst.name}: {name} {numbers} ({share:.0%})"
    over = max((p.overshoot for p in whole.phases if p.name in ("pulse", "brake", "approach", "return")), default=0.0)
    return f"{line}; overshoots its command by {over:.1%}" if over >= 5e-4 else line


def _block_line(whole: WholeRun) -> str:
    response, contact = whole.response, whole.contact
    if response.outcome is Outcome.STAYED:
        does = "the block never lifts"
    elif response.outcome is Outcome.ROCKED:
        does = f"the block rocks to {response.peak_rotation:.4f} rad and stands"
    else:
        does = f"the block: {response.outcome.value}"
    friction, normal = contact.friction_needed, contact.least_normal
    needs = (
        f"friction {friction:.3f} ({whole.phase_at(contact.friction_time)}, {contact.friction_time:.3f} s)"
        if math.isfinite(friction)
        else f"more friction than there is ({whole.phase_at(contact.friction_time)}, {contact.friction_time:.3f} s)"
    )
    return (
        f"under all of it {does}; it needs {needs}, least normal force {normal:.3f} of the weight "
        f"({whole.phase_at(contact.least_normal_time)}, {contact.least_normal_time:.3f} s)"
    )


def _stop_lines(whole: WholeRun, study: StopStudy) -> list[str]:
    head = _HEADS[study.how]
    on = WORDS[study.going_on]
    what = {"ramp-down": "ramp-down", "power cut": "loss of power", "run broken off": "stop"}[study.how]
    said = f"{len(study.times)} moments, {study.spacing * 1e3:.3g} ms apart; if the run goes on the block {on}"
    lines = [f"{head}{said}"]
    comparisons = set(study.comparisons)
    if comparisons == {STANDS_EITHER_WAY}:
        lines[0] += f", after a {what} at any of them it stands too"
    else:
        lines += [f"{_MORE}{line}" for line in interval_lines(study)]
    if study.how == "ramp-down":
        lines.append(_MORE + _extremes(whole, study))
    asked = study.asked
    if asked.friction > whole.contact.friction_needed * 1.001 or asked.normal < whole.contact.least_normal - 1e-3:
        needed = f"{asked.friction:.3f}" if math.isfinite(asked.friction) else "more than there is"
        lines.append(
            f"{_MORE}such a stop needs friction {needed} (begun at {asked.friction_time:.3f} s), "
            f"least normal force {asked.normal:.3f} of the weight (begun at {asked.normal_time:.3f} s)"
        )
    return lines


def interval_lines(study: StopStudy) -> list[str]:
    """Return from when to when stopping compares with going on in which way; the longest of each way."""
    lines: list[str] = []
    for comparison in (TOPPLES, SAVES, FALLS_EITHER_WAY, UNCERTAIN):
        if found := study.of(comparison):
            lines.append(f"{_spans(found)}: {_SAID[comparison]}")
    return lines


def _spans(intervals: list[Interval]) -> str:
    longest = sorted(intervals, key=lambda i: i.start - i.end)[:MOST_INTERVALS]
    words = [_span(i) for i in sorted(longest, key=lambda i: i.start)]
    more = f" and {len(intervals) - len(words)} shorter ones" if len(intervals) > len(words) else ""
    return f"{', '.join(words)}{more}"


def _span(interval: Interval) -> str:
    if interval.start == interval.end:
        return f"at {interval.start:.3f} s"
    return f"from {interval.start:.3f} to {interval.end:.3f} s"


def _extremes(whole: WholeRun, study: StopStudy) -> str:
    (slow, longest), (far, furthest) = study.longest, study.furthest
    limit = f"+-{whole.soft_limit * 1e3:.1f} mm"
    inside = "within" if furthest.furthest <= whole.soft_limit + 1e-4 else "BEYOND"
    return (
        f"at most {longest.duration:.2f} s over {longest.distance * 1e3:.0f} mm ({slow:.3f} s), "
        f"up to {furthest.furthest * 1e3:.1f} mm from the centre ({far:.3f} s): {inside} {limit}"
    )


def _impact_lines(whole: WholeRun) -> list[str]:
    words = [impact_words(impact) for impact in whole.impacts]
    return [f"end stops  {'; '.join(words)}"] if words else []


def impact_words(impact: Impact) -> str:
    """Return one way into an end stop: speed and energy."""
    if impact.speed == 0.0:
        return f"{impact.what}: not reached"
    when = "" if impact.time is None else f" ({impact.time:.3f} s)"
    if impact.energy is None:
        return f"{impact.what}{when}: {impact.speed:.3f} m/s, {0.5 * impact.speed**2:.3g} J for each kg that moves"
    return f"{impact.what}{when}: {impact.speed:.3f} m/s, {impact.energy:.3g} J with {impact.mass:.4g} kg"


def whole_run_data(whole: WholeRun) -> dict[str, object]:
    """Return the same for `--json`: SI units, None where something does not exist."""
    contact = whole.contact
    return {
        "table": whole.mechanics.source,
        "follows_exactly": whole.mechanics.follows_exactly,
        "soft_limit_m": whole.soft_limit,
        "stays_inside": whole.stays_inside,
        "phases": [_phase_data(phase) for phase in whole.phases],
        "block": {
            "outcome": whole.response.outcome.value,
            "peak_rotation_rad": whole.response.peak_rotation,
            "friction_needed": contact.friction_needed if math.isfinite(contact.friction_needed) else None,
            "friction_time_s": contact.friction_time,
            "friction_phase": whole.phase_at(contact.friction_time),
            "least_normal": contact.least_normal,
            "least_normal_time_s": contact.least_normal_time,
            "least_normal_phase": whole.phase_at(contact.least_normal_time),
        },
        "ramp_down": None if whole.ramp_down is None else _study_data(whole.ramp_down),
        "power_cut": None if whole.power_cut is None else _study_data(whole.power_cut),
        "end_stops": [
            {
                "what": impact.what,
                "time_s": impact.time,
                "speed_m_s": impact.speed,
                "mass_kg": impact.mass,
                "energy_j": impact.energy,
            }
            for impact in whole.impacts
        ],
    }


def _phase_data(phase: PhaseCheck) -> dict[str, object]:
    return {
        "name": phase.name,
        "start_s": phase.start,
        "end_s": phase.end,
        **{
            side: {
                "position_m": peaks.position,
                "velocity_m_s": peaks.velocity,
                "acceleration_m_s2": peaks.acceleration,
            }
            for side, peaks in (("commanded", phase.commanded), ("performed", phase.performed))
        },
        "peak_rotation_rad": phase.rotation,
        "lifts_a_block_at_rest": phase.lifts,
    }


def _study_data(study: StopStudy) -> dict[str, object]:
    extremes: dict[str, object] = {}
    for name in ("longest", "furthest", "hardest"):
        time, stop = getattr(study, name)
        extremes[name] = {
            "decided_s": time,
            "duration_s": stop.duration,
            "distance_m": stop.distance,
            "furthest_m": stop.furthest,
            "acceleration_m_s2": stop.strongest,
        }
    return {
        "moments": len(study.times),
        "spacing_s": study.spacing,
        "going_on": WORDS[study.going_on],
        "intervals": [
            {"comparison": interval.comparison, "from_s": interval.start, "to_s": interval.end}
            for interval in study.intervals
        ],
        **extremes,
        "friction_needed": study.asked.friction if math.isfinite(study.asked.friction) else None,
        "least_normal": study.asked.normal,
    }
