"""Real-time scheduling: granted or refused, it is said, and it ends with the block."""

from __future__ import annotations

import ctypes
import os
import re
import sys
import threading
from pathlib import Path

import pytest

from devices.scheduling import locked_memory, real_time

posix = pytest.mark.skipif(not hasattr(os, "sched_setscheduler"), reason="this system has no POSIX scheduling")


@posix
def test_it_is_given_back() -> None:
    before = os.sched_getscheduler(0)
    with real_time() as said:
        granted = os.sched_getscheduler(0) == os.SCHED_FIFO
        assert said.startswith("SCHED_FIFO" if granted else "ordinary")
    assert os.sched_getscheduler(0) == before


@posix
def test_other_threads_keep_theirs() -> None:
    release, seen = threading.Event(), []
    other = threading.Thread(target=lambda: (release.wait(), seen.append(os.sched_getscheduler(0))))
    other.start()
    with real_time():
        release.set()
        other.join()
    assert seen == [os.SCHED_OTHER]


@posix
def test_a_refusal_is_a_text(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: object) -> None:
        raise PermissionError(1, "Operation not permitted")

    monkeypatch.setattr(os, "sched_setscheduler", refuse)
    with real_time() as said:
        assert said == "ordinary (SCHED_FIFO refused: Operation not permitted)"


def test_a_system_without_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(os, "sched_setscheduler", raising=False)
    with real_time() as said:
        assert said == "ordinary (this system has no SCHED_FIFO)"


def test_locked_memory_is_given_back() -> None:
    status = Path("/proc/self/status")
    if not status.exists():
        pytest.skip("only Linux tells how much of a process is locked")

    def locked() -> int:
        return int(re.findall(r"VmLck:\s+(\d+)", status.read_text())[0])

    before = locked()
    with locked_memory() as said:
        assert (locked() > before) == (said == "memory locked")
    assert locked() == before


def test_refused_memory_is_a_text(monkeypatch: pytest.MonkeyPatch) -> None:
    class Refusing:
        @staticmethod
        def mlockall(_: int) -> int:
            ctypes.set_errno(12)
            return -1

    monkeypatch.setattr(ctypes, "CDLL", lambda *_, **__: Refusing)
    monkeypatch.setattr(sys, "platform", "linux")
    with locked_memory() as said:
        assert said == "memory not locked (refused: Cannot allocate memory)"
    monkeypatch.setattr(sys, "platform", "win32")
    with locked_memory() as said:
        assert said == "memory not locked (this system was not asked)"
