"""Ask the operating system for what a cycle needs, where it grants it: real-time scheduling, locked memory."""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Generator
from contextlib import contextmanager

PRIORITY = 50
"""Of 1 to 99: above every ordinary thread, below the kernel's own interrupt threads at 50 and more on RT kernels."""

_MCL_CURRENT, _MCL_FUTURE = 1, 2
"""Of Linux' mlockall(2), the same on every processor we know."""


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


@contextmanager
def undisturbed() -> Generator[str]:
    """Ask for both, for the calling thread, while the block lasts; yield what was granted.

    Examples
    --------
    >>> with undisturbed() as granted:
    ...     "; memory" in granted
    True
    """
    with locked_memory() as memory, real_time() as scheduling:
        yield f"{scheduling}; {memory}"


@contextmanager
def locked_memory() -> Generator[str]:
    """Keep this process's pages in memory while the block lasts; yield what was granted. No cycle waits for a disk so.

    A refusal is no error: it is a text for the report. Only Linux is asked.

    Examples
    --------
    >>> with locked_memory() as memory:
    ...     memory.startswith(("memory locked", "memory not locked"))
    True
    """
    if not sys.platform.startswith("linux"):
        yield "memory not locked (this system was not asked)"
        return
    library = ctypes.CDLL(None, use_errno=True)
    if library.mlockall(_MCL_CURRENT | _MCL_FUTURE) != 0:
        yield f"memory not locked (refused: {os.strerror(ctypes.get_errno())})"
        return
    try:
        yield "memory locked"
    finally:
        library.munlockall()
