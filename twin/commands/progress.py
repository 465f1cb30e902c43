"""A live line on the terminal, drawn by a thread of its own so that the cycle never waits for a terminal."""

from __future__ import annotations

import math
import sys
import threading
from collections.abc import Generator
from contextlib import contextmanager
from types import TracebackType
from typing import Self

from devices.scheduling import PRIORITY, real_time

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
    """Time, prediction and measurement while a run lasts; says nothing where stderr is no terminal or `quiet` is set.

    `show` only stores three numbers: call it from the cycle.
    """

    def __init__(self, end: float, *, quiet: bool = False) -> None:
        self._end = end
        self._latest: tuple[float, float, float] | None = None
        self._over = threading.Event()
        self._thread: threading.Thread | None = None
        if not quiet and sys.stderr.isatty():
            self._thread = threading.Thread(target=self._draw, name="progress", daemon=True)

    def show(self, time: float, predicted: float, measured: float) -> None:
        """Take the newest cycle: time s, rotations rad."""
        self._latest = (time, predicted, measured)

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
            time, predicted, measured = self._latest
            done = min(1.0, time / self._end) if self._end > 0.0 else 1.0
            bar = "#" * round(20 * done)
            seen = "  no sensor" if math.isnan(measured) else f"{measured:+9.4f}"
            now = f"[{bar:<20}] {time:6.2f} / {self._end:.2f} s"
            sys.stderr.write(f"\r\x1b[K{now}   predicted {predicted:+8.4f} rad   measured {seen} rad")
            sys.stderr.flush()
