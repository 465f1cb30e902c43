"""What a bad line does to frames: loses, repeats, swaps and spoils them."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    import numpy as np

    from devices.faults.schedule import Schedule

Frame: TypeAlias = "tuple[int, bytes]"


class BadLine:
    """One direction of a line: a frame goes in, those that arrive come out.

    Parameters
    ----------
    schedule : Schedule
        Faults used: frames_dropped, frames_corrupted, frames_duplicated, frames_reordered.
    rng : numpy.random.Generator
        Chooses frames and bits.
    """

    def __init__(self, schedule: Schedule, rng: np.random.Generator) -> None:
        self._schedule = schedule
        self._rng = rng
        self._held: Frame | None = None
        self._copies: list[tuple[int, Frame]] = []

    def carry(self, frame: Frame) -> list[Frame]:
        """Take one frame; return those that arrive now, in order."""
        active = self._schedule.active
        if (fault := active("frames_dropped")) is not None and self._rng.random() < fault.magnitude:
            return []
        if (fault := active("frames_corrupted")) is not None and self._rng.random() < fault.magnitude:
            frame = self._spoiled(frame)
        return self._with_copies(self._swapped(frame))

    def flush(self) -> list[Frame]:
        """Return a frame that waited for a neighbour to change places with, when none comes."""
        held, self._held = self._held, None
        return [] if held is None else [held]

    def _spoiled(self, frame: Frame) -> Frame:
        identifier, data = frame
        if not data:
            return frame
        bit = int(self._rng.integers(8 * len(data)))
        spoiled = bytearray(data)
        spoiled[bit // 8] ^= 1 << bit % 8
        return identifier, bytes(spoiled)

    def _swapped(self, frame: Frame) -> list[Frame]:
        if self._held is not None:
            return [frame, *self.flush()]
        if self._schedule.active("frames_reordered") is None:
            return [frame]
        self._held = frame
        return []

    def _with_copies(self, arriving: list[Frame]) -> list[Frame]:
        """Add the copies whose distance from their originals has passed."""
        twice = self._schedule.active("frames_duplicated")
        out: list[Frame] = []
        for frame in arriving:
            if twice is not None:
                self._copies.append((int(twice.magnitude), frame))
            out += [frame, *(copy for distance, copy in self._copies if distance == 0)]
            self._copies = [(distance - 1, copy) for distance, copy in self._copies if distance > 0]
        return out
