"""Protobuf descriptors and message classes, derived from `recordings.schema`."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

from google.protobuf.descriptor_pb2 import (
    DescriptorProto,
    FieldDescriptorProto,
    FileDescriptorProto,
    FileDescriptorSet,
    SourceCodeInfo,
)
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError, Message
from google.protobuf.message_factory import GetMessageClass

from recordings.schema import PACKAGE, TOPICS, Kind, Topic

if TYPE_CHECKING:
    from collections.abc import Mapping

_TYPE: dict[Kind, FieldDescriptorProto.Type.ValueType] = {
    "double": FieldDescriptorProto.TYPE_DOUBLE,
    "fixed64": FieldDescriptorProto.TYPE_FIXED64,
    "fixed32": FieldDescriptorProto.TYPE_FIXED32,
}
_MESSAGE_TYPE_PATH = 4  # FileDescriptorProto.message_type
_FIELD_PATH = 2  # DescriptorProto.field


def _describe(topic: Topic) -> DescriptorProto:
    fields = [
        FieldDescriptorProto(
            name=field.name, number=number, type=_TYPE[field.kind], label=FieldDescriptorProto.LABEL_OPTIONAL
        )
        for number, field in enumerate(topic.fields, start=1)
    ]
    return DescriptorProto(name=topic.message, field=fields)


@cache
def file_descriptor() -> FileDescriptorProto:
    """All messages as one proto3 file; the schema's texts and units are in it as comments."""
    file = FileDescriptorProto(name=f"{PACKAGE}.proto", package=PACKAGE, syntax="proto3")
    comments = SourceCodeInfo()
    for index, topic in enumerate(TOPICS):
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
def descriptor_set() -> bytes:
    """What an MCAP schema record of encoding `protobuf` holds: a serialised FileDescriptorSet."""
    return FileDescriptorSet(file=[file_descriptor()]).SerializeToString()


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


def mismatch(topic: Topic, schema_data: bytes) -> str | None:
    """Say how a file's own descriptors disagree with the schema of `topic`; None where every field is as expected."""
    try:
        files = FileDescriptorSet.FromString(schema_data).file
    except DecodeError:
        return "its descriptors cannot be parsed"
    for file in files:
        for message in file.message_type:
            if f"{file.package}.{message.name}" == topic.schema_name:
                found = {field.number: field for field in message.field}
                for number, field in enumerate(topic.fields, start=1):
                    other = found.get(number)
                    if other is None or other.name != field.name or other.type != _TYPE[field.kind]:
                        return f"field {number} is not {field.name} ({field.kind})"
                return None
    return f"its descriptors have no message {topic.schema_name}"
