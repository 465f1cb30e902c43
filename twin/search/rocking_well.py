"""Runs that rock the block far and safely: the largest rotation below the first unsafe size of each shape."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.search.cells import count, look
from twin.search.field import peaks_apart
from twin.search.judge import Judge, Verdict, interval
from twin.search.proposal import Proposal, use_words
from twin.search.safety import climb, ends_words, percent_words
from twin.search.survey import Survey

COARSE = 0.01
"""Relative step of the sizes of each shape."""
MORE = 3
"""Candidates beyond those that are wanted: some turn out less good at a closer look."""
FAINT = 0.05
"""Rotations below this share of alpha are no rocking worth a run."""


def find_rocking(field: Survey, judge: Judge, limit: float, most: int) -> Iterator[Proposal]:
    """Yield proposals, unsorted; at most `most` and a few."""
    alpha = judge.body[0]
    shape_of = field.possible.shape
    found = count(judge.scouts, field.pieces)
    fallen = (found.overturned + found.undecided > 0).reshape(shape_of)
    below = ~np.logical_or.accumulate(fallen, axis=0) & field.inside
    cells = np.nonzero(below.reshape(-1))[0]
    peaks = np.full(field.possible.size, np.nan)
    if cells.size:
        peaks[cells] = look(judge.body, field.pieces[cells], judge.rotation, peaks=True).peaks
    score = peaks.reshape(shape_of) / alpha
    for k, (_, j) in enumerate(peaks_apart(score, below & (score > FAINT), field.sizes, field.shapes)):
        if k == most + MORE:
            return
        shape = field.family.rounded(1.0, float(field.shapes[j]))[1]
        top = field.family.largest_that_fits(shape, float(field.reach.largest[j]))
        if top is None:
            continue
        ladder = climb(field, judge, shape, top, limit, COARSE)
        verdict = _farthest(field, judge, shape, ladder.sizes[: ladder.safe], limit)
        if verdict is None:
            continue
        peak = verdict.rehearsal.response.peak_rotation / verdict.rehearsal.block.slenderness
        why = (
            f"rocks to {peak:.2f} of alpha, and overturns in {interval(verdict.overturning)} of futures, below "
            f"{percent_words(limit)}; {ends_words(field.family, ladder)}; {use_words(verdict.rehearsal)}"
        )
        yield judge.proposal(verdict, why, peak, peak_of_alpha=peak, first_unsafe_size=ladder.first_unsafe)


def _farthest(field: Survey, judge: Judge, shape: float, sizes: np.ndarray, limit: float) -> Verdict | None:
    """Return the size of the largest rotation that the judge finds safe too."""
    if not len(sizes):
        return None
    pieces, possible = field.column(shape, sizes)
    peaks = np.where(possible, look(judge.body, pieces, judge.rotation, peaks=True).peaks, np.nan)
    for k in np.argsort(-np.nan_to_num(peaks, nan=-1.0)).tolist()[:10]:
        size, shape = field.family.rounded(float(sizes[k]), shape, down=True)
        verdict = judge.verdict(size, shape)
        if verdict is not None and verdict.overturning.high < limit:
            return verdict
    return None
