"""Protobuf descriptors and message classes, derived from `recordings.schema`."""

from __future__ import annotations

from functools import cache, lru_cache
from typing import TYPE_CHECKING, NamedTuple

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    EnumDescriptorProto,
    EnumValueDescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
    SourceCodeInfo,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError, Message
from google.protobuf.message_factory import GetMessageClass

from recordings.schema import TOPICS
from recordings.topic import MOST_FIELDS, PACKAGE, Choices, Field, Kind, Topic

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

_TYPE: dict[Kind, FieldDescriptorProto.Type.ValueType] = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "fixed64": FieldDescriptorProto.TYPE_FIXED64,
    "fixed32": FieldDescriptorProto.TYPE_FIXED32,
    "enum": FieldDescriptorProto.TYPE_ENUM,
}
_KIND: dict[int, Kind] = {number: kind for kind, number in _TYPE.items()}
_MESSAGE_TYPE_PATH = 4  # FileDescriptorProto.message_type
_FIELD_PATH = 2  # DescriptorProto.field


def _describe(topic: Topic) -> DescriptorProto:
    fields = [
        FieldDescriptorProto(
            name=field.name,
            number=number,
            type=_TYPE[field.kind],
            label=FieldDescriptorProto.LABEL_OPTIONAL,
            type_name=f".{topic.schema_name}.{field.choices.name}" if field.choices else None,
        )
        for number, field in enumerate(topic.fields, start=1)
    ]
    choices = {field.choices.name: field.choices for field in topic.fields if field.choices}
    # Inside the message: a reader that pools the descriptors of several topics meets no name twice.
    return DescriptorProto(name=topic.message, field=fields, enum_type=map(_enum, choices.values()))


def _enum(choices: Choices) -> EnumDescriptorProto:
    values = [EnumValueDescriptorProto(name=label, number=code) for code, label in enumerate(choices.labels)]
    return EnumDescriptorProto(name=choices.name, value=values)


def _file(name: str, topics: Iterable[Topic]) -> FileDescriptorProto:
    """Describe some topics as one proto3 file; the schema's texts and units are in it as comments."""
    file = FileDescriptorProto(name=f"{name}.proto", package=PACKAGE, syntax="proto3")
    comments = SourceCodeInfo()
    for index, topic in enumerate(topics):
        file.message_type.append(_describe(topic))
        path = [_MESSAGE_TYPE_PATH, index]
        comments.location.add(path=path, span=[0, 0, 0], leading_comments=f" {topic.text}\n")
        for place, field in enumerate(topic.fields):
            comments.location.add(
                path=[*path, _FIELD_PATH, place], span=[0, 0, 0], leading_comments=f" {field.text}; unit {field.unit}\n"
            )
    file.source_code_info.CopyFrom(comments)
    return file


@cache
def file_descriptor() -> FileDescriptorProto:
    """All messages as one proto3 file."""
    return _file(PACKAGE, TOPICS)


@cache
def descriptor_set(topic: Topic) -> bytes:
    """What the MCAP schema record of a topic holds: a serialised FileDescriptorSet with everything it refers to."""
    return FileDescriptorSet(file=[_file(f"{PACKAGE}/{topic.message}", [topic])]).SerializeToString()


@cache
def _message_classes() -> Mapping[str, type[Message]]:
    pool = DescriptorPool()
    pool.Add(file_descriptor())
    return {topic.name: GetMessageClass(pool.FindMessageTypeByName(topic.schema_name)) for topic in TOPICS}


def message_class(topic: Topic) -> type[Message]:
    """Dynamic message class of a topic of ours."""
    return _message_classes()[topic.name]


def parse_fields(topic: Topic, payload: bytes) -> tuple[float | int, ...]:
    """Field values of one encoded message, in the schema's order; ValueError where the bytes are no such message."""
    message = message_class(topic)()
    try:
        message.ParseFromString(payload)
    except DecodeError as error:
        raise ValueError(str(error)) from None
    return tuple(getattr(message, field.name) for field in topic.fields)


class Recorded(NamedTuple):
    """Fields of a topic as a file's own descriptors have them, in the order of their numbers.

    Fewer than the schema has (an older minor version) or more (a newer one); `fixed` says whether each is known to have
    a fixed width, so that messages need not be read one by one.
    """

    fields: tuple[Field, ...]
    fixed: bool


@lru_cache(maxsize=64)
def recorded_fields(topic: Topic, schema_data: bytes) -> Recorded:
    """Fields of `topic` in a file.

    Raises
    ------
    ValueError
        The descriptors cannot be parsed, lack the message, or say something else of a field that the schema has.
    """
    try:
        files = FileDescriptorSet.FromString(schema_data).file
    except DecodeError:
        raise ValueError("its descriptors cannot be parsed") from None
    for file in files:
        for message in file.message_type:
            if f"{file.package}.{message.name}" == topic.schema_name:
                return _fields_of(topic, message)
    raise ValueError(f"its descriptors have no message {topic.schema_name}")


def _fields_of(topic: Topic, message: DescriptorProto) -> Recorded:
    found = {field.number: field for field in message.field}
    known: list[Field] = []
    for number, field in enumerate(topic.fields, start=1):
        other = found.get(number)
        if other is not None:
            if other.name != field.name or other.type != _TYPE[field.kind]:
                raise ValueError(f"field {number} is not {field.name} ({field.kind})")
            known.append(field)
    if not known:
        raise ValueError("it has none of the fields")
    fixed = sorted(found) == list(range(1, len(found) + 1)) and len(found) <= MOST_FIELDS
    if not fixed or not all(field.type in _KIND for field in found.values()):
        return Recorded(tuple(known), fixed=False)
    newer = [Field(f.name, "", _KIND[f.type], "", "") for n, f in sorted(found.items()) if n > len(topic.fields)]
    return Recorded((*known, *newer), fixed=True)
