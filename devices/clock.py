"""The only module of the project that reads a monotonic clock or sleeps."""

from __future__ import annotations

import time
from typing import Protocol

# Sleep ends late by the scheduler's granularity; the last stretch is spun instead (design.md 7).
SPIN = 300e-6
# Under real-time scheduling sleep ends on time, and a thread that only spins uses up what Linux grants such threads:
# 95 % of a second, after which it takes the processor away for the other 50 ms ("RT throttling activated").
SPIN_IN_REAL_TIME = 60e-6


class Clock(Protocol):
    """Monotonic time in seconds, from an arbitrary zero."""

    def now(self) -> float:
        """Return the time, s."""
        ...

    def wait_until(self, moment: float) -> float:
        """Return at `moment`, s, or at once where it has passed; the lateness, s, is returned and never negative."""
        ...


class WallClock:
    """The computer's clock: sleeps until `spin` s before the moment, then spins."""

    def __init__(self, spin: float = SPIN) -> None:
        self.spin = spin

    def now(self) -> float:
        """Return `time.perf_counter()`, s."""
        return time.perf_counter()

    def wait_until(self, moment: float) -> float:
        """Wait for `moment`, s; return how late it became, s."""
        ahead = moment - time.perf_counter() - self.spin
        if ahead > 0.0:
            time.sleep(ahead)
        while (now := time.perf_counter()) < moment:
            pass
        return now - moment


class ManualClock:
    """A clock that stands still until it is moved, and never waits.

    Parameters
    ----------
    start : float
        First reading, s.

    Examples
    --------
    >>> clock = ManualClock()
    >>> clock.wait_until(0.25)
    0.0
    >>> clock.advance(0.5)  # the host stalls for half a second
    >>> clock.wait_until(0.5), clock.now()
    (0.25, 0.75)
    """

    def __init__(self, start: float = 0.0) -> None:
        self._now = start

    def now(self) -> float:
        """Return the time, s."""
        return self._now

    def advance(self, duration: float) -> None:
        """Let `duration`, s, pass: a stall of the host. Negative durations are a ValueError: time is monotonic."""
        if not duration >= 0.0:
            raise ValueError(f"a clock cannot be advanced by {duration} s")
        self._now += duration

    def wait_until(self, moment: float) -> float:
        """Jump to `moment`, s, unless it has passed; return the lateness, s."""
        lateness = max(0.0, self._now - moment)
        self._now = max(self._now, moment)
        return lateness
