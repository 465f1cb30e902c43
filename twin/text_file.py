"""Reading a file of a user's: a text of sensible size, or one sentence."""

from __future__ import annotations

from pathlib import Path

from twin.errors import InputError

LARGEST_FILE = 64 * 1024 * 1024
"""Bytes of a file above which it is refused unread."""


def read_text(path: Path) -> str:
    """Return a text file's content; raises `InputError` where it cannot be read, is too large, or is no text."""
    try:
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path} is larger than {LARGEST_FILE // 2**20} MiB")
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not a text file in UTF-8") from None
    except (OSError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise InputError(f"cannot read {path}: {reason.lower()}") from None
