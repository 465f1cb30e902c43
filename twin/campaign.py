"""A campaign: runs one after another, each at staged levels, as one TOML file.

A file of a user's or of a stranger's: everything in it is bounded, and nothing in it says where anything is written.
"""

from __future__ import annotations

import hashlib
import os
import re
import tomllib
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, Field, ValidationError, field_validator

from twin.errors import InputError, sentence
from twin.scene import Scene, load_scene, shipped_scenes
from twin.scene_parts import Excitation, Part, RecordPart
from twin.text_file import read_text

LEVELS = (10.0, 25.0, 50.0, 100.0)
"""Staged levels, percent of the whole pulse, unless told."""
MOST_RUNS, MOST_LEVELS = 200, 20

Level = Annotated[float, Field(gt=0, le=100)]
Levels = Annotated[tuple[Level, ...], Field(strict=False, min_length=1, max_length=MOST_LEVELS)]


def _ascending(levels: tuple[float, ...] | None) -> tuple[float, ...] | None:
    if levels is not None and any(later < earlier for earlier, later in pairwise(levels)):
        raise ValueError("staged levels must not go down")
    return levels


class RunPart(Part):
    """`[[run]]`: one scene, its excitation replaced where it says so, at its levels."""

    name: Annotated[str, Field(min_length=1, max_length=60)] = ""
    scene: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    levels_percent: Levels | None = None
    excitation: Excitation | None = None
    why: Annotated[str, Field(max_length=1000)] = ""

    _levels = field_validator("levels_percent")(_ascending)


class CampaignPart(Part):
    """A campaign file: what holds for every run unless the run says otherwise, and the runs."""

    title: Annotated[str, Field(max_length=300)] = ""
    scene: Annotated[str, Field(min_length=1, max_length=1000)] | None = None
    levels_percent: Levels = LEVELS
    run: Annotated[tuple[RunPart, ...], Field(strict=False, min_length=1, max_length=MOST_RUNS)]

    _levels = field_validator("levels_percent")(_ascending)


@dataclass(frozen=True, slots=True)
class Step:
    """One run of the table: a scene at one level.

    Attributes
    ----------
    number : int
        From 1 on, over the whole campaign.
    run : str
        The run's name.
    level : float
        Percent of the whole pulse; the scene's own gain counts as well.
    scene : Scene
        With that gain in it.
    why : str
        Why the run is made.
    """

    number: int
    run: str
    level: float
    scene: Scene
    why: str = ""

    @property
    def title(self) -> str:
        """The step in a few words."""
        return f"{self.run} at {self.level:g} %"

    @property
    def slug(self) -> str:
        """A file's name for it, whatever the run is called, on any system."""
        plain = re.sub(r"[^A-Za-z0-9]+", "-", self.run).strip("-")[:40]
        return "-".join(filter(None, (f"{self.number:03d}", plain, f"{self.level:g}pct".replace(".", "_"))))

    @property
    def digest(self) -> str:
        """A digest of everything that is run."""
        return hashlib.sha256(f"{self.level!r} {self.scene.model_dump_json()}".encode()).hexdigest()[:32]


@dataclass(frozen=True, slots=True)
class Campaign:
    """A campaign and the steps it comes to."""

    name: str
    title: str
    steps: tuple[Step, ...]


def is_campaign(name: str) -> bool:
    """Return whether `name` is a TOML file with runs, and so no scene; what is wrong with it is for others to say."""
    path = Path(name)
    if path.suffix != ".toml" and len(path.parts) < 2:
        return False
    try:
        tables = tomllib.loads(read_text(path))
    except (ValueError, RecursionError):
        return False
    return "run" in tables and "block" not in tables


def load_campaign(name: str) -> Campaign:
    """Return the campaign in a file; relative paths in it start at its folder.

    Raises
    ------
    InputError
        One sentence: unreadable, no TOML, an unknown key, a number outside its range, a scene that cannot be read.
    """
    path = Path(name)
    return parse_campaign(read_text(path), name=path.stem, folder=path.parent)


def parse_campaign(text: str, *, name: str, folder: Path) -> Campaign:
    """Return the campaign that a TOML text describes; raises `InputError`."""
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"campaign {name} is no TOML: {error}") from None
    try:
        part = CampaignPart.model_validate(tables)
    except ValidationError as error:
        raise InputError(sentence(error, f"campaign {name}", _keys_at)) from None
    steps: list[Step] = []
    scenes: dict[str, Scene] = {}
    for k, run in enumerate(part.run):
        asked = run.scene or part.scene
        if asked is None:
            raise InputError(f"campaign {name}: run.{k} has no scene, and the campaign has none for all runs")
        if asked not in scenes:
            scenes[asked] = _scene(asked, folder, f"campaign {name}: run.{k}")
        scene = scenes[asked]
        if run.excitation is not None:
            scene = scene.with_excitation(_placed(run.excitation, folder))
        for level in run.levels_percent or part.levels_percent:
            staged = scene.with_gain(scene.table.gain * level / 100.0)
            steps.append(Step(len(steps) + 1, run.name or f"run {k + 1}", level, staged, run.why))
    return Campaign(name, part.title, tuple(steps))


def campaign_text(title: str, scene: str, runs: list[RunPart], levels: tuple[float, ...], folder: Path) -> str:
    """Return the TOML of a campaign of one scene's runs, to be written into `folder`.

    `scene` is what `load_scene` takes, a path in it counted from the working folder.

    Raises
    ------
    InputError
        Where the levels are none.
    """
    try:
        part = CampaignPart(title=title, scene=_spelled(scene, folder), levels_percent=levels, run=tuple(runs))
    except ValidationError as error:
        raise InputError(sentence(error, "--levels", _keys_at)) from None
    lines = [
        f"title = {_quoted(part.title)}",
        f"scene = {_quoted(part.scene or '')}",
        f"levels_percent = [{', '.join(f'{level:g}' for level in part.levels_percent)}]",
    ]
    for run in part.run:
        lines += ["", "[[run]]", f"name = {_quoted(run.name)}"]
        if run.why:
            lines.append(f"why = {_quoted(run.why)}")
        if run.levels_percent is not None:
            lines.append(f"levels_percent = [{', '.join(f'{level:g}' for level in run.levels_percent)}]")
        if run.excitation is not None:
            own = run.excitation.model_dump(exclude_none=True)
            lines.append("[run.excitation]")
            lines += [f"{key} = {_value(value)}" for key, value in own.items()]
    return "\n".join(lines) + "\n"


def _scene(asked: str, folder: Path, where: str) -> Scene:
    try:
        if asked in shipped_scenes():
            return load_scene(asked)
        path = folder / asked
        if path.suffix != ".toml":
            raise InputError(f"{asked!r:.80} is neither a shipped scene nor a .toml file")
        return load_scene(str(path))
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def _placed(excitation: Excitation, folder: Path) -> Excitation:
    """Return the excitation with its record's path counted from the campaign's folder, not from the scene's."""
    if not isinstance(excitation, RecordPart):
        return excitation
    return excitation.model_copy(update={"path": str((folder / excitation.path).absolute())})


def _spelled(scene: str, folder: Path) -> str:
    """Return how a campaign in `folder` names a scene."""
    if scene in shipped_scenes():
        return scene
    file = Path(scene).absolute()
    try:
        return Path(os.path.relpath(file, folder.absolute())).as_posix()
    except ValueError:  # another drive of Windows
        return file.as_posix()


def _value(value: object) -> str:
    return _quoted(value) if isinstance(value, str) else repr(value)


def _quoted(text: str) -> str:
    """Return a basic string of TOML."""
    plain = text.replace("\\", "\\\\").replace('"', '\\"')
    return '"' + "".join(c if c.isprintable() else f"\\U{ord(c):08X}" for c in plain) + '"'


def _keys_at(place: tuple[str | int, ...]) -> list[str]:
    from twin.scene_parts import PARTS

    tables = [name for name in place[:-1] if isinstance(name, str)]
    models: dict[str, type[BaseModel]] = {**PARTS, "run": RunPart}
    model: Any = models.get(tables[-1], CampaignPart) if tables else CampaignPart
    return list(model.model_fields)
