"""A trip that outlives its run: the next run on that table asks for `--reset`, and records who gave it."""

from __future__ import annotations

import getpass
from datetime import UTC, datetime
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from twin.errors import InputError, sentence
from twin.text_file import read_text

LATCHES = Path("runs") / "tripped"
"""Folder of the latches, one file a table, below the working folder as the recordings are."""


class Latch(BaseModel):
    """What stopped a table: `reason` is the run's own sentence, `time` when, ISO 8601 in UTC."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    device: str = Field(min_length=1, max_length=100)
    time: str = Field(max_length=40)
    reason: str = Field(max_length=2000)
    recording: str = Field(max_length=1000)

    @property
    def words(self) -> str:
        """Return what happened, in one clause."""
        return f"{self.device} was stopped by a trip at {self.time} ({self.reason}; {self.recording})"


def operator_name() -> str:
    """Return the name of who sits at the computer, or "unknown"."""
    try:
        return getpass.getuser()
    except (OSError, KeyError, ImportError):
        return "unknown"


def latch(device: str, reason: str, recording: Path, folder: Path = LATCHES) -> None:
    """Leave behind that a run of `device` tripped; a folder that cannot be written is an `InputError`."""
    left = Latch(device=device, time=_now(), reason=reason[:2000], recording=str(recording)[-1000:])
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _path(device, folder).write_text(left.model_dump_json(indent=2) + "\n", encoding="utf-8")
    except OSError as error:
        raise InputError(f"the trip of {device} cannot be kept in {folder}: {error.strerror}") from None


def latched(device: str, folder: Path = LATCHES) -> Latch | None:
    """Return what the last run of `device` left behind; None where nothing is latched. Raises `InputError`."""
    path = _path(device, folder)
    if not path.exists():
        return None
    try:
        return Latch.model_validate_json(read_text(path))
    except ValidationError as error:
        raise InputError(sentence(error, f"{path}", lambda _: list(Latch.model_fields))) from None


def refuse_latched(device: str, folder: Path = LATCHES) -> None:
    """Raise `InputError` where a trip of `device` was not acknowledged."""
    left = latched(device, folder)
    if left is not None:
        raise InputError(f"{left.words}; once its cause is gone acknowledge it with --reset")


def reset(device: str, who: str, folder: Path = LATCHES) -> str | None:
    """Acknowledge a trip; return a sentence that says who did so, when, and what it was. None where nothing was."""
    left = latched(device, folder)
    if left is None:
        return None
    _path(device, folder).unlink(missing_ok=True)
    return f"{who} acknowledged at {_now()}: {left.words}"


def _path(device: str, folder: Path) -> Path:
    return folder / f"{device}.json"


def _now() -> str:
    return datetime.now(UTC).isoformat(timespec="seconds")
