"""Where a page comes from: the command that made it, when, from which scene, with which code."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from pathlib import Path

from twin.provenance import versions
from twin.scene import shipped_scenes

SHOWN = ("shake-table-twin", "git", "source", "python", "numpy", "numba", "scipy")
"""Of the versions, those that decide what a plan says."""


@dataclass(frozen=True, slots=True)
class Origin:
    """What reproduces a page.

    Attributes
    ----------
    command : str
        The command line; empty where there was none.
    made : datetime or None
        When, UTC.
    files : mapping
        What was read, by name -> SHA-256 of its bytes.
    versions : mapping
        Name -> version.
    """

    command: str
    made: datetime | None
    files: dict[str, str]
    versions: dict[str, str]

    @property
    def made_words(self) -> str:
        """Date and time with the zone; empty where it is not known."""
        return "" if self.made is None else f"{self.made.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC"


def origin_of(
    arguments: Sequence[str], *, scene_argument: str, record: Path | None = None, made: datetime | None = None
) -> Origin:
    """Return the origin of what `twin` makes of `arguments` at `made`.

    Parameters
    ----------
    arguments : sequence of str
        Behind the name of the program.
    scene_argument : str
        A shipped scene's name, or the path of a file.
    record : Path, optional
        Of the record that shakes it.
    made : datetime, optional
        With its zone; this page then says when it was made.
    """
    files: dict[str, str] = {}
    shipped = shipped_scenes()
    path = Path(scene_argument)
    if scene_argument in shipped and path.suffix != ".toml" and len(path.parts) <= 1:
        files[f"{scene_argument} (shipped)"] = sha256(shipped[scene_argument].encode()).hexdigest()
    else:
        files[path.name] = _digest(path)
    if record is not None:
        files[record.name] = _digest(record)
    return Origin(shlex.join(["twin", *arguments]), made, files, _versions())


def unknown_origin() -> Origin:
    """Return the origin of a page that was not made by a command: versions alone."""
    return Origin("", None, {}, _versions())


def _versions() -> dict[str, str]:
    known = versions()
    return {name: known[name] for name in SHOWN}


def _digest(path: Path) -> str:
    try:
        return sha256(path.read_bytes()).hexdigest()
    except OSError:
        return "unreadable"
