"""CAN traffic of a recording as a log file for other CAN tools."""

from __future__ import annotations

from typing import TYPE_CHECKING

from devices.can_log import LoggedFrame, write_can_log
from devices.errors import LogFileError
from recordings.can_traffic import frames
from recordings.errors import RecordingError
from recordings.schema import CAN_FRAME

if TYPE_CHECKING:
    from pathlib import Path

    from recordings.run import Run


def export_can(run: Run, path: Path) -> int:
    """Write the CAN frames of `run` as .blf, .asc or .log and return how many they are.

    Raises
    ------
    RecordingError
        The recording has no CAN traffic, or the file cannot be written.
    """
    if CAN_FRAME.name not in run.series:
        raise RecordingError(f"{run.path} has no CAN traffic: it is recorded where the run was asked to")
    try:
        return write_can_log(
            path, (LoggedFrame(f.host_time_ns * 1e-9, f.identifier, f.data, f.sent) for f in frames(run))
        )
    except LogFileError as error:
        raise RecordingError(str(error)) from None
