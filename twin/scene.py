"""A scene: block, excitation, table and twin, as one TOML file with the units in the names of its keys."""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Annotated

from pydantic import Field, PrivateAttr, ValidationError

from excitation import Pulse
from twin.errors import InputError, did_you_mean, sentence
from twin.scene_faults import FaultPart
from twin.scene_notes import NOTES, NotesPart
from twin.scene_parts import PARTS, BlockPart, Excitation, Part, RecordPart, TablePart, TwinPart
from twin.scene_trips import TRIPS, TripsPart
from twin.scene_uncertainty import UNCERTAINTY, KnownUncertainty, TableUncertaintyPart, UncertaintyPart
from twin.text_file import read_text


class Scene(Part):
    """Everything a run is made of. Read one with `load_scene`."""

    title: str = ""
    block: BlockPart
    excitation: Excitation
    table: TablePart
    twin: TwinPart = TwinPart()
    uncertainty: UncertaintyPart = UncertaintyPart()
    fault: Annotated[tuple[FaultPart, ...], Field(strict=False)] = ()
    notes: NotesPart = NotesPart()
    trips: TripsPart = TripsPart()
    _name: str = PrivateAttr("scene")
    _folder: Path = PrivateAttr(Path())

    @property
    def name(self) -> str:
        """The scene's short name: the file's, without its ending."""
        return self._name

    @property
    def folder(self) -> Path:
        """Where relative paths in the scene start."""
        return self._folder

    @property
    def spreads(self) -> KnownUncertainty:
        """`[uncertainty]`, with `[twin]`'s spreads where it says nothing."""
        return self.uncertainty.filled(self.twin)

    def pulse(self) -> Pulse | None:
        """Return the excitation asked for, in SI units, times the table's gain; None where nothing shakes.

        Raises
        ------
        InputError
            Where its numbers or its file cannot be used.
        """
        try:
            pulse = self.excitation.pulse(self.block.gravity_m_s2, self._folder)
            return pulse if pulse is None or self.table.gain == 1.0 else pulse.scaled(self.table.gain)
        except ValidationError as error:
            raise InputError(sentence(error, f"scene {self._name}: excitation", _keys_at)) from None
        except InputError:
            raise
        except ValueError as error:
            raise InputError(f"scene {self._name}: excitation: {error}") from None

    def with_record(self, path: Path, scale: float = 1.0) -> Scene:
        """Return this scene shaken by a record file instead; `path` starts at the working folder."""
        record = RecordPart(kind="record", path=str(path.absolute()), scale=scale)
        changed = self.model_copy(update={"excitation": record, "title": f"under {path.name}"})
        return _placed(changed, self._name, self._folder)

    def with_faults(self, faults: list[FaultPart]) -> Scene:
        """Return this scene with more faults."""
        return _placed(self.model_copy(update={"fault": (*self.fault, *faults)}), self._name, self._folder)

    def with_excitation(self, excitation: Excitation) -> Scene:
        """Return this scene with another excitation; a record's relative path starts at the scene's folder."""
        return _placed(self.model_copy(update={"excitation": excitation}), self._name, self._folder)

    def with_gain(self, gain: float) -> Scene:
        """Return this scene with its whole pulse scaled by `gain`, above 0 and at most 1; raises `InputError`."""
        if not 0.0 < gain <= 1.0:
            raise InputError(f"--gain is {gain:g}; it must be above 0 and at most 1")
        table = self.table.model_copy(update={"gain": gain})
        return _placed(self.model_copy(update={"table": table}), self._name, self._folder)


def shipped_scenes() -> dict[str, str]:
    """Return the scenes that come with the package: name -> TOML text."""
    folder = files("twin") / "scenes"
    texts = {item.name.removesuffix(".toml"): item for item in folder.iterdir() if item.name.endswith(".toml")}
    return {name: texts[name].read_text(encoding="utf-8") for name in sorted(texts)}


def load_scene(name: str) -> Scene:
    """Return a shipped scene by name, or a scene file by its path (anything with a folder or ending in .toml).

    Raises
    ------
    InputError
        One sentence: no such scene, unreadable, no TOML, an unknown key, a number outside its range.
    """
    path = Path(name)
    if path.suffix == ".toml" or len(path.parts) > 1:
        return parse_scene(read_text(path), name=path.stem, folder=path.parent)
    shipped = shipped_scenes()
    if name not in shipped:
        raise InputError(f"no scene named {name!r}{did_you_mean(name, shipped)}; or give the path of a .toml file")
    return parse_scene(shipped[name], name=name, folder=Path())


def parse_scene(text: str, *, name: str, folder: Path) -> Scene:
    """Return the scene a TOML text describes; raises `InputError`."""
    try:
        tables = tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"scene {name} is no TOML: {error}") from None
    try:
        scene = Scene.model_validate(tables)
        scene.block.block()
    except ValidationError as error:
        raise InputError(sentence(error, f"scene {name}", _keys_at)) from None
    return _placed(scene, name, folder)


def parse_scene_json(text: str, *, name: str, folder: Path) -> Scene:
    """Return the scene a recording holds as JSON; raises `InputError`."""
    try:
        scene = Scene.model_validate_json(text)
        scene.block.block()
    except ValidationError as error:
        raise InputError(sentence(error, f"recorded scene {name}", _keys_at)) from None
    return _placed(scene, name, folder)


def _placed(scene: Scene, name: str, folder: Path) -> Scene:
    scene._name = name  # pyright: ignore[reportPrivateUsage]
    scene._folder = folder  # pyright: ignore[reportPrivateUsage]
    return scene


def _keys_at(place: tuple[str | int, ...]) -> list[str]:
    """Return the keys known at the place of an unknown one."""
    # Of a list of tables the place says which one.
    tables = [name for name in place[:-1] if isinstance(name, str)]
    if tables[:2] == ["uncertainty", "table"] and len(tables) == 2:
        return list(TableUncertaintyPart.model_fields)
    model = {**UNCERTAINTY, **PARTS, **NOTES, **TRIPS, "fault": FaultPart}.get(tables[-1], Scene) if tables else Scene
    return list(model.model_fields)
