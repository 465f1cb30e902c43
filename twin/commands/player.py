"""A replay at the terminal: its pace, the keys that steer it, and the line that shows where it is."""

from __future__ import annotations

import math
import sys
from contextlib import ExitStack
from types import TracebackType
from typing import Self

from devices.clock import Clock, WallClock
from recordings.pacing import Pace, SteadyPace, SteeredPace, Unpaced
from recordings.run import Run
from twin.commands.keys import HELP, terminal_keys

LINE_INTERVAL = 0.05
"""Time between two lines, s."""


class Player:
    """Paces a replay of `recorded` and shows it; a `with` block takes the terminal and gives it back.

    Parameters
    ----------
    recorded : Run
    speed : float or None
        None: as fast as it goes, and nothing to steer.
    quiet : bool
        Show nothing and take no keys.
    clock : Clock, optional
    """

    def __init__(self, recorded: Run, speed: float | None, *, quiet: bool, clock: Clock | None = None) -> None:
        self.pace: Pace = Unpaced()
        self._end = float(recorded.cycles.time[-1]) if len(recorded.cycles) else 0.0
        self._speed = speed
        self._quiet = quiet
        self._clock = clock or WallClock()
        self._shown = -math.inf
        self._steered: SteeredPace | None = None
        self._stack = ExitStack()

    def __enter__(self) -> Self:
        if self._speed is None:
            return self
        if not self._quiet and sys.stdin.isatty() and sys.stderr.isatty():
            keys = self._stack.enter_context(terminal_keys())
            print(HELP, file=sys.stderr, flush=True)
            self._steered = self.pace = SteeredPace(self._clock, self._speed, keys)
        else:
            self.pace = SteadyPace(self._clock, self._speed)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
        self.clear()

    def clear(self) -> None:
        """Take the line away, before something else is printed."""
        if self._shown > -math.inf:
            self._shown = -math.inf
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()

    def show(self, time: float, predicted: float, measured: float) -> None:
        """Show a cycle: time s, rotations rad; not more often than `LINE_INTERVAL`, but every step of a pause."""
        if self._quiet or self._speed is None or not sys.stderr.isatty():
            return
        paused = self._steered is not None and self._steered.paused
        now = self._clock.now()
        if not paused and now - self._shown < LINE_INTERVAL:
            return
        self._shown = now
        speed = self._speed if self._steered is None else self._steered.speed
        how = "paused" if paused else f"x {speed:g}"
        seen = "no sensor" if math.isnan(measured) else f"{measured:+9.5f} rad"
        line = f"{time:8.3f} / {self._end:.3f} s  {how:>7}   predicted {predicted:+9.5f} rad   measured {seen}"
        sys.stderr.write(f"\r\x1b[K{line}")
        sys.stderr.flush()
