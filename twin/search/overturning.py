"""Runs that overturn the block, with or without an impact before: where it is likeliest, far from the boundary."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.search.cells import Counts, Futures, Looked, count, look, padded
from twin.search.field import distances, peaks_apart
from twin.search.goals import Aim
from twin.search.judge import Judge, interval
from twin.search.proposal import Proposal, use_words
from twin.search.survey import Survey

LIKELY = 0.5
"""Cells of a smaller share of futures are no candidates."""
NEARLY_ALL = 0.98
"""Share of the futures in which a cell must do it to count as inside the region whose boundary is kept away from."""
FINER = 7
"""Sizes and shapes of the second look around a candidate, each way over one cell of the first."""
LINE = 0.5
LINE_STEP = 0.0025
"""The distance to the boundary is looked for over +-50 %, in steps of 0.25 %; a thinner gap can be missed."""


def hits(aim: Aim, found: Counts | Looked) -> NDArray[np.int64]:
    """Return in how many futures, or whether (1 or 0), the aim is met."""
    met = found.without_impact if aim is Aim.NO_IMPACT else found.overturned
    return met.astype(np.int64)


def candidates(aim: Aim, field: Survey, futures: Futures, most: int) -> Iterator[tuple[float, float]]:
    """Yield sizes and shapes, the most promising first, far enough apart to be different runs; at most `most`."""
    scored = scores(aim, field, futures)
    for k, (i, j) in enumerate(peaks_apart(scored, field.inside & (scored >= LIKELY), field.sizes, field.shapes)):
        if k == most:
            return
        yield _finer(aim, field, futures, i, j)


def scores(aim: Aim, field: Survey, futures: Futures) -> FloatArray:
    """Return the share of futures of every cell, plus its distance from where that is not nearly all, up to a half."""
    share = hits(aim, _counted(aim, field, futures, field.pieces)).reshape(field.possible.shape) / len(futures.bodies)
    share[~field.possible] = 0.0
    away = distances(share >= NEARLY_ALL, field.sizes, field.shapes)
    return share + np.minimum(away, 0.5)


def nearest_beyond(aim: Aim, field: Survey, futures: Futures) -> tuple[float, float] | None:
    """Return the run that does it and asks least more than the table has; None where none of the field does."""
    scored = scores(aim, field, futures)
    does = field.possible & ~field.inside & (scored >= LIKELY)
    if not bool(does.any()):
        return None
    known = np.where(np.isfinite(field.reach.largest), field.reach.largest, field.sizes[0])
    over = np.where(does, np.log(field.sizes[:, None] / known), math.inf)
    i, j = np.unravel_index(int(np.argmin(over)), over.shape)
    return field.family.rounded(float(field.sizes[i]), float(field.shapes[j]))


def _counted(aim: Aim, field: Survey, futures: Futures, pieces: FloatArray) -> Counts:
    return count(futures, pieces, settling=aim is Aim.NO_IMPACT and field.from_rest)


def _finer(aim: Aim, field: Survey, futures: Futures, i: int, j: int) -> tuple[float, float]:
    """Return the best of a finer look around a cell, inside the table's reach."""
    sizes, shapes = _around(field.sizes, i), _around(field.shapes, j)
    top = field.reach.largest[max(j - 1, 0) : j + 2]
    sizes = sizes[sizes <= np.nanmax(top)]
    if len(sizes) < 2:
        return float(field.sizes[i]), float(field.shapes[j])
    share = np.zeros((len(sizes), len(shapes)))
    for k, shape in enumerate(shapes.tolist()):
        pieces, possible = field.column(shape, sizes)
        share[:, k] = np.where(
            possible,
            hits(aim, _counted(aim, field, futures, pieces)) / len(futures.bodies),
            0.0,
        )
    # Of equally good ones the nearest to the cell that was picked: it is the one farthest from the boundary.
    off = np.hypot(
        np.log(sizes / field.sizes[i])[:, None], np.log(shapes / field.shapes[j])[None, :] if len(shapes) > 1 else 0.0
    )
    for flat in np.argsort(-(share - 0.01 * off), axis=None).tolist():
        a, b = divmod(flat, len(shapes))
        size, shape = field.family.rounded(float(sizes[a]), float(shapes[b]))
        if share[a, b] > 0.0 and field.family.fits(size, shape):
            return size, shape
    return float(field.sizes[i]), float(field.shapes[j])


def _around(axis: FloatArray, k: int) -> FloatArray:
    if len(axis) == 1:
        return axis
    ratio = axis[1] / axis[0]
    around: FloatArray = float(axis[k]) * np.geomspace(1.0 / float(ratio), float(ratio), FINER)
    return around


def clearances(
    aim: Aim, field: Survey, body: FloatArray, rotation: float, size: float, shape: float
) -> tuple[tuple[float | None, float | None], tuple[float | None, float | None]]:
    """Return the nearest relative changes, down and up, of size and of shape at which the aim is no longer met."""
    steps = np.arange(1, round(LINE / LINE_STEP) + 1, dtype=np.float64) * LINE_STEP
    changes = np.concatenate([-steps[::-1], steps])
    pieces, possible = field.column(shape, size * (1.0 + changes))
    along_size = _nearest(changes, hits(aim, look(body, pieces, rotation)).astype(np.bool_) & possible)
    if not field.family.shape.key:
        return along_size, (None, None)
    columns = [field.column(shape * (1.0 + change), np.array([size])) for change in changes.tolist()]
    longest = max(pieces.shape[1] for pieces, _ in columns)
    pieces = np.concatenate([padded(pieces, longest) for pieces, _ in columns])
    met = hits(aim, look(body, pieces, rotation)).astype(np.bool_) & np.array([bool(there[0]) for _, there in columns])
    return along_size, _nearest(changes, met)


def _nearest(changes: FloatArray, met: NDArray[np.bool_]) -> tuple[float | None, float | None]:
    """Return the changes nearest to 0, down and up, at which it is not met; None where there is none."""
    missed = changes[~met]
    down, up = missed[missed < 0.0], missed[missed > 0.0]
    return (float(down.max()) if down.size else None), (float(up.min()) if up.size else None)


def find_overturning(aim: Aim, field: Survey, judge: Judge, most: int) -> Iterator[Proposal]:
    """Yield proposals for "overturn" and "overturn without impact", inside the capacity; at most `most`, unsorted."""
    found = 0
    for size, shape in candidates(aim, field, judge.scouts, 2 * most):
        verdict = judge.verdict(size, shape)
        if verdict is None:
            continue
        met = verdict.without_impact if aim is Aim.NO_IMPACT else verdict.overturning
        along_size, along_shape = clearances(aim, field, judge.body, judge.rotation, size, shape)
        near = _within(along_size)
        does = "overturns without impact" if aim is Aim.NO_IMPACT else "overturns"
        edges = _changes(along_size, field.family.size_name) + _changes(along_shape, field.family.shape_name)
        edge = f"no longer at {', '.join(edges)}" if edges else f"and so for {LINE:.0%} around it".replace("%", " %")
        why = f"{does} in {interval(met)} of futures; {edge}; {use_words(verdict.rehearsal)}"
        yield judge.proposal(
            verdict,
            why,
            # As likely as a hundredth: then the one farther from its boundary.
            score=round(met.low, 2) + min(near, 0.5) * 0.01,
            without_impact_low=verdict.without_impact.low,
            without_impact_high=verdict.without_impact.high,
            change_of_size_down=along_size[0],
            change_of_size_up=along_size[1],
            change_of_shape_down=along_shape[0],
            change_of_shape_up=along_shape[1],
        )
        found += 1
        if found == most:
            return


def _within(change: tuple[float | None, float | None]) -> float:
    return min((abs(value) for value in change if value is not None), default=LINE)


def _changes(change: tuple[float | None, float | None], name: str) -> list[str]:
    return [f"{100.0 * value:+.1f} % of {name}" for value in change if value is not None]
