"""A study as a picture: free rocking of the three models, outcomes and sides over grids, and perturbed starts."""

from __future__ import annotations

import textwrap
from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import InputError
from twin.rocking.methods.problem import LINEARISED, NONLINEAR, QUASI_LINEAR
from twin.sensitivity.cloud import Cloud
from twin.sensitivity.free import SIMPLER, FreeRocking
from twin.sensitivity.outcomes import Panel, other_outcomes
from twin.sensitivity.pulses import LEFT, NAMES, REFUSED, RIGHT, ROCKS, STAYS, UNDECIDED
from twin.sensitivity.study import Forced, Study
from twin.sensitivity.words import study_lines

HEAD, WIDTH = 11, 175
LOOK = {NONLINEAR: ("black", "-"), LINEARISED: ("#0072B2", "--"), QUASI_LINEAR: ("#D55E00", "-.")}
COLOURS = ["#ffffff", "#e4e4e4", "#1f4e79", "#e8a33d", "#000000", "#c9b8d8"]
"""Of the classes in `pulses`, told apart in grey too: the right side is hatched as well."""
MOST_CIRCLES = 400
"""Cells of the quasi-linear model up to which each is shown, and not only those that differ."""
MARKS = {
    STAYS: ("s", "0.75"),
    ROCKS: (".", "0.55"),
    LEFT: ("v", COLOURS[LEFT]),
    RIGHT: ("^", COLOURS[RIGHT]),
    UNDECIDED: ("x", "black"),
}


def draw_study(study: Study, path: Path) -> None:
    """Write the picture of a study; the ending of `path` decides the format.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    lines = _folded(study_lines(study))
    tall = 0.145 * len(lines) + 0.1
    heights = [tall, 3.1, 4.7, 3.9] if study.forced is not None else [tall, 3.1, 3.9]
    figure: Any = Figure(figsize=(13.0, sum(heights) + 0.4), layout="constrained")
    known = FigureCanvasAgg(figure).get_supported_filetypes()
    if path.suffix.lstrip(".").lower() not in known:
        raise InputError(f"--out {path}: a picture ends in .png, .svg or .pdf")
    rows = figure.add_gridspec(len(heights), 1, height_ratios=heights)
    words = figure.add_subplot(rows[0])
    words.set_axis_off()
    words.text(0.0, 1.0, "\n".join(lines), va="top", family="monospace", fontsize=7.4, transform=words.transAxes)
    _free(rows[1].subgridspec(1, 3), figure, study)
    if study.forced is not None:
        _forced(rows[2].subgridspec(1, 3), figure, study, study.forced)
    _cloud(rows[-1].subgridspec(1, 2, width_ratios=[1.3, 1.0]), figure, study)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=130)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _folded(lines: list[str]) -> list[str]:
    folded: list[str] = []
    for line in lines:
        bodies = textwrap.wrap(line[HEAD:], WIDTH) or [""]
        folded += [head + body for head, body in zip([line[:HEAD]] + [" " * HEAD] * len(bodies), bodies, strict=False)]
    return folded


def _free(places: Any, figure: Any, study: Study) -> None:
    """Draw quarter periods over tilt, and the errors of the simpler models over tilt and slenderness."""
    first, second, third = (figure.add_subplot(places[k]) for k in range(3))
    p = study.case.block.frequency_parameter
    for model, (colour, dash) in LOOK.items():
        first.plot(study.tilt.at, p * study.tilt.quarters[model], color=colour, ls=dash, label=model)
    first.set_xlabel("initial tilt / alpha")
    first.set_ylabel("first quarter period, p t")
    first.set_title("a  Free rocking: first quarter period", fontsize=10, loc="left")
    second.set_title("b  Error against the nonlinear model", fontsize=10, loc="left")
    second.set_xlabel("initial tilt / alpha")
    third.set_title(f"c  The same over slenderness, from {study.ratio:.3g} alpha", fontsize=10, loc="left")
    third.set_xlabel("slenderness alpha [rad]")
    third.axvline(study.case.block.slenderness, color="0.5", lw=0.9, label="this block")
    _errors(second, study.tilt)
    _errors(third, study.slenderness)
    for axes in (first, second, third):
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7.5)


def _errors(axes: Any, free: FreeRocking) -> None:
    """Draw the errors in percent: thick the quarter period, thin the time to rest."""
    for model in SIMPLER:
        colour, dash = LOOK[model]
        axes.plot(free.at, 100.0 * free.quarter_errors(model), color=colour, ls=dash, lw=2.0, label=f"{model}: quarter")
        axes.plot(free.at, 100.0 * free.rest_errors(model), color=colour, ls=dash, lw=0.9, label=f"{model}: rest")
    axes.axhline(0.0, color="black", lw=0.7)
    axes.set_ylabel("error of the time [%]")


def _forced(places: Any, figure: Any, study: Study, forced: Forced) -> None:
    """Draw the nonlinear outcomes over tilt and amplitude, where the simpler models differ, and over slenderness."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    first, second, third = (figure.add_subplot(places[k]) for k in range(3))
    _panel(first, forced.nonlinear)
    first.set_title("d  Nonlinear: outcome and side", fontsize=10, loc="left")
    _panel(second, forced.nonlinear, faint=True)
    _disagreement(second, forced.nonlinear, forced.linearised)
    if forced.sparse is not None and forced.sparse_truth is not None:
        _sparse(second, forced.sparse, forced.sparse_truth)
    second.set_title("e  Where the simpler models differ (colours of d)", fontsize=10, loc="left")
    _panel(third, forced.slender)
    _disagreement(third, forced.slender, forced.slender_linearised)
    third.set_title("f  Over slenderness, at the scene's amplitude", fontsize=10, loc="left")
    here: dict[str, Any] = {"color": "black", "marker": "P", "ms": 10, "mfc": "white", "ls": "", "zorder": 6}
    for axes in (first, second, third):
        axes.set_xlabel("initial tilt / alpha   (positive: to the right)")
        beside = study.case.block.slenderness if axes is third else 1.0
        axes.plot([study.case.relative_tilt], [beside], **here)
        axes.set_ylabel("slenderness alpha [rad]" if axes is third else "factor on the scene's amplitude")
    handles: list[Any] = [
        Patch(facecolor=COLOURS[k], edgecolor="0.3", hatch="////" if k == RIGHT else None, label=NAMES[k])
        for k in range(len(NAMES))
        if k < UNDECIDED or forced.nonlinear.count(k) or forced.slender.count(k)
    ]
    handles.append(Line2D([], [], label="the scene", **here))
    _legend(first, handles)
    dot: dict[str, Any] = {"ls": "", "color": "black"}
    marks = [
        Line2D([], [], marker="x", ms=5, label=f"{LINEARISED}: other outcome", **dot),
        Line2D([], [], marker="|", ms=8, label=f"{LINEARISED}: other side", **dot),
    ]
    if forced.sparse is not None:
        few = forced.sparse.classes.size <= MOST_CIRCLES
        name = f"{QUASI_LINEAR}: other outcome or side"
        marks.append(Line2D([], [], marker="o", ms=6 if few else 3, label=name, **dot))
        if few:
            marks.append(Line2D([], [], marker="o", ms=4, mfc="white", label=f"{QUASI_LINEAR}: the same", **dot))
    _legend(second, marks)


def _legend(axes: Any, handles: list[Any] | None = None) -> None:
    """Put the legend below the axes, where it hides nothing."""
    more = {} if handles is None else {"handles": handles}
    axes.legend(fontsize=7.5, ncols=2, loc="upper center", bbox_to_anchor=(0.5, -0.17), frameon=False, **more)


def _panel(axes: Any, panel: Panel, *, faint: bool = False) -> None:
    from matplotlib.colors import ListedColormap

    colours: Any = ListedColormap(COLOURS)
    axes.pcolormesh(
        panel.tilts,
        panel.others,
        panel.classes,
        cmap=colours,
        vmin=-0.5,
        vmax=len(COLOURS) - 0.5,
        shading="nearest",
        rasterized=True,
        alpha=0.35 if faint else 1.0,
    )
    if not faint:
        _hatch(axes, panel, panel.classes == RIGHT)
    axes.set_xlim(panel.tilts[0], panel.tilts[-1])
    axes.set_ylim(panel.others[0], panel.others[-1])


def _hatch(axes: Any, panel: Panel, mask: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]) -> None:
    """Hatch whole cells."""
    if bool(np.any(mask)):
        axes.pcolor(
            panel.tilts, panel.others, np.ma.masked_where(~mask, np.zeros(mask.shape)), shading="nearest", alpha=0.0
        )
        axes.contourf(panel.tilts, panel.others, mask.astype(float), levels=[0.5, 1.5], colors="none", hatches=["////"])


def _disagreement(axes: Any, truth: Panel, simpler: Panel) -> None:
    for mask, marker, size in zip(other_outcomes(truth.classes, simpler.classes), ("x", "|"), (9, 22), strict=True):
        rows, columns = np.nonzero(mask)
        axes.scatter(truth.tilts[columns], truth.others[rows], marker=marker, s=size, color="black", lw=0.8, zorder=4)


def _sparse(axes: Any, simpler: Panel, truth: Panel) -> None:
    differs = np.logical_or(*other_outcomes(truth.classes, simpler.classes))
    if simpler.classes.size > MOST_CIRCLES:
        rows, columns = np.nonzero(differs)
        axes.scatter(truth.tilts[columns], truth.others[rows], marker="o", s=8, color="black", zorder=5)
        return
    for wrong, size, face in ((False, 16, "white"), (True, 34, "black")):
        rows, columns = np.nonzero((differs == wrong) & (simpler.classes != REFUSED))
        axes.scatter(
            truth.tilts[columns], truth.others[rows], marker="o", s=size, facecolor=face, edgecolor="black", zorder=5
        )


def _cloud(places: Any, figure: Any, study: Study) -> None:
    """Draw the perturbed starts by what becomes of them, and how much changes with the size of the cloud."""
    cloud = study.cloud
    first, second = (figure.add_subplot(places[k]) for k in range(2))
    degrees = np.degrees(cloud.tilts), np.degrees(cloud.rates)
    for k, (marker, colour) in MARKS.items():
        chosen = cloud.classes == k
        if not bool(np.any(chosen)):
            continue
        look: dict[str, Any] = {"s": 30 if marker == "." else 22, "lw": 0.3}
        if marker != "x":
            look["edgecolor"] = "black" if marker in "^v" else "none"
        label = f"{NAMES[k]}: {cloud.share(k).words}"
        first.scatter(degrees[0][chosen], degrees[1][chosen], marker=marker, color=colour, label=label, **look)
    centre = {"color": "black", "marker": "P", "ms": 11, "mfc": "white", "ls": ""}
    first.plot([np.degrees(study.case.tilt)], [0.0], label=f"unperturbed: {NAMES[cloud.nominal]}", **centre)
    first.set_xlabel("initial tilt [deg]")
    first.set_ylabel("initial rate [deg/s]")
    first.set_title(f"g  {len(cloud.tilts)} perturbed starts (nonlinear), 95 % intervals", fontsize=10, loc="left")
    first.grid(alpha=0.3)
    _legend(first)
    _sizes(second, cloud)


def _sizes(axes: Any, cloud: Cloud) -> None:
    sizes = np.array([size for size, _ in cloud.sizes])
    values = np.array([share.value for _, share in cloud.sizes])
    ends = np.array([share.interval for _, share in cloud.sizes])
    bars = np.abs(ends.T - values)
    axes.errorbar(sizes, 100.0 * values, 100.0 * bars, fmt="ko-", capsize=3, ms=5, lw=1.0)
    axes.set_xscale("log")
    axes.set_xticks(sizes, [f"{size:g}" for size in sizes])
    axes.minorticks_off()
    axes.set_ylim(-3.0, 103.0)
    axes.set_xlabel("size of the cloud, times its spreads")
    axes.set_ylabel("starts of another outcome or side [%]")
    axes.set_title("h  How much changes with the size", fontsize=10, loc="left")
    axes.grid(alpha=0.3)
