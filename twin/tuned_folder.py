"""Where corrected commands are kept: one file each, `tuned/DEVICE/MACHINE-KEY.json`, beside the runs."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from pydantic import ValidationError

from twin.errors import InputError, sentence
from twin.text_file import read_text
from twin.tuned import Purpose, TunedCommand

FOLDER = Path("tuned")


@dataclass(frozen=True, slots=True)
class Found:
    """What the folder has for a purpose: the command and its file, or why those that are there are not used."""

    command: TunedCommand | None
    path: Path
    passed_over: tuple[str, ...] = ()


def path_of(folder: Path, purpose: Purpose) -> Path:
    """Return where the command for `purpose` is kept."""
    return folder / purpose.device / f"{purpose.machine}-{purpose.key}.json"


def keep(folder: Path, command: TunedCommand) -> Path:
    """Write `command` to its place, instead of an older one; a reader sees one or the other, whole.

    Raises
    ------
    InputError
        Where the file cannot be written.
    """
    path = path_of(folder, command.purpose)
    waiting = path.with_suffix(f".{os.getpid()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        waiting.write_text(command.model_dump_json(), encoding="utf-8")
        waiting.replace(path)
    except OSError as error:
        raise InputError(
            f"the tuned command cannot be kept in {path}: {(error.strerror or str(error)).lower()}"
        ) from None
    return path


def read(path: Path) -> TunedCommand:
    """Return the command in a file; raises `InputError` in one sentence where it holds none."""
    try:
        command = TunedCommand.model_validate_json(read_text(path))
    except ValidationError as error:
        raise InputError(sentence(error, f"tuned command {path}", lambda _: TunedCommand.model_fields)) from None
    sizes = {len(command.correction), len(command.achieved), len(command.achieved_before)}
    if len(sizes) > 1:
        raise InputError(f"tuned command {path}: correction and achieved acceleration differ in length")
    return command


def find(folder: Path, purpose: Purpose) -> Found:
    """Look for the command made for exactly `purpose`; others of the machine are named, never used.

    Raises
    ------
    InputError
        Where there is a file for it that cannot be read: it is removed, or made again, by whoever put it there.
    """
    path = path_of(folder, purpose)
    if path.exists():
        command = read(path)
        if command.purpose == purpose:
            return Found(command, path)
        raise InputError(f"tuned command {path} was made for another {', '.join(purpose.differences(command.purpose))}")
    return Found(None, path, tuple(_others(path.parent, purpose)))


def _others(folder: Path, purpose: Purpose) -> list[str]:
    """Return one clause for each other command of the same pulse, and for what is none: a user wonders about these."""
    clauses: list[str] = []
    for path in sorted(folder.glob("*.json")):
        try:
            other = read(path).purpose
        except InputError:
            clauses.append(f"{path.name} cannot be read")
            continue
        if other.pulse == purpose.pulse:
            clauses.append(f"{path.name} is for another {', '.join(purpose.differences(other))}")
    return clauses
