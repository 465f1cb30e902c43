"""A map being made, on disk: cells are written where they belong as they come, in memory that does not grow.

One file: a line of JSON (what was asked), a byte per block (whether it is there), then each layer's numbers in the
map's order. A block's byte is written after its numbers, so a run that was broken off goes on from what is there.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import BinaryIO, Self

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.map.blocks import Answer, Question, block_ranges
from twin.rocking.restitution import Improved

LAYERS = {"outcome": "<u1", "impacts": "<i4", "direction": "<i1"}
TIMES = {"overturning_time": "<f8"}
PEAKS = {"peak_rotation": "<f8"}
_HEAD = 4096


@dataclass(frozen=True, slots=True)
class Place:
    """Where a layer's numbers begin in the file, and of what sort they are."""

    offset: int
    dtype: np.dtype[np.generic]


class MapStore:
    """The unfinished map of a question; use it as a context manager.

    Parameters
    ----------
    path : Path
    question : Question
    resume : bool
        Go on with the file there is, which must be of the same question; otherwise there must be none.

    Raises
    ------
    InputError
        One sentence: the file is there, or is not, or belongs to another question, or cannot be written.
    """

    def __init__(self, path: Path, question: Question, *, resume: bool = False) -> None:
        self.path = path
        self.question = question
        cells = question.grid.size
        self._block = question.block_size
        self._blocks = -(-cells // self._block)
        names = LAYERS | (TIMES if question.times else {}) | (PEAKS if question.peaks else {})
        self.layers: dict[str, Place] = {}
        offset = _HEAD + self._blocks
        for name, code in names.items():
            dtype = np.dtype(code)
            self.layers[name] = Place(offset, dtype)
            offset += cells * dtype.itemsize
        head = (json.dumps(asked(question)) + "\n").encode()
        try:
            self._file = self._opened(head.ljust(_HEAD), offset, resume)
        except OSError as error:
            raise InputError(f"{path} cannot be written: {(error.strerror or str(error)).lower()}") from None
        self._done = np.frombuffer(self._read(_HEAD, self._blocks), dtype=np.uint8).copy()

    def _opened(self, head: bytes, size: int, resume: bool) -> BinaryIO:
        if resume:
            if not self.path.exists():
                raise InputError(f"there is no unfinished map {self.path} to resume")
            file = self.path.open("r+b")
            if file.read(_HEAD) != head:
                file.close()
                raise InputError(f"{self.path} is the unfinished map of another question; ask that one, or delete it")
            return file
        if self.path.exists():
            raise InputError(f"{self.path} is an unfinished map: --resume goes on with it, or delete it")
        self.path.parent.mkdir(parents=True, exist_ok=True)
        file = self.path.open("x+b")
        file.write(head)
        file.truncate(size)
        return file

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._file.close()

    @property
    def cells_done(self) -> int:
        """How many cells are there."""
        full = int(self._done.sum()) * self._block
        missing = self._blocks * self._block - self.question.grid.size
        return full - missing if self._done[-1] else full

    @property
    def complete(self) -> bool:
        """Whether every cell is there."""
        return bool(self._done.all())

    def missing(self) -> Iterator[tuple[int, int]]:
        """Yield the ranges of cells that are not there yet."""
        for block, found in enumerate(block_ranges(self.question)):
            if not self._done[block]:
                yield found

    def put(self, answer: Answer) -> None:
        """Write the cells of a block."""
        values = (answer.codes, answer.impacts, answer.directions, answer.times, answer.peaks)
        for name, numbers in zip((*LAYERS, *TIMES, *PEAKS), values, strict=True):
            if name in self.layers:
                place = self.layers[name]
                self._file.seek(place.offset + answer.start * place.dtype.itemsize)
                self._file.write(numbers.astype(place.dtype).tobytes())
        self._file.flush()
        block = answer.start // self._block
        self._file.seek(_HEAD + block)
        self._file.write(b"\x01")
        self._file.flush()
        self._done[block] = 1

    def read(self, name: str, start: int, stop: int) -> NDArray[np.generic]:
        """Return cells of a layer, from `start` to before `stop`."""
        place = self.layers[name]
        size = place.dtype.itemsize
        return np.frombuffer(self._read(place.offset + start * size, (stop - start) * size), dtype=place.dtype)

    def chunks(self, name: str, size: int = 1 << 16) -> Iterator[NDArray[np.generic]]:
        """Yield a layer's cells in order, `size` at a time."""
        cells = self.question.grid.size
        for start in range(0, cells, size):
            yield self.read(name, start, min(start + size, cells))

    def _read(self, offset: int, size: int) -> bytes:
        self._file.seek(offset)
        return self._file.read(size)


def asked(question: Question) -> dict[str, object]:
    """Return the question as plain numbers and words: what a map's file says of itself."""
    grid, eta = question.grid, question.restitution
    return {
        "kind": grid.kind,
        "rows": _axis(grid.rows),
        "columns": _axis(grid.columns),
        "block": {"width_m": grid.block.width, "height_m": grid.block.height, "gravity_m_s2": grid.block.gravity},
        "restitution": {"improved": eta.k} if isinstance(eta, Improved) else eta,
        "duration_s": grid.duration,
        "rebound": grid.rebound,
        "pulse_acceleration_m_s2": grid.pulse_acceleration,
        "initial_rotation_rad": question.initial_rotation,
        "method": question.method,
        "model": question.model,
        "times": question.times,
        "peaks": question.peaks,
        "tolerance_rad": question.tolerance,
    }


def _axis(values: NDArray[np.float64]) -> dict[str, object]:
    digest = hashlib.sha256(values.tobytes()).hexdigest()[:16]
    return {"first": float(values[0]), "last": float(values[-1]), "count": len(values), "digest": digest}
