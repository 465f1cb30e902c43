"""`twin schema`: text, JSON and .proto all say what the descriptors say."""

from __future__ import annotations

import json
import re

import pytest

from recordings.descriptors import file_descriptor
from recordings.schema import TOPICS, VERSION, WELL_KNOWN
from twin.cli import main


def test_the_text_names_every_topic_field_and_unit(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema"]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"schema {VERSION[0]}.{VERSION[1]}: ")
    for topic in TOPICS:
        assert f"\n{topic.name}  {topic.schema_name}, " in said
        for field in topic.fields:
            assert re.search(rf"\n  {field.name} +{field.kind} +{re.escape(field.words)}\n", said)
    for topic, message in WELL_KNOWN.items():
        assert f"{topic}  {message}" in said


def test_the_json_is_the_schema(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["schema", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["version"] == "1.1"
    found = {topic["topic"]: topic for topic in said["topics"]}
    assert list(found) == [topic.name for topic in TOPICS]
    for topic in TOPICS:
        fields = [(f["number"], f["name"], f["type"], f["unit"]) for f in found[topic.name]["fields"]]
        assert fields == [(n, f.name, f.kind, f.unit) for n, f in enumerate(topic.fields, start=1)]
        assert found[topic.name]["required"] == topic.required
    assert found["/forecast"]["fields"][0]["choices"]["3"] == "overturned"


@pytest.mark.parametrize("as_json", [False, True])
def test_the_proto_file_is_the_descriptors(capsys: pytest.CaptureFixture[str], as_json: bool) -> None:
    """Read again by a pattern; protoc itself makes equal descriptors of it (checked once, 2026)."""
    assert main(["schema", "--proto", *(["--json"] if as_json else [])]) == 0
    said = capsys.readouterr().out
    text = json.loads(said)["proto"] if as_json else said
    assert text.startswith('syntax = "proto3";\n\npackage shake_table_twin;\n')
    messages = dict(re.findall(r"\nmessage (\w+) \{\n(.*?)\n\}", text, flags=re.DOTALL))
    described = file_descriptor()
    assert list(messages) == [message.name for message in described.message_type]
    for message in described.message_type:
        fields = re.findall(r"^  (\w+) (\w+) = (\d+);  // ", messages[message.name], flags=re.MULTILINE)
        assert [(name, int(number)) for _, name, number in fields] == [(f.name, f.number) for f in message.field]
        for (kind, _, _), field in zip(fields, message.field, strict=True):
            assert kind in (field.type_name.rpartition(".")[2], type(field).Type.Name(field.type)[5:].lower())
        values = re.findall(r"^    (\w+) = (\d+);$", messages[message.name], flags=re.MULTILINE)
        expected = [(value.name, value.number) for enum in message.enum_type for value in enum.value]
        assert [(name, int(number)) for name, number in values] == expected
