"""A file that takes each write whole or not at all, and can be told to reach the disk."""

from __future__ import annotations

import io
import os
from contextlib import suppress
from pathlib import Path


class DiskFile(io.FileIO):
    """An unbuffered file to write.

    Parameters
    ----------
    path : Path
    mode : {"xb", "wb"}
        As of `open`.

    Attributes
    ----------
    end : int
        Bytes that are in it.
    """

    def __init__(self, path: Path, mode: str) -> None:
        super().__init__(path, mode)
        self.end = 0
        self._folder: Path | None = Path(path).absolute().parent

    def append(self, data: bytes) -> None:
        """Write `data` whole; where that fails, the file is as it was before.

        Raises
        ------
        OSError
            As `write` does, for example on a full disk.
        """
        left = memoryview(data)
        try:
            while left:
                left = left[self.write(left) or 0 :]
        except OSError:
            # A part of a record in the middle of a file would hide everything that follows it.
            with suppress(OSError):
                self.seek(self.end)
                self.truncate()
            raise
        self.end += len(data)

    def sync(self) -> None:
        """Wait until the disk has everything, the first time the file's name too."""
        os.fsync(self.fileno())
        if self._folder is not None:
            # A new file is found after a power cut only where its folder was written; Windows does that by itself.
            with suppress(OSError):
                folder = os.open(self._folder, os.O_RDONLY)
                try:
                    os.fsync(folder)
                finally:
                    os.close(folder)
            self._folder = None
