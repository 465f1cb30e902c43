"""CAN frames as the log files other CAN tools read: BLF, ASC, candump."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import can

from devices.errors import LogFileError

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

_WRITERS: dict[str, type[can.BLFWriter | can.ASCWriter | can.CanutilsLogWriter]] = {
    ".blf": can.BLFWriter,
    ".asc": can.ASCWriter,
    ".log": can.CanutilsLogWriter,
}
KINDS = tuple(_WRITERS)
"""Endings of the files that can be written."""


class LoggedFrame(NamedTuple):
    """A data frame that passed the bus: time in s since 1970 (UTC), 11-bit identifier, at most 8 bytes."""

    time: float
    identifier: int
    data: bytes
    sent: bool


def write_can_log(path: Path, frames: Iterable[LoggedFrame]) -> int:
    """Write frames to a new file, in the order of their times, and return how many they were.

    Parameters
    ----------
    path : Path
        Its ending says the format: one of `KINDS`.
    frames : iterable of LoggedFrame

    Raises
    ------
    LogFileError
        Another ending, a file that exists or cannot be written, or a frame that is none.
    """
    writer = _WRITERS.get(path.suffix.lower())
    if writer is None:
        raise LogFileError(f"{path} is no CAN log; its name must end in {', '.join(KINDS)}")
    if path.exists():
        raise LogFileError(f"{path} exists already and is not overwritten")
    count = 0
    try:
        with writer(str(path)) as log:
            for frame in sorted(frames, key=lambda frame: frame.time):
                log.on_message_received(_message(frame))
                count += 1
    except (OSError, ValueError) as error:
        path.unlink(missing_ok=True)
        raise LogFileError(f"{path} cannot be written: {error}") from None
    return count


def _message(frame: LoggedFrame) -> can.Message:
    return can.Message(
        timestamp=frame.time,
        arbitration_id=frame.identifier,
        data=frame.data,
        is_extended_id=False,
        is_rx=not frame.sent,
        channel=0,
        check=True,
    )
