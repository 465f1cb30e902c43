"""A calibration as a picture: measurement and fit, residuals, restitution by impact, slenderness and frequency."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from twin.calibration.calibrate import FREQUENCY, RESTITUTION, SLENDERNESS, Calibration, K
from twin.calibration.course import course
from twin.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from twin.calibration.contact import Contact
    from twin.rocking_data.noise import FloatArray

MEASURED, FITTED, HOUSNER = "#0072B2", "#D55E00", "#009E73"
"""Told apart by every kind of colour sight (Okabe & Ito 2008), and by their lines."""
MOST_POINTS = 8000
ENDINGS = (".png", ".svg", ".pdf")
FINE = 40
"""Points a flight of the fitted curve is drawn with."""


def draw_calibration(found: Calibration, path: Path, title: str, contact: Contact | None = None) -> None:
    """Write the picture; the ending of `path` decides the format.

    Raises
    ------
    InputError
        The format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    if path.suffix.lower() not in ENDINGS:
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")
    figure: Any = Figure(figsize=(11, 9.5), layout="constrained")
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(3, 2, height_ratios=[3, 1.6, 2.8], width_ratios=[2.2, 1])
    rotation = figure.add_subplot(grid[0, :])
    residual = figure.add_subplot(grid[1, :], sharex=rotation)
    ratio, ellipse = figure.add_subplot(grid[2, 0]), figure.add_subplot(grid[2, 1])
    _rotation(rotation, found, title)
    _residual(residual, found)
    _ratios(ratio, found, contact)
    _ellipse(ellipse, found)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=120)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _rotation(axes: Any, found: Calibration, title: str) -> None:
    fit = found.fit
    every = max(1, fit.time.size // MOST_POINTS)
    axes.plot(
        fit.time[::every],
        1e3 * (fit.rotation[::every] - fit.zero),
        ".",
        color=MEASURED,
        ms=2.5,
        label="measured - zero",
    )
    for number, (time, values) in enumerate(_curves(found)):
        axes.plot(time, 1e3 * values, color=FITTED, lw=1.2, label="fit" if number == 0 else None)
    alpha = 1e3 * fit.alpha
    low, high = axes.get_ylim()
    for side in (-1.0, 1.0):
        if low <= side * alpha <= high:
            axes.axhline(side * alpha, color="0.5", lw=0.8, ls="--")
            axes.text(axes.get_xlim()[0], side * alpha, " alpha", va="bottom", fontsize=8, color="0.35")
    axes.set_ylabel("rotation [mrad]")
    kinds = dict.fromkeys(suspicion.kind for suspicion in found.suspicions)
    axes.set_title(title + (f"; suspicion: {', '.join(kinds)}" if kinds else ""), fontsize=10)
    axes.legend(loc="upper right", fontsize=8)
    axes.grid(alpha=0.3)


def _curves(found: Calibration) -> list[tuple[FloatArray, FloatArray]]:
    """Return the fitted curve in pieces, each without a gap."""
    flights, x = found.fit.flights, found.fit.adjusted.x
    pieces: list[tuple[FloatArray, FloatArray]] = []
    for number in range(flights.left.size):
        begin, end = float(x[flights.left[number]]), float(x[flights.right[number]])
        if number == 0 and flights.entry:
            begin = float(np.min(flights.time[flights.flight == 0], initial=begin))
        time = np.linspace(begin, end, FINE)
        fine = flights._replace(
            flight=np.full(FINE, number, dtype=np.int64), time=time, rotation=np.zeros(FINE)
        )  # fmt: skip
        values = course(fine, x).rotation - found.fit.zero
        if pieces and pieces[-1][0][-1] == time[0]:
            pieces[-1] = (np.append(pieces[-1][0], time), np.append(pieces[-1][1], values))
        else:
            pieces.append((time, values))
    return pieces


def _residual(axes: Any, found: Calibration) -> None:
    fit = found.fit
    kept = fit.adjusted.kept
    every = max(1, fit.flights.time.size // MOST_POINTS)
    time, misfit = fit.flights.time[::every], 1e3 * fit.adjusted.misfit[::every]
    axes.plot(time[kept[::every]], misfit[kept[::every]], ".", color="0.35", ms=2)
    wild = ~kept
    if np.any(wild):
        axes.plot(
            fit.flights.time[wild], 1e3 * fit.adjusted.misfit[wild], "x", color=FITTED, ms=5, label="wild, left out"
        )
        axes.legend(loc="upper right", fontsize=8)
    reach = max(4.5 * 1e3 * fit.noise, float(np.quantile(np.abs(misfit), 0.999)))
    axes.set_ylim(-reach, reach)
    axes.axhspan(-1.96e3 * fit.noise, 1.96e3 * fit.noise, color=MEASURED, alpha=0.12, lw=0)
    axes.set_ylabel("measured - fit\n[mrad]")
    axes.set_xlabel("time [s]; band: 1.96 standard deviations of the residuals")
    axes.grid(alpha=0.3)


def _ratios(axes: Any, found: Calibration, contact: Contact | None) -> None:
    ratio, overall = found.restitution, found.estimates[RESTITUTION]
    axes.errorbar(
        ratio.rate,
        ratio.ratio,
        yerr=1.96 * ratio.error,
        fmt="o",
        ms=4,
        color=MEASURED,
        elinewidth=0.8,
        capsize=2,
        label="one impact, 95 %",
    )
    axes.axhspan(overall.low, overall.high, color=FITTED, alpha=0.2, lw=0)
    axes.axhline(
        overall.value,
        color=FITTED,
        lw=1.5,
        label=f"all impacts {overall.value:.4f}, as improved formula with k = {found.estimates[K].value:.3f}",
    )
    housner = found.housner.value
    axes.axhline(housner, color=HOUSNER, lw=1.5, ls="--", label=f"Housner {housner:.4f}")
    if contact is not None:
        edge = contact.edge.estimates[RESTITUTION].value
        axes.axhline(edge, color="black", lw=1.2, ls="-.", label=f"on its edges {edge:.4f}")
    _limits(axes, found)
    axes.set_xlabel("angular velocity before the impact [rad/s]")
    axes.set_ylabel("restitution")
    axes.legend(loc="best", fontsize=8)
    axes.grid(alpha=0.3)


def _limits(axes: Any, found: Calibration) -> None:
    """Show all sure impacts and the lines; an unsure one may stick out."""
    ratio = found.restitution
    sure = ratio.error <= 3.0 * np.median(ratio.error)
    shown = np.concatenate(
        [
            (ratio.ratio - 2.5 * ratio.error)[sure],
            (ratio.ratio + 2.5 * ratio.error)[sure],
            [found.housner.value, found.estimates[RESTITUTION].value],
        ]
    )
    low, high = float(np.min(shown)), float(np.max(shown))
    margin = 0.08 * (high - low) + 1e-6
    axes.set_ylim(low - margin, high + margin)


def _ellipse(axes: Any, found: Calibration) -> None:
    """Draw the 95 % region of slenderness and frequency parameter, and the nominal block."""
    place = found.fit.flights.instants
    covariance = found.fit.covariance[place : place + 2, place : place + 2]
    alpha, p = found.estimates[SLENDERNESS].value, found.estimates[FREQUENCY].value
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    values, vectors = np.linalg.eigh(covariance)
    # chi-squared with two degrees of freedom: 5.991
    reach = (
        math.sqrt(5.991)
        * vectors
        @ (np.sqrt(np.maximum(values, 0.0))[:, None] * np.stack([np.cos(turn), np.sin(turn)]))
    )
    if found.fit.adjusted.free[place : place + 2].all():
        axes.plot(alpha * np.exp(reach[0]), p * np.exp(reach[1]), color=FITTED, lw=1.5, label="95 % region")
    axes.plot(alpha, p, "o", color=FITTED, ms=5, label="fit")
    if found.nominal is not None:
        axes.plot(
            found.nominal.slenderness, found.nominal.frequency_parameter, "s", color=HOUSNER, ms=6, mfc="none",
            label="nominal",
        )  # fmt: skip
    axes.set_xlabel("slenderness alpha [rad]")
    axes.set_ylabel("frequency parameter p [rad/s]")
    axes.ticklabel_format(useOffset=False)
    axes.tick_params(labelsize=8)
    axes.locator_params(axis="x", nbins=4)
    axes.margins(0.35)
    axes.legend(loc="best", fontsize=8)
    axes.grid(alpha=0.3)
