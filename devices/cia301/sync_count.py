"""How many cycles passed between two SYNCs, told by their counter; and which SYNC is none of the sequence."""

from __future__ import annotations

from devices.cia301.frames import SYNC_COUNTS

_ADOPTED = 3
"""A stray SYNC begins a new sequence where so many come in a row: the host was replaced, or its counter leapt."""


class SyncCount:
    """The sequence a device goes by.

    Attributes
    ----------
    astray : bool
        Whether the last SYNC was none of the sequence: an old one that came late, or another master's.

    Examples
    --------
    >>> count = SyncCount()
    >>> [count.take(counter, most=21) for counter in (5, 6, 6, 9, 8, 10)], count.astray
    ([None, 1, 0, 3, 0, 1], False)
    """

    def __init__(self) -> None:
        self.astray = False
        self._last: int | None = None
        self._strays = 0

    def forget(self) -> None:
        """Let the next SYNC begin a new sequence: time was told by another clock meanwhile."""
        self._last = None

    def take(self, counter: int, most: int) -> int | None:
        """Return the cycles passed since the last SYNC, `most` at most; 0 where this one is to be passed over.

        None where it begins a sequence.
        """
        passed = None if self._last is None else (counter - self._last) % SYNC_COUNTS
        self.astray = passed is not None and passed > most
        self._strays = self._strays + 1 if self.astray else 0
        if self.astray and self._strays < _ADOPTED:
            return 0
        self._last = counter
        return 1 if self.astray else passed
