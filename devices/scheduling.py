"""Ask the operating system for real-time scheduling of the calling thread, where it has it and grants it."""

from __future__ import annotations

import os
from collections.abc import Generator
from contextlib import contextmanager

PRIORITY = 50
"""Of 1 to 99: above every ordinary thread, below the kernel's own interrupt threads at 50 and more on RT kernels."""


@contextmanager
def real_time(priority: int = PRIORITY) -> Generator[str]:
    """Run the calling thread, and no other, under SCHED_FIFO while the block lasts; yield what was granted.

    A refusal is no error: it is a text for the report, and the cycle runs under ordinary scheduling. Systems without
    POSIX scheduling (Windows, macOS) say so.

    Examples
    --------
    >>> with real_time() as scheduling:
    ...     scheduling.startswith(("SCHED_FIFO", "ordinary"))
    True
    """
    if not hasattr(os, "sched_setscheduler"):
        yield "ordinary (this system has no SCHED_FIFO)"
        return
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    except OSError as error:
        yield f"ordinary (SCHED_FIFO refused: {error.strerror})"
        return
    try:
        yield f"SCHED_FIFO priority {priority}"
    finally:
        os.sched_setscheduler(0, *before)
