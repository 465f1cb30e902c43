"""What the futures of a run come to, in the plan's lines and as data."""

from __future__ import annotations

from twin.uncertainty.boundary import RANGE, Boundary
from twin.uncertainty.causes import Cause
from twin.uncertainty.foresee import Uncertain
from twin.uncertainty.probability import percent

NAMED = 3
"""Causes named with their effect; of the others only the spread is said."""


def lines(uncertain: Uncertain) -> list[str]:
    """Return the futures, their causes, and the distances to another outcome, as lines of a plan."""
    found = [f"futures    {futures_line(uncertain)}", f"spreads    {_spreads(uncertain)}"]
    if uncertain.causes and uncertain.probability.overturned:
        found.append(f"causes     {_causes(uncertain)}")
    if uncertain.amplitude is not None and uncertain.frequency is not None:
        found.append(
            f"boundary   under the table's motion: {_distance(uncertain.amplitude, 'amplitude')}; "
            f"{_distance(uncertain.frequency, 'frequency')}"
        )
        found.append(f"amplitude  {_levels(uncertain)}")
    return found


def futures_line(uncertain: Uncertain) -> str:
    """Return how many fall, with the interval of the probability, to which side and after how many impacts."""
    p = uncertain.probability
    line = f"overturning in {p.percent} of {p.count}"
    if p.count < uncertain.wanted:
        line += f" (not {uncertain.wanted}: the base motion is long; [uncertainty] futures asks for more)"
    if p.undecided:
        line += f", {p.undecided} undecided: one rounding decides"
    if not p.overturned:
        return line
    left, right = uncertain.directions
    sides = f"{right} to +x, {left} to -x"
    ways = ", ".join(f"{count} after {impacts}" for impacts, count in list(uncertain.impacts.items())[:4])
    more = sum(list(uncertain.impacts.values())[4:])
    after = f"{ways} impacts" + (f", {more} after more" if more else "")
    return f"{line}; {sides}; {after}"


def _spreads(uncertain: Uncertain) -> str:
    spreads = ", ".join(f"{cause.name} {cause.spread}" for cause in sorted(uncertain.causes, key=lambda c: c.name))
    return f"{spreads or 'none'}; base motion {uncertain.table}"


def _causes(uncertain: Uncertain) -> str:
    here = percent(uncertain.probability.estimate)
    named = [f"without the spread of {c.name} {percent(c.without.estimate)} %" for c in uncertain.causes[:NAMED]]
    return f"{', '.join(named)} (instead of {here} %)"


def _distance(boundary: Boundary, what: str) -> str:
    known = [value for value in (boundary.down, boundary.up) if value is not None]
    if not known:
        return f"no change of {what} within {RANGE:.0%} changes the outcome"
    return f"another outcome at {' and '.join(f'{value:+.2%}' for value in known)} of {what}"


def _levels(uncertain: Uncertain) -> str:
    parts: list[str] = []
    for probability, factor in uncertain.levels.items():
        where = "nowhere within 50 %" if factor is None else f"at {factor:.2f} of the amplitude"
        parts.append(f"{percent(probability)} % fall {where}")
    return ", ".join(parts)


def data(uncertain: Uncertain) -> dict[str, object]:
    """Return the same for `--json`."""
    left, right = uncertain.directions
    return {
        **uncertain.probability.data(),
        "falls_to_negative": left,
        "falls_to_positive": right,
        "impacts_before": {str(impacts): count for impacts, count in uncertain.impacts.items()},
        "causes": [_cause(cause) for cause in uncertain.causes],
        "boundary_amplitude": _ends(uncertain.amplitude),
        "boundary_frequency": _ends(uncertain.frequency),
        "amplitude_factor_at_probability": {f"{p:g}": factor for p, factor in uncertain.levels.items()},
        "table": uncertain.table,
    }


def _cause(cause: Cause) -> dict[str, object]:
    return {
        "name": cause.name,
        "spread": cause.spread,
        "without": cause.without.data(),
        "first_order_share": cause.share,
    }


def _ends(boundary: Boundary | None) -> dict[str, float | None] | None:
    return None if boundary is None else {"down": boundary.down, "up": boundary.up}
