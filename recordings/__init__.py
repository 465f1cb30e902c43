"""The edge of the product: what a run leaves behind, and how it is read and seen again.

Errors are `RecordingError`, a ValueError. Names are imported when they are first used: a process that only
hands cycles on never loads the reader or `rerun`.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from recordings.errors import RecordingError
    from recordings.geometry import Geometry
    from recordings.live_view import LiveView
    from recordings.reader import cycle_blocks, read_run
    from recordings.recorder import Recorder, RecorderReport
    from recordings.recovery import Recovery, recover
    from recordings.run import Cycles, Run, Series
    from recordings.writer import RunWriter

__all__ = [
    "Cycles",
    "Geometry",
    "LiveView",
    "Recorder",
    "RecorderReport",
    "RecordingError",
    "Recovery",
    "Run",
    "RunWriter",
    "Series",
    "cycle_blocks",
    "read_run",
    "recover",
]

_MODULES = {
    "Cycles": "run",
    "Geometry": "geometry",
    "LiveView": "live_view",
    "Recorder": "recorder",
    "RecorderReport": "recorder",
    "RecordingError": "errors",
    "Recovery": "recovery",
    "Run": "run",
    "RunWriter": "writer",
    "Series": "run",
    "cycle_blocks": "reader",
    "read_run": "reader",
    "recover": "recovery",
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module 'recordings' has no attribute '{name}'")
    return getattr(import_module(f"recordings.{_MODULES[name]}"), name)
