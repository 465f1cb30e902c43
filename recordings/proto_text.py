"""The text of the .proto file, written from the descriptors: what a laboratory feeds to protoc."""

from __future__ import annotations

from typing import TYPE_CHECKING

from google.protobuf.descriptor_pb2 import FieldDescriptorProto

from recordings.descriptors import file_descriptor

if TYPE_CHECKING:
    from collections.abc import Iterator

    from google.protobuf.descriptor_pb2 import DescriptorProto

_INDENT = "  "


def proto_text() -> str:
    """All messages of a recording that are our own, as protoc reads them."""
    file = file_descriptor()
    comments = {tuple(place.path): place.leading_comments.strip() for place in file.source_code_info.location}
    lines = [f'syntax = "{file.syntax}";', "", f"package {file.package};"]
    for index, message in enumerate(file.message_type):
        lines += ["", f"// {comments[(4, index)]}", f"message {message.name} {{"]
        lines += _message(message, {path[3]: text for path, text in comments.items() if path[:3] == (4, index, 2)})
        lines.append("}")
    return "\n".join(lines) + "\n"


def _message(message: DescriptorProto, comments: dict[int, str]) -> Iterator[str]:
    for enum in message.enum_type:
        yield f"{_INDENT}enum {enum.name} {{"
        for value in enum.value:
            yield f"{_INDENT * 2}{value.name} = {value.number};"
        yield f"{_INDENT}}}"
    for place, field in enumerate(message.field):
        kind = field.type_name.rpartition(".")[2] or FieldDescriptorProto.Type.Name(field.type)[len("TYPE_") :].lower()
        yield f"{_INDENT}{kind} {field.name} = {field.number};  // {comments[place]}"
