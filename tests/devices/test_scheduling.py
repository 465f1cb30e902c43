"""Real-time scheduling: granted or refused, it is said, and it ends with the block."""

from __future__ import annotations

import os
import threading

import pytest

from devices.scheduling import real_time

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
