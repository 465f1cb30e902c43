"""Follow a recording while it is being written: only what is new is read, and only when it is whole."""

from __future__ import annotations

import struct
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Self

from mcap.opcode import Opcode
from mcap.writer import MCAP0_MAGIC

from recordings.errors import RecordingError
from recordings.reader import read_run

if TYPE_CHECKING:
    from types import TracebackType

    from recordings.run import Run

MOST_AT_ONCE = 16 * 1024 * 1024
"""Bytes read in one go: a long recording is caught up with in several."""

_HEADER = struct.Struct("<BQ")


class Follower:
    """Reads the growing end of a recording, as `Run`s of what is new; a `with` block opens and closes it.

    A recording begins with its definitions and goes on in chunks that each hold whole cycles (`recordings.writer`).
    What is new is read as a recording of its own: the beginning, and the chunks since the last look.

    Attributes
    ----------
    ended : bool
        Whether the recording was closed.

    Raises
    ------
    RecordingError
        The file cannot be read, or is no recording; from `news` too, where what is new is damaged.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.ended = False
        self._offset = len(MCAP0_MAGIC)
        self._begin: bytes | None = None
        self._file: BinaryIO | None = None
        self._folder: tempfile.TemporaryDirectory[str] | None = None

    def __enter__(self) -> Self:
        try:
            self._file = self.path.open("rb")
        except OSError as error:
            raise RecordingError(f"{self.path} cannot be read: {error.strerror}") from None
        if self._file.read(len(MCAP0_MAGIC)) != MCAP0_MAGIC:
            self._file.close()
            raise RecordingError(f"{self.path} is not an MCAP file")
        self._folder = tempfile.TemporaryDirectory(prefix="twin-follow-")
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            self._file.close()
        if self._folder is not None:
            self._folder.cleanup()

    def news(self) -> Run | None:
        """Return what was written since the last call, up to `MOST_AT_ONCE`; None where nothing whole was."""
        if self._file is None or self._folder is None:
            raise RecordingError(f"{self.path} is followed before it is open")
        size = self.path.stat().st_size
        new: list[bytes] = []
        taken = 0
        while taken < MOST_AT_ONCE:
            record = self._record(self._file, size)
            if record is None:
                break
            new.append(record)
            taken += len(record)
            if record[0] == Opcode.CHUNK and self._begin is None:
                self._begin = b"".join(new[:-1])
                new = new[-1:]
            if record[0] in (Opcode.DATA_END, Opcode.FOOTER):
                self.ended = True
                break
        if self._begin is None or not new:
            # Before the first chunk nothing was measured; what was read is read again.
            self._offset = len(MCAP0_MAGIC) if self._begin is None else self._offset
            return None
        piece = Path(self._folder.name) / self.path.name
        piece.write_bytes(MCAP0_MAGIC + self._begin + b"".join(new))
        return read_run(piece)

    def _record(self, file: BinaryIO, size: int) -> bytes | None:
        """Return the next record where it is whole."""
        if self._offset + _HEADER.size > size:
            return None
        file.seek(self._offset)
        head = file.read(_HEADER.size)
        if len(head) < _HEADER.size:
            return None
        opcode, length = _HEADER.unpack(head)
        if opcode == 0:
            raise RecordingError(f"{self.path} is damaged after {self._offset} bytes")
        if self._offset + _HEADER.size + length > size:
            return None
        body = file.read(length)
        if len(body) < length:
            return None
        self._offset += _HEADER.size + length
        return head + body
