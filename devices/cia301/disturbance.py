"""Whether a bus can be trusted, from what was counted on it: error frames, answers that come twice or too late."""

from __future__ import annotations

from typing import Final

WINDOW: Final = 100
"""Cycles after which counting begins anew."""
MOST_ERRORS: Final = 15
"""Error frames in a window. Sixteen turn a sending CAN controller error passive: 16 x 8 = 128 (ISO 11898-1)."""
MOST_STALE: Final = 3
"""Answers in a window that were not asked for: none on a sound bus, for every SYNC is answered once."""


class Disturbances:
    """Judges running totals once a cycle.

    Examples
    --------
    >>> bus = Disturbances()
    >>> [bus.judge(errors=0, stale=stale) for stale in (0, 1, 3)]
    [None, None, None]
    >>> bus.judge(errors=0, stale=4)
    '4 answers came twice or too late within 4 cycles: the bus repeats or reorders frames, or two nodes have one number'
    """

    def __init__(self) -> None:
        self._cycles = 0
        self._errors: int | None = None
        self._stale = 0

    def judge(self, *, errors: int, stale: int) -> str | None:
        """Take the totals of error frames and of stale answers; return why the bus is not to be trusted, or None."""
        if self._errors is None or self._cycles >= WINDOW:
            # What came before the first look is no affair of the cycle's.
            self._cycles, self._errors, self._stale = 0, errors, stale
        self._cycles += 1
        if (count := errors - self._errors) > MOST_ERRORS:
            return f"{count} error frames within {self._cycles} cycles: look at cable, termination and bit rate"
        if (count := stale - self._stale) > MOST_STALE:
            return (
                f"{count} answers came twice or too late within {self._cycles} cycles: "
                "the bus repeats or reorders frames, or two nodes have one number"
            )
        return None
