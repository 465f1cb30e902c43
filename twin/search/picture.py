"""A search as a picture: what the block does over the field, what the table can make, and the proposed runs."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from twin.errors import InputError
from twin.map.picture import COLOURS
from twin.rehearsal import initial_rotation
from twin.rocking.batch.codes import OVERTURNED, ROCKED, STAYED, UNDECIDED
from twin.rocking.run import parameters
from twin.search.cells import look
from twin.search.find import Search

NAMED = 60
"""Characters of a proposal in the legend."""


def draw_search(search: Search, path: Path) -> None:
    """Write the picture; the ending of `path` decides the format.

    Raises
    ------
    InputError
        Where the format is unknown or the file cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.colors import ListedColormap
    from matplotlib.figure import Figure
    from matplotlib.patches import Patch

    figure: Any = Figure(figsize=(10.0, 6.4), layout="constrained")
    if path.suffix.lstrip(".").lower() not in FigureCanvasAgg(figure).get_supported_filetypes():
        raise InputError(f"--out {path}: the picture of a search ends in .png, .svg or .pdf")
    field = search.survey
    family = field.family
    kinds = _kinds(search)
    single = len(field.shapes) == 1
    # A single shape is a band one can see.
    shapes = field.shapes[0] * np.array([0.97, 1.03]) if single else field.shapes
    kinds = np.repeat(kinds, 2, axis=1) if single else kinds
    axes = figure.add_subplot()
    scale = {"cmap": ListedColormap(list(COLOURS.values())), "vmin": -0.5, "vmax": len(COLOURS) - 0.5}
    axes.pcolormesh(shapes, field.sizes, kinds, shading="nearest", rasterized=True, **scale)
    axes.set_yscale("log")
    if not single:
        axes.set_xscale("log")
    axes.set_xlim(shapes[0], shapes[-1])
    axes.set_ylim(field.sizes[0], field.sizes[-1])
    tops = np.repeat(field.reach.largest, 2) if single else field.reach.largest
    bottom = np.nan_to_num(tops, nan=float(field.sizes[0]))
    axes.fill_between(
        shapes, bottom, field.sizes[-1], facecolor="none", edgecolor="black", hatch="///", lw=0, alpha=0.45
    )
    axes.plot(shapes, tops, color="black", lw=1.6)
    for k, proposal in enumerate(search.proposals):
        axes.plot(proposal.shape, proposal.size, "o", ms=15, mfc="white", mec="black", zorder=4)
        axes.annotate(f"{k + 1}", (proposal.shape, proposal.size), ha="center", va="center", fontsize=9, zorder=5)
    axes.set_ylabel(f"{family.size_name} [{family.size.unit.removeprefix('of ')}]")
    axes.set_xlabel(f"{family.shape_name} [{family.shape.unit}]" if family.shape.key else "the record")
    if not family.shape.key:
        axes.set_xticks([])
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(_plain)
        axis.set_minor_formatter(_some)
    axes.set_title(f"{search.scene.title or search.scene.name}: {search.goal.aim.value}", fontsize=10)
    handles = [
        Patch(facecolor=colour, edgecolor="0.4", label=name)
        for k, (name, colour) in enumerate(COLOURS.items())
        if bool(np.any(kinds == k))
    ]
    handles.append(Patch(facecolor="none", edgecolor="0.3", hatch="///", label=f"beyond {search.capacity.name}"))
    handles += [
        Patch(facecolor="none", edgecolor="none", label=f"{k + 1}: {proposal.words}"[:NAMED])
        for k, proposal in enumerate(search.proposals)
    ]
    figure.legend(handles=handles, loc="outside right upper", fontsize=8, frameon=False)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        figure.savefig(path, dpi=150)
    except OSError as error:
        raise InputError(f"--out {path} cannot be written: {(error.strerror or str(error)).lower()}") from None


def _plain(value: float, _: object = None) -> str:
    return f"{value:g}"


def _some(value: float, _: object = None) -> str:
    """Name only the 2 and 5 of each decade: there is no room for more."""
    return f"{value:g}" if f"{value:e}"[0] in "25" else ""


def _kinds(search: Search) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """Return indices into `COLOURS` of the scene's own block, without any spread."""
    field = search.survey
    rehearsal = field.rehearsal
    body = parameters(rehearsal.block, rehearsal.restitution)
    looked = look(body, field.pieces, initial_rotation(rehearsal.scene))
    fallen = 2 + np.minimum(looked.impacts, 3)
    conditions = [looked.codes == STAYED, looked.codes == ROCKED, looked.codes == OVERTURNED, looked.codes == UNDECIDED]
    kinds = np.select(conditions, [0, 1, fallen, 6], 7)
    kinds[~field.possible.reshape(-1)] = 7
    return kinds.reshape(field.possible.shape).astype(np.int64)
