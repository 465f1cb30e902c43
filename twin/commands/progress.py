"""A live line on the terminal, drawn by a thread of its own so that the cycle never waits for a terminal."""

from __future__ import annotations

import math
import shutil
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from devices.scheduling import PRIORITY, real_time
from twin.live_loop import Status

INTERVAL = 0.1
"""Time between two lines, s."""


PATIENCE = 1.0
"""Time after which a user is told what is being waited for, s."""


@contextmanager
def compiling(*, quiet: bool = False) -> Generator[None]:
    """Say on a terminal, where it takes longer than `PATIENCE`, that the first use compiles the solver."""
    if quiet or not sys.stderr.isatty():
        yield
        return
    told = threading.Timer(PATIENCE, sys.stderr.write, ("compiling the solver; this is done once ...",))
    told.daemon = True
    told.start()
    try:
        yield
    finally:
        told.cancel()
        sys.stderr.write("\r\x1b[K")
        sys.stderr.flush()


class Progress:
    """A line with what matters while a run lasts; says nothing where stderr is no terminal or `quiet` is set.

    `show` only keeps what it is given: call it from the cycle.
    """

    def __init__(self, end: float, *, quiet: bool = False) -> None:
        self._end = end
        self._latest: Status | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if not quiet and sys.stderr.isatty():
            self._thread = threading.Thread(target=self._draw, name="progress", daemon=True)

    def show(self, status: Status) -> None:
        """Take the newest cycle."""
        self._latest = status

    def __enter__(self) -> Self:
        if self._thread is not None:
            self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        if self._thread is not None:
            self._thread.join()
            sys.stderr.write("\r\x1b[K")
            sys.stderr.flush()

    def _draw(self) -> None:
        # It shares the interpreter's lock with the cycle: see `recordings.spool`.
        with real_time(PRIORITY - 2):
            self._draw_lines()

    def _draw_lines(self) -> None:
        while not self._over.wait(INTERVAL):
            if self._latest is None:
                continue
            line = status_line(self._latest, self._end)
            width = shutil.get_terminal_size().columns - 1
            sys.stderr.write(f"\r\x1b[K{line[:width]}")
            sys.stderr.flush()


def status_line(status: Status, end: float) -> str:
    """Return time, phase, rotations predicted and measured, rad, outlook, cycles missed, and the first trip.

    The margin is the forecast's: 1 is at rest, 0 on the barrier, negative overturns.
    """
    done = min(1.0, status.time / end) if end > 0.0 else 1.0
    seen = "no sensor" if math.isnan(status.measured) else f"{status.measured:+.4f}"
    line = f"[{'#' * round(10 * done):<10}] {status.time:6.2f}/{end:.1f} s {status.phase:<8}"
    line += f" {status.predicted:+.4f} predicted {seen} measured"
    if status.forecast is not None:
        on = status.forecast.going_on
        line += f" | {on.outcome.value} margin {on.margin:+.2f} falls {on.probability:.0%}: {status.forecast.advice}"
    line += f" | {status.missed} missed"
    return line if status.trip is None else f"{line} | TRIP {status.trip}"
