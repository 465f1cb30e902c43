"""A plan as a picture: base acceleration and position, rotation with its futures, and the verdict in words."""

from __future__ import annotations

import math
import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from excitation import ReleasedRun
from twin.errors import InputError
from twin.plan import Plan
from twin.plan_report import sentences
from twin.rocking.compiled import FloatArray

HEAD, WIDTH = 11, 110
"""Characters of a line's head, and of its body before it is folded."""
ASKED, GIVEN, PREDICTED, FUTURE = "0.6", "tab:blue", "tab:orange", "0.75"


def draw_plan(plan: Plan, path: Path) -> None:
    """Write the picture of `plan`; the ending of `path` decides the format.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    text = _wrapped(plan)
    words_height = 0.16 * len(text) + 0.1
    figure: Any = Figure(figsize=(10, 8.2 + words_height), layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")
    words, acceleration, position, rotation = figure.subplots(4, 1, height_ratios=[words_height, 2.5, 2.5, 3.2])
    words.set_axis_off()
    words.text(0.0, 1.0, "\n".join(text), va="top", family="monospace", fontsize=7.6, transform=words.transAxes)
    if plan.motion is not None:
        end = _end(plan)
        _acceleration(acceleration, plan, end)
        _position(position, plan, end)
        _rotation(rotation, plan, end)
        for axes in (acceleration, position, rotation):
            axes.set_xlim(0.0, end)
            axes.grid(alpha=0.3)
            # A released base comes to rest at the upper right.
            axes.legend(loc="best" if axes is position else "upper right", fontsize=8)
    else:
        for axes in (acceleration, position, rotation):
            axes.set_axis_off()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _end(plan: Plan) -> float:
    """Return the time to draw to: the motion, and the block's own story where that is longer."""
    times = [plan.motion.duration if plan.motion is not None else 1.0]
    if plan.response is not None:
        times += [t + 0.3 for t in (plan.response.rest_time, plan.response.overturning_time) if t is not None]
    return max(times)


def _wrapped(plan: Plan) -> list[str]:
    """Return the plan's lines, the long ones folded under their own heads."""
    lines: list[str] = []
    for line in sentences(plan):
        folded = textwrap.wrap(line[HEAD:], WIDTH) or [""]
        lines += [head + body for head, body in zip([line[:HEAD]] + [" " * HEAD] * len(folded), folded, strict=False)]
    return lines


def _acceleration(axes: Any, plan: Plan, end: float) -> None:
    motion, clipped = plan.motion, plan.clipped
    if motion is None:
        return
    t = _dense(motion.breakpoints, end)
    if clipped is not None:
        start = motion.pulse_start
        own = _dense(clipped.asked.breakpoints, clipped.asked.duration)
        axes.plot(own + start, clipped.asked.acceleration(own), color=ASKED, lw=1.2, ls="--", label="asked")
    axes.plot(t, motion.acceleration(t), color=GIVEN, lw=1.4, label="given")
    for achieved, colour in zip(plan.achieved[-2:], ("tab:green", "tab:purple"), strict=False):
        own = motion.pulse_start + achieved.start + np.arange(achieved.acceleration.size) * achieved.cycle_time
        axes.plot(own, achieved.acceleration, color=colour, lw=1.0, label=achieved.label)
    lift = plan.block.uplift_acceleration
    for sign in (1, -1):
        label = "g tan(alpha): the block lifts" if sign > 0 else None
        axes.axhline(sign * lift, color="tab:red", lw=0.8, ls=":", label=label)
    axes.set_ylabel("base acceleration\n[m/s²]")


def _position(axes: Any, plan: Plan, end: float) -> None:
    motion = plan.motion
    if motion is None:
        return
    t = _dense(motion.breakpoints, end)
    axes.plot(t, 1e3 * motion.displacement(t), color=GIVEN, lw=1.4, label="base")
    stop = "brake"
    if isinstance(motion, ReleasedRun):
        stop = motion.machine.stop_name
        axes.axhline(1e3 * motion.end_stop_position, color="black", lw=0.8, label=f"{stop} met")
    else:
        half = 0.5e3 * plan.capacity.stroke
        for sign in (1, -1):
            axes.axhline(sign * half, color="black", lw=0.8, label="stroke" if sign > 0 else None)
    for phase in motion.phases:
        if phase.name in ("pulse", stop):
            axes.axvspan(phase.start, phase.end, color=GIVEN if phase.name == "pulse" else "tab:red", alpha=0.08)
    axes.set_ylabel("base position\n[mm]")


def _rotation(axes: Any, plan: Plan, end: float) -> None:
    motion, response = plan.motion, plan.response
    if motion is None or response is None:
        return
    alpha = plan.block.slenderness
    if plan.futures is not None:
        for k, future in enumerate(plan.futures.responses):
            t = np.linspace(0.0, min(end - plan.futures.start, future.end_time), 1500)
            label = f"futures ({len(plan.futures.responses)} of {plan.futures.count})" if k == 0 else None
            theta = np.asarray(future.rotation(t)) / alpha
            axes.plot(t + plan.futures.start, theta, color=FUTURE, lw=0.6, label=label)
    t = np.linspace(0.0, min(end, response.end_time), 4000)
    axes.plot(t, np.asarray(response.rotation(t)) / alpha, color=PREDICTED, lw=1.6, label="predicted")
    for sign in (1, -1):
        label = "alpha: point of balance" if sign > 0 else None
        axes.axhline(sign, color="tab:red", lw=0.8, ls=":", label=label)
    top = max(1.2, min(1.3 * response.peak_rotation / alpha, 2.0))
    axes.set_ylim(-top, top)
    axes.set_ylabel("rotation / alpha")
    axes.set_xlabel("time from the start of the run [s]")


def _dense(breakpoints: FloatArray, end: float) -> FloatArray:
    """Return times from 0 to `end`, with both sides of every break point, and no piece without its shape."""
    marks = breakpoints
    marks = marks[(marks >= 0.0) & (marks <= end)]
    # The blows of a double pulse are shorter than the steps of the grid; the pieces of a record are straight lines.
    within = marks[:-1] + np.outer(np.linspace(0.0, 1.0, 33)[1:-1], np.diff(marks)) if len(marks) < 100 else marks
    grid = np.linspace(0.0, end, 3000)
    both = np.concatenate([grid, within.ravel(), marks, np.nextafter(marks[marks > 0.0], -math.inf)])
    return np.unique(both)
