"""A user's own numbers for one device, in a table of his capacity file: `[emulator]`, `[hil]`.

The keys have their unit in the name; each stands for one attribute of a model in SI units, and the model keeps where
its numbers come from.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, ClassVar, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError

if TYPE_CHECKING:
    from excitation import Capacity

_UNSOURCED = "user's own number, no source given"

Keys = Mapping[str, tuple[str, float]]
"""Key in the file -> attribute of the model, and the key's unit in SI units (1 where it has none)."""


class OwnNumbers(BaseModel):
    """A model whose numbers say where they come from: the fields' descriptions, unless the number is the user's.

    Attributes
    ----------
    keys : mapping
        Of the table it is read from.
    own : mapping
        Of the user's own numbers: attribute -> where it comes from.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    keys: ClassVar[Keys] = {}

    own: dict[str, str] = {}

    def source(self, name: str) -> str:
        """Return where the number called `name` comes from."""
        return self.own.get(name) or type(self).model_fields[name].description or ""

    def described(self) -> dict[str, tuple[object, str]]:
        """Return every number, in the unit of its key, and where it comes from: {key: (value, source)}."""
        rows: dict[str, tuple[object, str]] = {}
        for key, (attribute, unit) in self.keys.items():
            value = getattr(self, attribute)
            rows[key] = (float(f"{value / unit:.12g}") if isinstance(value, float) else value, self.source(attribute))
        return rows

    def notes(self, capacity: Capacity, payload: float) -> list[str]:  # noqa: ARG002 - for those who have something to say
        """Return in sentences what a table of `capacity` cannot do with `payload`, kg, on it."""
        return []


Model = TypeVar("Model", bound=OwnNumbers)


def read_own(model: type[Model], table: Mapping[str, object], name: str) -> Model:
    """Return the model with the numbers of a table in it.

    Parameters
    ----------
    model : type
    table : mapping
        Any of the keys, and a table `provenance` that says under the same keys where they come from.
    name : str
        What sentences call the table.

    Raises
    ------
    ValueError
        One sentence: an unknown key, a missing one, a number out of its range.
    """
    keys, sources = model.keys, table.get("provenance", {})
    if not isinstance(sources, Mapping):
        raise ValueError(f"{name}: provenance is {sources!r}; it must be a table")
    texts = {str(key): str(text) for key, text in sources.items()}  # pyright: ignore[reportUnknownArgumentType, reportUnknownVariableType]
    given: dict[str, object] = {}
    own: dict[str, str] = {}
    for key, value in table.items():
        if key == "provenance":
            continue
        if key not in keys:
            raise ValueError(f"{name} has an unknown key {key!r}; it takes {', '.join(keys)}")
        attribute, unit = keys[key]
        # A whole number stays one: it may be that of a channel.
        given[attribute] = value * unit if isinstance(value, float) or (type(value) is int and unit != 1.0) else value
        own[attribute] = texts.pop(key, _UNSOURCED)
    for key in texts:
        raise ValueError(f"{name} has provenance for {key!r}, which it does not give")
    try:
        return model.model_validate({**given, "own": own})
    except ValidationError as error:
        raise ValueError(f"{name} {_problem(error, keys)}") from error


def _problem(error: ValidationError, keys: Keys) -> str:
    first = error.errors(include_url=False)[0]
    place = ".".join(str(part) for part in first["loc"])
    message = first["msg"].removeprefix("Value error, ")
    if first["type"] == "missing":
        return f"has no {next(key for key, (attribute, _) in keys.items() if attribute == place)!r}"
    return f"has {place} = {first['input']!r}: {message.lower()}" if place else f"has {message}"
