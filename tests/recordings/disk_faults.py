"""Disks that fail: full at a byte, or without power at an instant."""

from __future__ import annotations

import errno
import os
from pathlib import Path

from recordings.disk_file import DiskFile


class FullDisk(DiskFile):
    """A disk with room for `room` bytes of this file; it takes what fits, then says so."""

    def __init__(self, path: Path, mode: str, room: int) -> None:
        super().__init__(path, mode)
        self.room = room

    def write(self, data: memoryview) -> int:
        """Write as much as fits, as a disk does."""
        fits = self.room - self.tell()
        if fits <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return super().write(data[:fits]) or 0


class PowerCut(DiskFile):
    """A disk that keeps, when the power goes, only what was waited for."""

    def __init__(self, path: Path, mode: str) -> None:
        super().__init__(path, mode)
        self.kept = 0

    def sync(self) -> None:
        """Wait for the disk."""
        super().sync()
        self.kept = os.fstat(self.fileno()).st_size

    def after_a_power_cut(self) -> bytes:
        """What is found when the power is back."""
        return Path(os.fsdecode(self.name)).read_bytes()[: self.kept]
