"""The largest amplitude that is safe, below the first that is not: what stands again above that is no safe place.

Over a full sine the block overturns from some amplitude on, and stands again above that band before it overturns
without impact (Zhang and Makris 2001). An amplitude in this gap of stability is reached only through pulses that
overturn it, staged levels among them, so it is never called safe.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rocking.compiled import FloatArray
from twin.search.family import Family
from twin.search.judge import Judge, Verdict, interval
from twin.search.proposal import Proposal, beyond_words, use_words
from twin.search.survey import Survey

STEP = 0.005
"""Relative step of the sizes looked at; a band of overturning thinner than this and the spreads can be missed."""
TRIES = 40
"""Steps down until the judge agrees."""


@dataclass(frozen=True, slots=True)
class Ladder:
    """Sizes of one shape from small to the largest that fits.

    Attributes
    ----------
    sizes : ndarray
    safe : int
        How many of them, from the first, are below the first unsafe one.
    again : tuple of float or None
        The first range of sizes above that in which the block stands again, as safely; None where there is none.
    """

    sizes: FloatArray
    safe: int
    again: tuple[float, float] | None

    @property
    def first_unsafe(self) -> float | None:
        """The first size that is not safe; None where the table ends first."""
        return float(self.sizes[self.safe]) if self.safe < len(self.sizes) else None


def climb(field: Survey, judge: Judge, shape: float, top: float, limit: float, step: float = STEP) -> Ladder:
    """Look at every size of a shape up to `top`; unsafe is one whose probability may be above `limit`."""
    bottom = min(field.family.size.low, 0.5 * top)
    steps = max(2, int(np.ceil(np.log(top / bottom) / step)) + 1)
    sizes = np.geomspace(bottom, top, steps)
    found = judge.climbed(shape, sizes, judge.ladder)
    safe = np.array([probability.high < limit for probability in found])
    first = steps
    for k in np.nonzero(~safe)[0].tolist():
        if found[k].low < limit:
            # On the edge: more futures tell.
            safe[k] = judge.climbed(shape, sizes[k : k + 1], judge.jury)[0].high < limit
        if not safe[k]:
            first = k
            break
    return Ladder(sizes, first, _again(sizes, safe, first))


def _again(sizes: FloatArray, safe: NDArray[np.bool_], first: int) -> tuple[float, float] | None:
    """Return the first run of at least three safe sizes above the first unsafe one."""
    k = first
    while k < len(sizes):
        end = k
        while end < len(sizes) and safe[end]:
            end += 1
        if end - k >= 3:
            return float(sizes[k]), float(sizes[end - 1])
        k = max(end, k + 1)
    return None


def largest_safe(field: Survey, judge: Judge, ladder: Ladder, shape: float, limit: float) -> Verdict | None:
    """Return the largest size below the first unsafe one that the judge finds safe, with a scene's digits."""
    family: Family = field.family
    for k in range(ladder.safe - 1, max(ladder.safe - 1 - TRIES, -1), -1):
        size, shape = family.rounded(float(ladder.sizes[k]), shape, down=True)
        verdict = judge.verdict(size, shape)
        if verdict is not None and verdict.overturning.high < limit:
            return verdict
    return None


def find_safe(field: Survey, judge: Judge, shape: float, limit: float) -> tuple[list[Proposal], list[str]]:
    """Return the largest safe run of one shape, if there is one, and what is to be said beside it."""
    family = field.family
    top = float(field.reach.largest[int(np.argmin(np.abs(field.shapes - shape)))])
    if not np.isfinite(top):
        words = beyond_words(family, family.asked[0], shape)
        return [], [f"nothing {_at(family, shape)} fits {family.capacity.name}: {words}"]
    ladder = climb(field, judge, shape, top, limit)
    verdict = largest_safe(field, judge, ladder, shape, limit)
    remarks = gap_words(family, ladder, limit)
    if verdict is None:
        return [], [f"no {family.size_name} {_at(family, shape)} is safe below {percent_words(limit)}", *remarks]
    overturning = verdict.overturning
    why = (
        f"overturns in {interval(overturning)} of futures, below {percent_words(limit)}; {ends_words(family, ladder)}; "
        f"{use_words(verdict.rehearsal)}"
    )
    score = verdict.size
    return [judge.proposal(verdict, why, score, first_unsafe_size=ladder.first_unsafe)], remarks


def ends_words(family: Family, ladder: Ladder) -> str:
    """Return where the safe sizes end."""
    if ladder.first_unsafe is None:
        return f"{family.capacity.name} ends before any {family.size_name} is unsafe"
    return f"the first unsafe {family.size_name} is {family.size_words(ladder.first_unsafe)}"


def gap_words(family: Family, ladder: Ladder, limit: float) -> list[str]:
    """Return that the block would stand again above the first unsafe size, where it would."""
    if ladder.again is None or ladder.first_unsafe is None:
        return []
    low, high = (family.size_words(size) for size in ladder.again)
    return [
        f"between {low} and {high} the block would stand again in all but {percent_words(limit)} of futures, above "
        "sizes that overturn it: a gap of stability, not proposed"
    ]


def _at(family: Family, shape: float) -> str:
    return f"{family.between} {shape:.4g} {family.shape.unit}" if family.shape.key else "of the record"


def percent_words(limit: float) -> str:
    """Return a limit in percent."""
    return f"{100.0 * limit:g} %"
