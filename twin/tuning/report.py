"""What the iteration came to, in words and as data."""

from __future__ import annotations

import math

from twin.tuning.iteration import Step, Tuning
from twin.tuning.reproduction import AGREEING, Reproduction
from twin.tuning.window import Window

JUMP = 0.05
"""Share of the asked peak above which a step of the asked acceleration is worth a line."""


def step_line(number: int, step: Step) -> str:
    """Return one command's result in one line."""
    r = step.reproduction
    what = "as asked" if number == 0 else f"gain {step.gain:.2f} up to {step.highest:.0f} Hz"
    held = "" if step.limited is None else f"; gain reduced by the capacity: {step.limited}"
    return f"{number:<10d} error {r.rms:.2%} rms (+-{r.rms_error:.2%}), {r.peak:.1%} at most; {what}{held}"


def sentences(tuning: Tuning, window: Window) -> list[str]:
    """Return before, after, why it ended, and what no correction can remove; errors are shares of the asked peak."""
    before, after = tuning.before, tuning.verified
    lines = [f"before     {errors_line(before)}"]
    if after is not None:
        lines.append(f"after      {errors_line(after)} (played again, {after.runs} times)")
    lines.append(f"ended      {tuning.reason}")
    last = before if after is None else after
    if (jump := window.jump / window.peak) > JUMP:
        lines.append(
            f"remains    the asked acceleration jumps by {jump:.0%} of its peak: no table follows that, and about half "
            f"of it ({0.5 * jump:.0%}) stays as the largest error"
        )
    lines.append(
        f"sensors    accelerometer and encoder differ by {last.sensors:.1%} rms below {AGREEING:g} Hz: "
        "the accelerometer is believed, and its scale with it"
    )
    return lines


def errors_line(r: Reproduction) -> str:
    """Return what the table made of the asked acceleration in one line."""
    noise = "noise unknown, one run" if math.isnan(r.noise) else f"noise {r.noise:.2%}"
    return (
        f"error {r.rms:.2%} rms ({noise}) and {r.peak:.1%} at most, of the asked peak; "
        f"{r.shape:.2%} rms without its lag of {r.lag * 1e3:.1f} ms"
    )


def as_data(tuning: Tuning) -> dict[str, object]:
    """Return the iteration for `--json`; errors are shares of the asked peak."""
    return {
        "reason": tuning.reason,
        "improved": tuning.improved,
        "before": reproduction_data(tuning.before),
        "after": None if tuning.verified is None else reproduction_data(tuning.verified),
        "steps": [
            {
                **reproduction_data(step.reproduction),
                "gain": step.gain,
                "limited": step.limited,
                "highest_frequency_hz": step.highest,
            }
            for step in tuning.steps
        ],
    }


def reproduction_data(r: Reproduction) -> dict[str, object]:
    """Return the errors of a set of runs as data; None where one run does not tell."""
    values = {
        "rms": r.rms,
        "rms_standard_error": r.rms_error,
        "peak": r.peak,
        "lag_s": r.lag,
        "rms_without_lag": r.shape,
        "noise": r.noise,
        "spread": r.spread,
        "sensors_differ": r.sensors,
    }
    return {**{name: value if math.isfinite(value) else None for name, value in values.items()}, "runs": r.runs}
