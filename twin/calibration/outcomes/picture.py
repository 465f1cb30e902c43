"""A fit of outcomes as a picture: the trials over what the blocks found would do, and how the parameters trade off."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from twin.calibration.outcomes.agreement import Agreement
from twin.calibration.outcomes.fit import OutcomeFit
from twin.calibration.outcomes.likelihood import (
    ALPHA,
    CYCLES,
    ETA,
    FELL,
    FREQUENCY,
    LN_P,
    PHASE,
    SIZE,
    STOOD,
    Likelihood,
)
from twin.calibration.outcomes.trials import COSINE, SINE, Trial
from twin.calibration.outcomes.words import outcome_lines
from twin.errors import InputError
from twin.rocking.compiled import FloatArray

CELLS = 70
DRAWN = 24
"""Blocks the background is made of."""
WORDS = 7.4
FELL_LOOK, STOOD_LOOK = {"marker": "X", "s": 34, "facecolor": "black"}, {"marker": "o", "s": 26, "facecolor": "white"}


def draw_outcomes(fit: OutcomeFit, path: Path) -> None:
    """Write the picture of a fit; the ending of `path` decides the format.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    lines = outcome_lines(fit)
    height = 0.15 * len(lines) + 0.1
    figure: Any = Figure(figsize=(11.5, 6.6 + height), layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")
    rows = figure.add_gridspec(2, 1, height_ratios=[height, 6.6])
    words = figure.add_subplot(rows[0])
    words.set_axis_off()
    words.text(0.0, 1.0, "\n".join(lines), va="top", family="monospace", fontsize=WORDS, transform=words.transAxes)
    below = rows[1].subgridspec(2, 2, width_ratios=[1.7, 1.0])
    _trials(figure, figure.add_subplot(below[:, 0]), fit)
    _trade_off(figure.add_subplot(below[0, 1]), fit, LN_P)
    _trade_off(figure.add_subplot(below[1, 1]), fit, ETA)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=140)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def probabilities(fit: OutcomeFit, kind: str, cycles: float, columns: FloatArray, rows: FloatArray) -> FloatArray:
    """Return the probability of falling over frequencies (Hz) and amplitudes (m/s2), shape (rows, columns)."""
    cells = [Trial(kind, float(a), float(f), overturned=False, cycles=cycles) for a in rows for f in columns]
    likelihood = Likelihood(cells, fit.gravity, *_everywhere())
    chosen = fit.points[np.linspace(0, len(fit.points) - 1, min(DRAWN, len(fit.points))).astype(np.int64)]
    mean = np.mean([likelihood.shares(point) for point in chosen], axis=0)
    # The table is sorted by amplitude, then by frequency, as the cells are.
    return mean.reshape(len(rows), len(columns))


def _everywhere() -> tuple[FloatArray, FloatArray]:
    return np.full(4, -math.inf), np.full(4, math.inf)


def _trials(figure: Any, axes: Any, fit: OutcomeFit) -> None:
    """Draw the trials over the probability of falling; those of another shape than the background's stay away."""
    table = fit.agreement.rows
    (phase, cycles), shown = _commonest(fit.agreement)
    kind = COSINE if phase > 0.0 else SINE
    low, high = _span(shown[:, FREQUENCY])
    columns = np.linspace(low, high, CELLS)
    low, high = _span(shown[:, SIZE])
    rows = np.linspace(low, high, CELLS)
    falls = probabilities(fit, kind, cycles, columns, rows)
    mesh = axes.pcolormesh(columns, rows, falls, cmap="Greys", vmin=0.0, vmax=1.6, shading="nearest", rasterized=True)
    bar = figure.colorbar(mesh, ax=axes, location="bottom", shrink=0.6, aspect=40, boundaries=np.linspace(0, 1, 101))
    bar.set_ticks([0.0, 0.25, 0.5, 0.75, 1.0])
    bar.set_label("probability that the blocks found overturn")
    for column, style, name in ((STOOD, STOOD_LOOK, "stood"), (FELL, FELL_LOOK, "fell")):
        some = shown[shown[:, column] > 0]
        edge = "black" if column == STOOD else "white"
        axes.scatter(
            some[:, FREQUENCY], some[:, SIZE], edgecolor=edge, lw=0.8, zorder=3, label=f"{name} ({len(some)})", **style
        )
    for count, (row, _, _) in enumerate(fit.agreement.strange):
        label = "improbable for them (under 5 %)" if count == 0 else None
        ring = {"facecolor": "none", "edgecolor": "tab:red", "s": 130, "lw": 1.6}
        axes.scatter(table[row, FREQUENCY], table[row, SIZE], zorder=4, label=label, **ring)
    axes.set_xlim(columns[0], columns[-1])
    axes.set_ylim(rows[0], rows[-1])
    axes.set_xlabel("frequency [Hz]")
    axes.set_ylabel("amplitude [m/s²]")
    right = axes.secondary_yaxis("right", functions=(_times(1.0 / fit.gravity), _times(fit.gravity)))
    right.set_ylabel("amplitude [g]")
    length = "one cycle" if cycles == 1.0 else f"{cycles:g} cycles"
    hidden = len(table) - len(shown)
    more = f"; {hidden} trials of another shape not shown" if hidden else ""
    axes.set_title(f"trials of a {kind}, {length}{more}", fontsize=10, loc="left")
    axes.legend(loc="upper left", fontsize=8, framealpha=0.95)


def _times(factor: float) -> Callable[[FloatArray], FloatArray]:
    return lambda values: values * factor


def _trade_off(axes: Any, fit: OutcomeFit, k: int) -> None:
    """Draw the sampled blocks in alpha and another parameter, with the likeliest one and both intervals."""
    other, estimate = (np.exp(fit.points[:, k]), fit.p) if k == LN_P else (fit.points[:, k], fit.eta)
    axes.scatter(fit.points[:, ALPHA], other, s=4, color="0.55", lw=0.0, label="sampled blocks")
    axes.plot(fit.alpha.best, estimate.best, "k*", ms=13, mec="white", label="likeliest")
    for low in (fit.alpha.low, fit.alpha.high):
        axes.axvline(low, color="black", lw=0.8, ls=":")
    for low in (estimate.low, estimate.high):
        axes.axhline(low, color="black", lw=0.8, ls=":", label="95 %" if low == estimate.low else None)
    if k == ETA:
        low, high = (float(np.quantile(fit.points[:, ALPHA], level)) for level in (0.001, 0.999))
        grid = np.linspace(low, high, 100)
        axes.plot(grid, np.maximum(0.0, 1.0 - 1.5 * np.sin(grid) ** 2), "k--", lw=1.2, label="Housner's")
    axes.set_xlabel("alpha [rad]")
    axes.set_ylabel("p [rad/s]" if k == LN_P else "eta [-]")
    axes.set_title(f"correlation {fit.correlations[ALPHA, k]:+.2f}", fontsize=10, loc="left")
    axes.legend(fontsize=7.5, loc="best")


def _commonest(agreement: Agreement) -> tuple[tuple[float, float], FloatArray]:
    """Return phase and cycles of most trials, and their rows."""
    rows = agreement.rows
    shapes = Counter(zip(rows[:, PHASE].tolist(), rows[:, CYCLES].tolist(), strict=True))
    phase, cycles = max(shapes, key=lambda shape: shapes[shape])
    return (phase, cycles), rows[(rows[:, PHASE] == phase) & (rows[:, CYCLES] == cycles)]


def _span(values: FloatArray) -> tuple[float, float]:
    """Return a span with a little room on both sides, above 0."""
    low, high = float(np.min(values)), float(np.max(values))
    room = 0.05 * (high - low) or 0.1 * high
    return max(low - room, 0.2 * low), high + room
