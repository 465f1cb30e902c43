"""The page's pictures: the run over time, and free rocking in its phase plane, in line styles instead of colours."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from excitation import ReleasedRun
from twin.plan import Plan
from twin.rocking.compiled import FloatArray
from twin.whole_run.outcome import SAVES, TOPPLES, StopStudy
from twin.whole_run.performed import Performed

SMALL, TINY = 6.5, 5.6
"""Sizes of type, points."""
INK, DARK, GREY, PALE = "black", "0.3", "0.55", "0.75"
MOST_FUTURES = 40


def draw_run(panels: Any, plan: Plan) -> None:
    """Draw base acceleration, base position and the block's rotation into three axes that share their time."""
    acceleration, position, rotation = panels
    end = _end(plan)
    start = 0.0
    _acceleration(acceleration, plan, start, end)
    _position(position, plan, start, end)
    _rotation(rotation, plan, start, end)
    for axes in panels:
        axes.set_xlim(start, end)
        axes.grid(color="0.85", lw=0.4)
        axes.tick_params(labelsize=SMALL, length=2.0, pad=1.5)
        for side in axes.spines.values():
            side.set_linewidth(0.6)
        axes.yaxis.set_label_coords(-0.055, 0.5)
    for axes in (acceleration, position):
        axes.tick_params(labelbottom=False)
    rotation.set_xlabel("time from the start of the run [s]", fontsize=SMALL, labelpad=1.0)


def _end(plan: Plan) -> float:
    """Return the time to draw to: the motion, and the block's own story where that is longer."""
    times = [plan.motion.duration if plan.motion is not None else 1.0]
    if plan.response is not None:
        times += [t + 0.3 for t in (plan.response.rest_time, plan.response.overturning_time) if t is not None]
    return max(times)


def _legend(axes: Any, columns: int) -> None:
    axes.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 0.985),
        ncols=columns,
        fontsize=TINY + 0.3,
        frameon=False,
        borderaxespad=0.0,
        borderpad=0.1,
        handlelength=2.6,
        columnspacing=1.4,
        handletextpad=0.5,
    )


def _acceleration(axes: Any, plan: Plan, start: float, end: float) -> None:
    motion, clipped, whole = plan.motion, plan.clipped, plan.whole_run
    if motion is None:
        return
    t = dense(motion.breakpoints, start, end)
    if clipped is not None and clipped.changed:
        own = dense(clipped.asked.breakpoints, 0.0, clipped.asked.duration)
        axes.plot(own + motion.pulse_start, clipped.asked.acceleration(own), color=GREY, lw=0.8, ls=":", label="asked")
    performed = whole is not None and isinstance(whole.response.pulse, Performed)
    style: dict[str, Any] = {"color": DARK, "lw": 0.8, "ls": "--"} if performed else {"color": INK, "lw": 1.0}
    axes.plot(t, motion.acceleration(t), **style, label="commanded" if performed else "as planned")
    if whole is not None and isinstance(whole.response.pulse, Performed):
        made = whole.response.pulse
        times = np.arange(made.samples.size) * made.cycle
        axes.plot(times, made.samples, color=INK, lw=1.0, label="as the table makes it")
    lift = plan.block.uplift_acceleration
    for sign in (1, -1):
        axes.axhline(sign * lift, color=INK, lw=0.7, ls=(0, (1, 1.5)), label="lifts the block" if sign > 0 else None)
    axes.set_ylabel("base\n[m/s²]", fontsize=SMALL)
    _legend(axes, 4)


def _position(axes: Any, plan: Plan, start: float, end: float) -> None:
    motion = plan.motion
    if motion is None:
        return
    t = dense(motion.breakpoints, start, end)
    x = 1e3 * motion.displacement(t)
    axes.plot(t, x, color=INK, lw=1.0, label="base")
    if isinstance(motion, ReleasedRun):
        axes.axhline(
            1e3 * motion.end_stop_position, color=INK, lw=0.7, ls="-.", label=f"{motion.machine.stop_name} met"
        )
    else:
        half = 0.5e3 * plan.capacity.stroke
        for sign in (1, -1):
            axes.axhline(sign * half, color=INK, lw=0.7, ls="-.", label="soft limit" if sign > 0 else None)
        axes.set_ylim(-1.15 * half, 1.15 * half)
        whole = plan.whole_run
        if whole is not None and whole.ramp_down is not None:
            far = np.array([stop.furthest for stop in whole.ramp_down.stops]) * 1e3
            axes.plot(
                whole.ramp_down.times,
                far,
                color=DARK,
                lw=0.7,
                ls=(0, (4, 1.2)),
                label="furthest a stop begun then gets",
            )
    for phase in motion.phases:
        if phase.name not in ("settle", "wait", "rest"):
            axes.axvspan(phase.start, phase.end, facecolor="0.9", edgecolor="none", zorder=0)
    axes.set_ylabel("base\n[mm]", fontsize=SMALL)
    _legend(axes, 4)


def _rotation(axes: Any, plan: Plan, start: float, end: float) -> None:
    response, alpha = plan.response, plan.block.slenderness
    if response is None:
        return
    futures = plan.uncertain
    if futures is not None:
        for k, future in enumerate(futures.responses[:MOST_FUTURES]):
            t = np.linspace(0.0, max(0.0, min(end - futures.start, future.end_time)), 700)
            label = (
                f"futures ({min(len(futures.responses), MOST_FUTURES)} of {futures.probability.count})"
                if k == 0
                else None
            )
            theta = np.asarray(future.rotation(t)) / alpha
            axes.plot(t + futures.start, theta, color=PALE, lw=0.45, label=label)
    t = np.linspace(start, min(end, response.end_time), 5000)
    axes.plot(t, np.asarray(response.rotation(t)) / alpha, color=INK, lw=1.2, label="predicted")
    whole = plan.whole_run
    if whole is not None and isinstance(whole.response.pulse, Performed):
        t = np.linspace(start, min(end, whole.response.end_time), 5000)
        theta = np.asarray(whole.response.rotation(t)) / alpha
        axes.plot(t, theta, color=DARK, lw=0.9, ls=(0, (3, 1.5)), label="as the table makes it")
    for sign in (1, -1):
        axes.axhline(sign, color=INK, lw=0.7, ls="-.", label="balance (α)" if sign > 0 else None)
    if whole is not None and whole.ramp_down is not None:
        _stopping(axes, whole.ramp_down)
    top = max(1.2, min(1.3 * response.peak_rotation / alpha, 2.0))
    axes.set_ylim(-top, top)
    axes.set_ylabel("rotation / α", fontsize=SMALL)
    _legend(axes, 5)


def _stopping(axes: Any, study: StopStudy) -> None:
    """Hatch where stopping topples the block, and mark the last moment at which it saves it."""
    for k, stretch in enumerate(study.of(TOPPLES)):
        label = "stopping topples it" if k == 0 else None
        axes.axvspan(stretch.start, stretch.end, facecolor="none", edgecolor=INK, hatch="////", lw=0.4, label=label)
    saves = study.of(SAVES)
    if saves:
        axes.axvline(saves[-1].end, color=INK, lw=0.8, ls=(0, (6, 1, 1, 1, 1, 1)), label="last stop that saves it")


def draw_plane(axes: Any, plan: Plan) -> None:
    """Draw rotation against rate, and the two separatrices beyond which a block on a still base overturns."""
    response, block = plan.response, plan.block
    axes.tick_params(labelsize=SMALL, length=2.0, pad=1.5)
    axes.set_xlabel("rotation / α", fontsize=SMALL, labelpad=1.0)
    axes.set_ylabel("rate / p", fontsize=SMALL, labelpad=1.0)
    if response is None:
        return
    alpha = block.slenderness
    t = np.linspace(0.0, min(_end(plan), response.end_time), 8000)
    theta = np.asarray(response.rotation(t)) / alpha
    rate = np.asarray(response.angular_velocity(t)) / block.frequency_parameter
    axes.plot(theta, rate, color=INK, lw=0.7, label="predicted")
    phi = np.linspace(0.0, 1.6, 100)
    for sign in (1.0, -1.0):
        barrier = 2.0 * np.sin(0.5 * alpha * (1.0 - phi))
        label = "beyond: overturns" if sign > 0 else None
        axes.plot(sign * phi, sign * barrier, color=INK, lw=0.9, ls="--", label=label)
    axes.set_xlim(-1.6, 1.6)
    span = 1.4 * max(2.0 * math.sin(0.5 * alpha), float(np.max(np.abs(rate))))
    axes.set_ylim(-span, span)
    axes.grid(color="0.85", lw=0.4)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.02, -0.135), ncols=2, fontsize=TINY, frameon=False)


def dense(breakpoints: FloatArray, start: float, end: float) -> FloatArray:
    """Return times from `start` to `end`, with both sides of every break point, and no piece without its shape."""
    marks = breakpoints[(breakpoints >= start) & (breakpoints <= end)]
    # The blows of a double pulse are shorter than the steps of the grid; the pieces of a record are straight lines.
    within = marks[:-1] + np.outer(np.linspace(0.0, 1.0, 33)[1:-1], np.diff(marks)) if len(marks) < 100 else marks
    grid = np.linspace(start, end, 3000)
    both = np.concatenate([grid, within.ravel(), marks, np.nextafter(marks[marks > start], -math.inf)])
    return np.unique(both)
