"""The field that is searched: every size and shape of a family, what the table can make of it, what the block does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from excitation.demand import ends_moving
from twin.errors import InputError
from twin.margin import shaking_of
from twin.rehearsal import NotPossibleError, Rehearsal, initial_rotation, rehearse
from twin.rocking.compiled import FloatArray
from twin.search.cells import padded, stacked
from twin.search.family import Family
from twin.search.reach import Reach, reach

SIZES, SHAPES = 96, 40
BEYOND = 1.3
"""The field goes so far beyond the largest size that fits: a boundary out of the table's reach is one too."""


@dataclass(frozen=True, slots=True)
class Survey:
    """Sizes x shapes, both even in their logarithms.

    Attributes
    ----------
    family : Family
    rehearsal : Rehearsal
        Of one run of the family: how the table makes any of them.
    sizes, shapes : ndarray
        In the scene file's units.
    reach : Reach
    pieces : ndarray, shape (cells, n, 7)
        Base motion of every cell, row by row.
    possible : ndarray of bool, shape (sizes, shapes)
        Whether there is such a pulse.
    """

    family: Family
    rehearsal: Rehearsal
    sizes: FloatArray
    shapes: FloatArray
    reach: Reach
    pieces: FloatArray
    possible: NDArray[np.bool_]

    @property
    def inside(self) -> NDArray[np.bool_]:
        """Which cells the table makes exactly as asked."""
        return self.possible & self.reach.inside(self.sizes)

    @property
    def from_rest(self) -> bool:
        """Whether the block is not let go with a tilt: whatever it leans by is there until it is shaken."""
        return initial_rotation(self.family.scene) == 0.0

    def column(self, shape: float, sizes: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
        """Return the base motions of other sizes of one shape, and which there are."""
        return column(self.family, self.rehearsal, shape, sizes)


def survey(family: Family, shapes: FloatArray, *, sizes: int = SIZES) -> Survey:
    """Lay out the field of `shapes`, even in their logarithms, and of as many sizes as are told.

    Raises
    ------
    InputError
        Where the table can make no run of the family at all; one sentence.
    """
    found = reach(family, shapes)
    rehearsal = _any_rehearsal(family, found)
    top = float(np.nanmax(found.largest)) if not found.empty else family.size.high / BEYOND
    rows = np.geomspace(family.size.low, max(top * BEYOND, family.size.low * 2.0), sizes)
    columns = [column(family, rehearsal, shape, rows) for shape in shapes.tolist()]
    longest = max(pieces.shape[1] for pieces, _ in columns)
    pieces = np.stack([padded(pieces, longest) for pieces, _ in columns], axis=1).reshape(-1, longest, 7)
    possible = np.stack([there for _, there in columns], axis=1)
    return Survey(family, rehearsal, rows, shapes, found, pieces, possible)


def column(
    family: Family, rehearsal: Rehearsal, shape: float, sizes: FloatArray
) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return the base motions of sizes of one shape, shape (sizes, n, 7), and which there are.

    A pulse that ends at rest needs no brake, and its motion scales with its size.
    """
    motion_of = shaking_of(rehearsal)
    first = family.pulse(float(sizes[0]), shape)
    from_rest = initial_rotation(family.scene) == 0.0 and family.capacity.machine is None
    if first is None or not from_rest or ends_moving(first):
        return stacked([family.pulse(size, shape) for size in sizes.tolist()], motion_of)
    pieces = np.repeat(motion_of(first)[None], len(sizes), axis=0)
    pieces[:, :, 2:5] *= (sizes / sizes[0])[:, None, None]
    return pieces, np.ones(len(sizes), dtype=np.bool_)


def _any_rehearsal(family: Family, found: Reach) -> Rehearsal:
    """Return the rehearsal of the scene's own run, or of one that fits where there is no run of that."""
    try:
        return rehearse(family.scene, family.capacity)
    except NotPossibleError as refusal:
        if found.empty:
            raise InputError(f"{refusal}; no other size or shape of this pulse fits either") from None
    column = int(np.nanargmax(found.largest))
    return rehearse(family.scene_of(float(found.largest[column]), float(found.shapes[column])), family.capacity)
