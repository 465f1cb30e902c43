"""A tuning as a picture: asked and achieved before and after, what is left, and the error of each command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import InputError
from twin.tuning.iteration import Tuning
from twin.tuning.window import Window

ASKED, BEFORE, AFTER = "0.35", "tab:red", "tab:blue"


def draw_tuning(tuning: Tuning, window: Window, title: str, path: Path) -> None:
    """Write the picture; the ending of `path` decides the format.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(10, 9), layout="constrained")
    check_format(path, FigureCanvasAgg(figure).get_supported_filetypes())
    figure.suptitle(title, fontsize=10)
    whole, left, steps = figure.subplots(3, 1, height_ratios=[3, 2.2, 2])
    _accelerations(whole, left, tuning, window)
    _iteration(steps, tuning)
    for axes in (whole, left, steps):
        axes.grid(alpha=0.3)
        axes.legend(loc="upper right", fontsize=8)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def check_format(path: Path, known: dict[str, str] | None = None) -> None:
    """Raise `InputError` where no picture can be written to a file of that name: asked before the table moves."""
    if known is None:
        from matplotlib.backend_bases import FigureCanvasBase

        known = FigureCanvasBase.get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")


def _accelerations(whole: Any, left: Any, tuning: Tuning, window: Window) -> None:
    t = window.start + np.arange(window.size) * window.cycle_time
    before = tuning.before.acceleration
    best = tuning.verified
    whole.plot(t, window.acceleration, color=ASKED, lw=2.2, label="asked")
    whole.plot(t, before, color=BEFORE, lw=1.1, ls="--", label="achieved by the command as asked")
    left.plot(t, 100.0 * (window.acceleration - before) / window.peak, color=BEFORE, lw=1.0, ls="--", label="before")
    if best is not None:
        after = best.acceleration
        whole.plot(t, after, color=AFTER, lw=1.2, label="achieved by the corrected command")
        left.plot(t, 100.0 * (window.acceleration - after) / window.peak, color=AFTER, lw=1.0, label="after")
    whole.set_ylabel("base acceleration\n[m/s²]")
    left.set_ylabel("asked less achieved\n[% of the asked peak]")
    left.set_xlabel("time from the start of the pulse [s]")
    seen = t[window.judged]
    for axes in (whole, left):
        axes.set_xlim(seen[0], seen[-1])


def _iteration(axes: Any, tuning: Tuning) -> None:
    results = [step.reproduction for step in tuning.steps]
    numbers = np.arange(len(results))
    rms = np.array([r.rms for r in results])
    axes.errorbar(
        numbers,
        100.0 * rms,
        yerr=200.0 * np.array([r.rms_error for r in results]),
        color=AFTER,
        marker="o",
        lw=1.2,
        capsize=3,
        label="rms, two standard errors",
    )
    axes.plot(numbers, [100.0 * r.peak for r in results], color="tab:orange", marker="s", lw=1.0, label="largest")
    axes.plot(numbers, [100.0 * r.noise for r in results], color="0.5", ls=":", label="noise in the rms")
    if tuning.verified is not None:
        axes.plot(
            [len(results)], [100.0 * tuning.verified.rms], color=AFTER, marker="*", ms=12, ls="", label="verified"
        )
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.set_xticks(np.arange(len(results) + 1))
    axes.set_xlabel("command (0: as asked)")
    axes.set_ylabel("error\n[% of the asked peak]")
