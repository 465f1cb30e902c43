"""`twin schema`: what is in a recording."""

from __future__ import annotations

import argparse
import json

from recordings.schema import TOPICS, VERSION, WELL_KNOWN
from recordings.topic import Field, Topic


def run(options: argparse.Namespace) -> int:
    """Print the schema, as text, as JSON, or as a .proto file."""
    if options.proto:
        # Only here protobuf itself is needed.
        from recordings.proto_text import proto_text

        text = proto_text()
        print(json.dumps({"proto": text}) if options.json else text.rstrip("\n"))
    elif options.json:
        print(json.dumps(_data(), indent=2))
    else:
        print("\n".join(_lines()))
    return 0


def _lines() -> list[str]:
    major, minor = VERSION
    lines = [f"schema {major}.{minor}: MCAP, protobuf messages with their descriptors in the file"]
    for topic in TOPICS:
        need = "in every cycle" if topic.required else f"where there is one, since {topic.since[0]}.{topic.since[1]}"
        lines += ["", f"{topic.name}  {topic.schema_name}, {need}", f"  {topic.text}"]
        width = max(len(field.name) for field in topic.fields)
        lines += [f"  {field.name:{width}}  {field.kind:7}  {field.words}" for field in topic.fields]
    return [*lines, "", *(f"{name}  {message}" for name, message in WELL_KNOWN.items())]


def _data() -> dict[str, object]:
    return {
        "version": ".".join(map(str, VERSION)),
        "topics": [_topic(topic) for topic in TOPICS],
        "well_known": WELL_KNOWN,
    }


def _topic(topic: Topic) -> dict[str, object]:
    return {
        "topic": topic.name,
        "message": topic.schema_name,
        "text": topic.text,
        "required": topic.required,
        "since": ".".join(map(str, topic.since)),
        "fields": [_field(number, field) for number, field in enumerate(topic.fields, start=1)],
    }


def _field(number: int, field: Field) -> dict[str, object]:
    described: dict[str, object] = {
        "number": number,
        "name": field.name,
        "type": field.kind,
        "unit": field.unit,
        "text": field.text,
    }
    if field.choices is not None:
        described["choices"] = dict(enumerate(field.choices.names))
    return described
