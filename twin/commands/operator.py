"""The operator's say in a run: Ctrl-C, a polite kill, a closed terminal are a controlled stop; twice cuts the power."""

from __future__ import annotations

import signal
from collections.abc import Generator
from contextlib import contextmanager

from twin.live_loop import Ends

STOP_SIGNALS = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK")
"""Ctrl-C, a polite kill, a closed terminal (POSIX, Windows), while the table is ours."""


class Operator:
    """What the operator has asked for so far."""

    def __init__(self) -> None:
        self._asked: list[str] = []

    def ask(self, number: int, _: object = None) -> None:
        """Take a signal."""
        self._asked.append(signal.Signals(number).name)

    def stopped(self) -> Ends | None:
        """Return the stop that was asked for, if one was."""
        return Ends("operator", f"stop was asked ({self._asked[0]})") if self._asked else None

    def cut(self) -> bool:
        """Return whether the power is to be cut: a second signal came."""
        return len(self._asked) > 1

    def words(self) -> str | None:
        """Return the stop that was asked for as one sentence."""
        ends = self.stopped()
        return None if ends is None else f"{ends.name}: {ends.reason}"


@contextmanager
def interruptible() -> Generator[Operator]:
    """Turn the signals that end a program into the operator's say: the cycle asks, and is never broken off."""
    operator = Operator()
    numbers = [getattr(signal, name) for name in STOP_SIGNALS if hasattr(signal, name)]
    before = {number: signal.signal(number, operator.ask) for number in numbers}
    try:
        yield operator
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
