"""`--set KEY=VALUE`: another value for any key of a scene."""

from __future__ import annotations

import json
import tomllib
from typing import Any, cast

from twin.errors import InputError
from twin.scene import Scene, parse_scene_json

MOVES_THE_BASE = ("excitation", "table", "twin.cycle_hz")
"""Tables and keys that change how the base moves."""
EMULATED_BLOCK = "table.specimen"
"""The exception: it changes the emulated block alone."""
PREDICTS = "block"
"""The table the prediction is made from."""


def assignments(texts: list[str]) -> list[tuple[str, object]]:
    """Return (dotted key, value) of each KEY=VALUE; `none` takes a key away; raises `InputError`.

    Values are spelled as in a scene file; a bare word is text.

    >>> assignments(["block.restitution=0.9", "excitation.kind=cosine"])
    [('block.restitution', 0.9), ('excitation.kind', 'cosine')]
    """
    found: list[tuple[str, object]] = []
    for text in texts:
        key, equals, value = text.partition("=")
        key, value = key.strip(), value.strip()
        if not equals or not key or not value:
            raise InputError(f"--set {text!r} is not KEY=VALUE, as in block.restitution=0.9")
        found.append((key, _value(value)))
    return found


def changed(scene: Scene, changes: list[tuple[str, object]]) -> Scene:
    """Return the scene with those keys changed; raises `InputError` where a key or a value is none of a scene's."""
    tables = scene.model_dump(mode="json", exclude_none=True)
    for key, value in changes:
        *path, last = key.split(".")
        table = tables
        for name in path:
            inner = table.setdefault(name, {})
            if not isinstance(inner, dict):
                raise InputError(f"--set {key}: {name} is a value, not a table")
            table = cast("dict[str, Any]", inner)
        if value is None:
            table.pop(last, None)
        else:
            table[last] = value
    return parse_scene_json(json.dumps(tables), name=f"{scene.name} with --set", folder=scene.folder)


def moves_the_base(changes: list[tuple[str, object]]) -> list[str]:
    """Return the keys by which the base would have moved otherwise."""
    return [key for key, _ in changes if _within(key, MOVES_THE_BASE) and not _within(key, (EMULATED_BLOCK,))]


def without_effect(changes: list[tuple[str, object]]) -> list[str]:
    """Return the keys that a prediction does not depend on."""
    return [key for key, _ in changes if not _within(key, (PREDICTS,)) and key not in moves_the_base(changes)]


def _within(key: str, places: tuple[str, ...]) -> bool:
    return any(key == place or key.startswith(f"{place}.") for place in places)


def _value(text: str) -> object:
    if text.lower() == "none":
        return None
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except ValueError:
        return text
