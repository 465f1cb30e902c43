"""The schema is the one place: records, descriptors and packed bytes must all follow from it."""

from __future__ import annotations

import dataclasses
import struct

import pytest

from recordings.descriptors import descriptor_set, file_descriptor, message_class, mismatch, parse_fields
from recordings.schema import CYCLE, CYCLE_TOPICS, EVENT_TIME, MISSED, TABLE_MEASURED, TOPICS, Topic
from twin.cycle import CycleRecord, Event, Missed

UNITS = {"m": "_m", "m/s2": "_m_s2", "rad": "_rad", "rad/s": "_rad_s", "s": "_s"}


def _pack(topic: Topic, values: list[float]) -> bytes:
    parts = [part for pair in zip(topic.tags, values, strict=True) for part in pair]
    return struct.pack(topic.struct_format, *parts)


def test_every_field_of_a_cycle_is_recorded_once() -> None:
    recorded = [field.source for topic in CYCLE_TOPICS for field in topic.fields]
    # The host's time is the message's log_time.
    assert sorted([*recorded, "host_time_ns"]) == sorted(field.name for field in dataclasses.fields(CycleRecord))


@pytest.mark.parametrize(("topic", "source"), [(MISSED, Missed), (EVENT_TIME, Event)])
def test_other_topics_name_real_attributes(topic: Topic, source: type) -> None:
    names = {field.name for field in dataclasses.fields(source)}
    assert {field.source for field in topic.fields} <= names


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_names_carry_their_unit(topic: Topic) -> None:
    for field in topic.fields:
        assert field.name.endswith(UNITS.get(field.unit, "")), field
        assert (field.unit == "1") == (field.kind != "double"), field


def test_topics_and_messages_are_named_once() -> None:
    assert len({topic.name for topic in TOPICS}) == len({topic.message for topic in TOPICS}) == len(TOPICS)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_packed_bytes_are_what_protobuf_writes(topic: Topic) -> None:
    values = [3.5 + place if field.kind == "double" else 7 + place for place, field in enumerate(topic.fields)]
    message = message_class(topic)()
    for field, value in zip(topic.fields, values, strict=True):
        setattr(message, field.name, value)
    assert message.SerializeToString() == _pack(topic, values)
    assert parse_fields(topic, _pack(topic, values)) == tuple(values)


def test_bytes_that_are_no_message_are_a_value_error() -> None:
    with pytest.raises(ValueError, match=r"."):
        parse_fields(CYCLE, b"\x09\x01")


def test_texts_and_units_travel_as_comments() -> None:
    comments = " ".join(location.leading_comments for location in file_descriptor().source_code_info.location)
    for topic in TOPICS:
        assert topic.text in comments
        for field in topic.fields:
            assert f"{field.text}; unit {field.unit}" in comments


def test_descriptors_of_another_meaning_are_told_apart() -> None:
    assert mismatch(TABLE_MEASURED, descriptor_set()) is None
    renamed = descriptor_set().replace(b"acceleration_m_s2", b"acceleration_g_00")
    assert mismatch(TABLE_MEASURED, renamed) == "field 2 is not acceleration_m_s2 (double)"
    assert mismatch(TABLE_MEASURED, b"") == "its descriptors have no message shake_table_twin.TableMeasured"
    assert mismatch(TABLE_MEASURED, b"\xff\xff") == "its descriptors cannot be parsed"
