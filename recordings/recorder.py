"""Record a run from a control loop: an MCAP file written by a process of its own."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Self

from recordings.consumer import pack_frame
from recordings.disk_file import DiskFile
from recordings.schema import RECORDER_METADATA
from recordings.spool import Spool
from recordings.writer import RunWriter

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping
    from types import TracebackType

    from recordings.geometry import Geometry
    from twin.cycle import CanFrame


@dataclass(frozen=True, slots=True)
class RecorderReport:
    """What became of the values (cycles, gaps, events and CAN frames) handed to a recorder.

    Attributes
    ----------
    path : Path
        The file.
    written : int
        Values that are in the file, after fsync.
    dropped : int
        Values dropped because the queue was full.
    lost : int
        Values taken, but not known to be in the file: its process died or was ended.
    refused : int
        Values that could not be packed.
    failure : str or None
        Why the file was not closed properly, one sentence; None where it was.
    """

    path: Path
    written: int
    dropped: int
    lost: int
    refused: int
    failure: str | None

    @property
    def complete(self) -> bool:
        """Whether the file is closed properly and holds every value."""
        return self.failure is None and not (self.dropped or self.lost or self.refused)


class Recorder(Spool):
    """A `twin.cycle.Sink` and `FrameSink` that records to `path` without ever blocking or raising into the loop.

    Parameters
    ----------
    path : Path
        File to make; it must not exist.
    metadata : mapping of name to mapping of str to str
        What explains the run, written before the first cycle.
    geometry : Geometry or None
        Size of the block, for the poses.
    bound : int
        Cycles the queue holds before it drops and counts (see `recordings.spool`); 20 000 are 20 s at 1 kHz, 3 MB.
    overwrite : bool
        Replace a file of that name.
    disk : callable
        Opens the file, in the other process; tests give one that fails.

    Raises
    ------
    RecordingError
        The file cannot be made; raised here, before the loop starts.

    Notes
    -----
    Starting takes some tenths of a second: make it before the loop starts. It starts a process by spawn, so a script
    needs the usual ``if __name__ == "__main__":``.
    """

    def __init__(
        self,
        path: Path,
        metadata: Mapping[str, Mapping[str, str]],
        geometry: Geometry | None = None,
        *,
        bound: int = 20_000,
        overwrite: bool = False,
        disk: Callable[[Path, str], DiskFile] = DiskFile,
    ) -> None:
        self.path = Path(path)
        self._report: RecorderReport | None = None
        plain = {name: dict(values) for name, values in metadata.items()}
        build = partial(RunWriter, self.path, plain, geometry, overwrite=overwrite, disk=disk)
        super().__init__(build, name="recorder", bound=bound)

    def frame(self, frame: CanFrame) -> None:
        """Take a CAN frame; never blocks, never raises. It has half the queue: cycles come before it."""
        self._take(pack_frame, frame, self._bound // 2)

    def finish(self, metadata: Mapping[str, Mapping[str, str]] | None = None, *, limit: float = 10.0) -> RecorderReport:
        """Write what is queued and the closing `metadata`, close the file and say what became of every value.

        Takes `limit` seconds at most (plus 1 s to end a process that hangs); a second call gives the same report. The
        file also gets metadata `recorder`: how many values were taken, dropped and refused.
        """
        if self._report is None:
            counts = {"received": self.received, "dropped": self.dropped, "refused": self.refused}
            own = {RECORDER_METADATA: {name: str(count) for name, count in counts.items()}}
            self.close({**(metadata or {}), **own}, limit=limit)
            self._report = RecorderReport(
                self.path, self.safe, self.dropped, self.received - self.safe, self.refused, self.failure
            )
        return self._report

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.finish()
