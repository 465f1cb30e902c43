"""A comparison as a picture: both rotations, their difference, impact times and restitution one by one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from recordings.errors import RecordingError

if TYPE_CHECKING:
    from pathlib import Path

    from recordings.compare import Comparison, Side
    from twin.rocking.block import Block

FIRST, SECOND, DIFFERENCE = "tab:blue", "tab:orange", "0.35"
MOST_POINTS = 20_000
"""Samples drawn of a line: of a longer one, the least and the greatest of each stretch."""
SHOWN_ERROR = 0.25
"""A restitution less certain than this is not drawn: it would only hide the others."""


def draw_comparison(comparison: Comparison, path: Path, block: Block | None) -> None:
    """Write the picture; the ending of `path` decides the format.

    Raises
    ------
    RecordingError
        The format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure: Any = Figure(figsize=(10, 9), layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise RecordingError(f"{path} is not written: a picture ends in .png, .svg or .pdf")
    rotation, difference, times, ratios = figure.subplots(4, 1, sharex=True, height_ratios=[3, 2, 2, 2])
    _rotations(rotation, comparison)
    _difference(difference, comparison)
    _times(times, comparison)
    _ratios(ratios, comparison, block)
    for axes in (rotation, difference, times, ratios):
        axes.grid(alpha=0.3)
    ratios.set_xlabel("time on the clock of the first [s]" if comparison.shift else "time [s]")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise RecordingError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _rotations(axes: Any, c: Comparison) -> None:
    for side, colour, shift, width in ((c.first, FIRST, 0.0, 2.4), (c.second, SECOND, c.shift, 1.1)):
        time, values = _thinned(side.time - shift, side.rotation)
        axes.plot(time, values, color=colour, lw=width, label=side.name)
    axes.set_ylabel("rotation [rad]")
    axes.legend(loc="upper right", fontsize=8)
    axes.set_title(
        f"{c.second.name} against {c.first.name}: {c.rms:.3g} rad RMS, {c.peak_difference:.3g} rad at most; "
        f"shift {c.shift:+.4f} s",
        fontsize=10,
    )


def _difference(axes: Any, c: Comparison) -> None:
    time, values = _thinned(c.first.time, c.difference)
    axes.plot(time, values, color=DIFFERENCE, lw=0.9)
    axes.set_ylabel("second - first\n[rad]")


def _times(axes: Any, c: Comparison) -> None:
    one, two, pairs = c.first.impacts, c.second.impacts, c.matches
    late = 1e3 * (two.time[pairs.second] - one.time[pairs.first] - c.shift)
    error = 1e3 * np.hypot(one.time_error[pairs.first], two.time_error[pairs.second])
    axes.errorbar(one.time[pairs.first], late, yerr=error, fmt=".", color=SECOND, ecolor="0.6", label="matched")
    for side, alone, colour, shift in (
        (c.first, pairs.only_first, FIRST, 0.0),
        (c.second, pairs.only_second, SECOND, c.shift),
    ):
        if alone.size:
            at = side.impacts.time[alone] - shift
            axes.plot(at, np.zeros(at.size), "x", color=colour, ms=5, label=f"only in {side.name}")
    axes.set_ylabel("second's impact\nlater by [ms]")
    if pairs.first.size or pairs.only_first.size or pairs.only_second.size:
        axes.legend(loc="upper right", fontsize=8)


def _ratios(axes: Any, c: Comparison, block: Block | None) -> None:
    for side, colour, shift in ((c.first, FIRST, 0.0), (c.second, SECOND, c.shift)):
        _ratio_points(axes, side, colour, shift)
    if block is not None:
        axes.axhline(block.housner_restitution, color="tab:red", lw=0.8, ls=":", label="Housner")
    axes.set_ylabel("restitution\nper impact")
    axes.set_ylim(0.0, 1.4)
    axes.legend(loc="lower left", fontsize=8)


def _ratio_points(axes: Any, side: Side, colour: str, shift: float) -> None:
    impacts = side.impacts
    sure = np.isfinite(impacts.restitution) & (impacts.restitution_error <= SHOWN_ERROR)
    unsure = int(np.count_nonzero(np.isfinite(impacts.restitution))) - int(np.count_nonzero(sure))
    label = side.name + (f" ({unsure} less certain ones not drawn)" if unsure else "")
    axes.errorbar(
        impacts.time[sure] - shift,
        impacts.restitution[sure],
        yerr=impacts.restitution_error[sure],
        fmt=".",
        color=colour,
        ecolor=colour,
        elinewidth=0.8,
        label=label,
    )


def _thinned(time: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return at most `MOST_POINTS` points: of each stretch the least and the greatest, so that no peak is lost."""
    stretch = -(-2 * time.size // MOST_POINTS)
    if stretch <= 2:
        return time, values
    count = time.size // stretch
    rows = values[: count * stretch].reshape(count, stretch)
    filled = np.where(np.isfinite(rows), rows, 0.0)
    ends = np.sort(np.stack((np.argmin(filled, axis=1), np.argmax(filled, axis=1)), axis=1), axis=1)
    index = (ends + stretch * np.arange(count)[:, None]).ravel()
    return time[index], values[index]
