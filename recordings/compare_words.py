"""A comparison in words and as data."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.compare import Comparison, Side
    from twin.rocking.block import Block

ROWS = 12
"""Impacts listed one by one on a terminal; `--json` has all."""


def inertia(block: Block) -> tuple[float, str]:
    """Return the moment of inertia about a lower corner, kg m2, and the unit of an energy made with it.

    I = 4/3 m R^2 of a homogeneous block; per kilogram where the mass is not known.
    """
    if block.mass is None:
        return 4.0 / 3.0 * block.half_diagonal**2, "J/kg"
    return 4.0 / 3.0 * block.mass * block.half_diagonal**2, "J"


def energy_lost(side: Side, moment: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the energy lost in each impact, I (r-^2 - r+^2) / 2, and its standard deviation, in the unit of `moment`.

    The deviation takes the two rates as independent; NaN where one is not known.
    """
    impacts = side.impacts
    before, after = impacts.rate_before, impacts.rate_after
    lost = 0.5 * moment * (before**2 - after**2)
    return lost, moment * np.hypot(before * impacts.rate_before_error, after * impacts.rate_after_error)


def lines(comparison: Comparison, block: Block | None) -> list[str]:
    """Return the comparison as lines of text."""
    c = comparison
    said = [f"first      {_side_line(c.first)}", f"second     {_side_line(c.second)}", f"shift      {_shift_line(c)}"]
    if c.compared:
        said.append(
            f"rotation   difference {c.rms:.3g} rad RMS, {c.peak_difference:.4f} rad at most (at {c.peak_time:.3f} s), "
            f"over {c.compared} samples"
        )
    else:
        said.append("rotation   nothing to compare: the two do not overlap")
    said.append(f"impacts    {_impact_line(c)}")
    said += _table(c)
    for head, side in (("first", c.first), ("second", c.second)):
        mean, error = side.restitution
        if math.isfinite(mean):
            housner = "" if block is None else f"; Housner's for this block: {block.housner_restitution:.4f}"
            said.append(f"ratio      {head}: restitution {mean:.4f} +- {error:.4f} over its impacts{housner}")
            if block is not None:
                moment, unit = inertia(block)
                lost = energy_lost(side, moment)[0]
                said.append(f"energy     {head}: {float(np.nansum(lost)):.4g} {unit} lost in the impacts it shows")
    return said


def data(comparison: Comparison, block: Block | None) -> dict[str, object]:
    """Return the comparison for `--json`; numbers that are not known are None."""
    c = comparison
    moment, unit = (math.nan, None) if block is None else inertia(block)
    return {
        "shift_s": c.shift,
        "estimated_shift_s": c.estimated.seconds,
        "likeness": c.estimated.likeness,
        "rival_shift_s": c.estimated.rival,
        "compared_samples": c.compared,
        "rms_rad": _number(c.rms),
        "peak_difference_rad": _number(c.peak_difference),
        "peak_difference_at_s": _number(c.peak_time),
        "energy_unit": unit,
        "first": _side_data(c.first, moment),
        "second": _side_data(c.second, moment),
        "matched": [[int(i), int(j)] for i, j in zip(c.matches.first, c.matches.second, strict=True)],
        "only_first": c.matches.only_first.tolist(),
        "only_second": c.matches.only_second.tolist(),
    }


def _side_line(side: Side) -> str:
    outcome = "overturned" if side.overturned else f"peak {side.peak:.4f} rad"
    noise = f"noise {side.impacts.noise:.2g} rad" if side.impacts.noise > 1e-7 else "no noise"
    offset = f", reads {side.offset:+.2g} rad at rest" if abs(side.offset) > 1e-7 else ""
    return f"{side.name}: {outcome}, {len(side.impacts)} impacts seen ({noise}{offset})"


def _shift_line(c: Comparison) -> str:
    if not len(c.first.impacts) or not len(c.second.impacts):
        return f"{c.shift:+.4f} s used; one of the two shows no impact to align by"
    said = f"{c.shift:+.4f} s used; {c.estimated.seconds:+.4f} s by the impacts (likeness {c.estimated.likeness:.3f})"
    if c.estimated.rival is not None:
        said += f"; {c.estimated.rival:+.4f} s would do nearly as well"
    return said


def _impact_line(c: Comparison) -> str:
    late = c.second.impacts.time[c.matches.second] - c.first.impacts.time[c.matches.first] - c.shift
    said = f"{late.size} matched"
    if late.size:
        said += f" (second later by {1e3 * float(np.median(late)):+.2f} ms, median; {_span(1e3 * late)})"
    for head, alone, side in (("first", c.matches.only_first, c.first), ("second", c.matches.only_second, c.second)):
        if alone.size:
            times = ", ".join(f"{time:.3f}" for time in side.impacts.time[alone[:4]])
            more = ", ..." if alone.size > 4 else ""
            said += f"; {alone.size} only in the {head} (at {times}{more} s)"
    hidden = len(c.first.impacts.hidden) + len(c.second.impacts.hidden)
    return said + (f"; {hidden} gaps may hide others" if hidden else "")


def _span(values: NDArray[np.float64]) -> str:
    return f"{float(np.min(values)):+.2f} to {float(np.max(values)):+.2f} ms"


def _table(c: Comparison) -> list[str]:
    if not c.matches.first.size:
        return []
    said = ["           time [s]   second later [ms]   restitution: first       second"]
    one, two = c.first.impacts, c.second.impacts
    for i, j in list(zip(c.matches.first, c.matches.second, strict=True))[:ROWS]:
        late = 1e3 * (two.time[j] - one.time[i] - c.shift)
        error = 1e3 * math.hypot(one.time_error[i], two.time_error[j])
        ratios = [
            f"{s.restitution[k]:.3f} +- {s.restitution_error[k]:.3f}" if math.isfinite(s.restitution[k]) else "-"
            for s, k in ((one, i), (two, j))
        ]
        said.append(f"           {one.time[i]:8.4f}   {late:+8.2f} +- {error:5.2f}   {ratios[0]:>18}  {ratios[1]:>16}")
    if c.matches.first.size > ROWS:
        said.append(f"           ... and {c.matches.first.size - ROWS} more (--json lists all)")
    return said


def _side_data(side: Side, moment: float) -> dict[str, object]:
    impacts = side.impacts
    lost, lost_error = energy_lost(side, moment)
    mean, error = side.restitution
    columns = {
        "time_s": impacts.time,
        "time_error_s": impacts.time_error,
        "rate_before_rad_s": impacts.rate_before,
        "rate_before_error_rad_s": impacts.rate_before_error,
        "rate_after_rad_s": impacts.rate_after,
        "rate_after_error_rad_s": impacts.rate_after_error,
        "restitution": impacts.restitution,
        "restitution_error": impacts.restitution_error,
        "energy_lost": lost,
        "energy_lost_error": lost_error,
    }
    rows = [
        {"direction": int(direction), "landing": bool(landing), **dict(zip(columns, map(_number, values), strict=True))}
        for direction, landing, *values in zip(
            impacts.direction.tolist(),
            impacts.landing.tolist(),
            *(column.tolist() for column in columns.values()),
            strict=True,
        )
    ]
    return {
        "name": side.name,
        "samples": side.time.size,
        "overturned": side.overturned,
        "peak_rad": side.peak,
        "noise_rad": impacts.noise,
        "offset_rad": side.offset,
        "restitution": _number(mean),
        "restitution_error": _number(error),
        "impacts": rows,
        "gaps_that_may_hide_impacts_s": impacts.hidden.tolist(),
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
