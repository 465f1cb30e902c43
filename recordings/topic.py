"""What a topic of the schema is: a message whose fields have a name, a unit and a fixed width."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from collections.abc import Sequence

PACKAGE = "shake_table_twin"

Kind = Literal["double", "fixed64", "fixed32", "enum"]

MOST_FIELDS = 15
"""Of a message: their keys are one byte each."""
LARGEST_CODE = 127
"""Of a choice: one byte of a protobuf varint holds no more."""

_WIRE_TYPE: dict[Kind, int] = {"double": 1, "fixed64": 1, "fixed32": 5, "enum": 0}
_STRUCT_CODE: dict[Kind, str] = {"double": "d", "fixed64": "Q", "fixed32": "I", "enum": "B"}
_NUMPY_CODE: dict[Kind, str] = {"double": "<f8", "fixed64": "<u8", "fixed32": "<u4", "enum": "u1"}


@dataclass(frozen=True, slots=True)
class Choices:
    """The names a field of kind "enum" chooses from; a name's place is its code, and place 0 stands for "not said".

    >>> Choices("Advice", ("none", "stopping helps")).labels
    ('ADVICE_NONE', 'ADVICE_STOPPING_HELPS')
    """

    name: str
    names: tuple[str, ...]

    @property
    def labels(self) -> tuple[str, ...]:
        """The names as protobuf has them: in capitals, with the enum's own name in front."""
        return tuple(f"{self.name}_{name}".upper().replace(" ", "_") for name in self.names)


@dataclass(frozen=True, slots=True)
class Field:
    """One value of a message.

    Attributes
    ----------
    name : str
        Name in the file, with its unit.
    source : str
        Attribute of the dataclass of `twin.cycle` it comes from.
    kind : {"double", "fixed64", "fixed32", "enum"}
        Protobuf type.
    unit : str
        SI unit, "1" for a count, a ratio or a choice.
    text : str
        What it is, with its sign.
    choices : Choices or None
        Of an enum.
    """

    name: str
    source: str
    kind: Kind
    unit: str
    text: str
    choices: Choices | None = None

    @property
    def struct_code(self) -> str:
        """`struct` code of the encoded value."""
        return _STRUCT_CODE[self.kind]

    @property
    def numpy_code(self) -> str:
        """Type of the field's array."""
        return _NUMPY_CODE[self.kind]

    @property
    def words(self) -> str:
        """Unit, meaning and choices in one line."""
        codes = "" if self.choices is None else f" ({', '.join(f'{i} {n}' for i, n in enumerate(self.choices.names))})"
        return f"{self.unit}: {self.text}{codes}"


@dataclass(frozen=True, slots=True)
class Topic:
    """One signal group: the topic's name, the name of its message and the fields.

    Attributes
    ----------
    name, message : str
        Topic and message in the file.
    text : str
        What it is.
    fields : tuple of Field
        In the order of their numbers, from 1; `MOST_FIELDS` at most.
    required : bool
        Whether a recording without it cannot be read.
    since : tuple of int
        Version of the schema that brought it.
    """

    name: str
    message: str
    text: str
    fields: tuple[Field, ...]
    required: bool = False
    since: tuple[int, int] = (1, 0)

    @property
    def schema_name(self) -> str:
        """Full protobuf name of the message."""
        return f"{PACKAGE}.{self.message}"

    @property
    def tags(self) -> bytes:
        """Protobuf key byte of each field, in order."""
        return keys(self.fields)

    @property
    def struct_format(self) -> str:
        """`struct` format of the encoded message, without byte order: a key byte, then the value, for each field."""
        return "".join("B" + field.struct_code for field in self.fields)


def keys(fields: Sequence[Field]) -> bytes:
    """Protobuf key byte of each field, where the first one has number 1."""
    return bytes((number << 3) | _WIRE_TYPE[field.kind] for number, field in enumerate(fields, start=1))


def columns(fields: Sequence[Field]) -> list[tuple[str, str]]:
    """Layout of an encoded message as a numpy structured type: `key1`, first field, `key2`, second field, ..."""
    layout: list[tuple[str, str]] = []
    for number, field in enumerate(fields, start=1):
        layout += [(f"key{number}", "u1"), (field.name, field.numpy_code)]
    return layout
