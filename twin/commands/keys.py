"""Single keys from a terminal, without waiting for Return: POSIX and Windows."""

from __future__ import annotations

import sys
from collections.abc import Callable, Generator
from contextlib import contextmanager

from devices.clock import WallClock
from recordings.pacing import FASTER, PAUSE, QUIT, SLOWER, STEP

HELP = "keys: space pauses, . or right arrow one sample, + and - speed, q quits"
MEANINGS = {
    " ": PAUSE,
    ".": STEP,
    "\x1b[C": STEP,
    "\x1bOC": STEP,
    "\xe0M": STEP,
    "\x00M": STEP,
    "+": FASTER,
    "=": FASTER,
    "-": SLOWER,
    "q": QUIT,
    "Q": QUIT,
}
"""What a key, or the characters a terminal sends for it, means; = is + without shift."""
_POLL_INTERVAL = 0.01


@contextmanager
def terminal_keys() -> Generator[Callable[[float], str | None]]:
    """Give a function that waits at most so many seconds for a key and returns its meaning, or None.

    Only where stdin is a terminal. The terminal is put back as it was; Ctrl-C stays Ctrl-C.
    """
    if sys.platform == "win32":
        yield _windows_key
        return
    import termios
    import tty

    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield _Posix(descriptor).key
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


class _Posix:
    """Takes a terminal's characters apart into keys."""

    def __init__(self, descriptor: int) -> None:
        self._descriptor = descriptor
        self._waiting = ""
        self._open = True

    def key(self, limit: float) -> str | None:
        import os
        import select

        if not self._waiting:
            watched = [self._descriptor] if self._open else []
            if not select.select(watched, [], [], limit)[0]:
                return None
            data = os.read(self._descriptor, 64)
            self._open = bool(data)
            self._waiting = data.decode("ascii", "replace")
        for text, meaning in MEANINGS.items():
            if self._waiting.startswith(text):
                self._waiting = self._waiting[len(text) :]
                return meaning
        # A key without a meaning: an escape sequence is one key.
        self._waiting = "" if self._waiting.startswith("\x1b") else self._waiting[1:]
        return None


def _windows_key(limit: float) -> str | None:
    if sys.platform != "win32":
        return None
    import msvcrt

    clock = WallClock()
    end = clock.now() + limit
    while not msvcrt.kbhit():
        if clock.now() >= end:
            return None
        clock.wait_until(min(clock.now() + _POLL_INTERVAL, end))
    text = msvcrt.getwch()
    if text in "\x00\xe0":
        text += msvcrt.getwch()
    if text == "\x03":
        raise KeyboardInterrupt
    return MEANINGS.get(text)
