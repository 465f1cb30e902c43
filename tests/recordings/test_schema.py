"""The schema is the one place: records, descriptors and packed bytes must all follow from it."""

from __future__ import annotations

import dataclasses
import struct
from typing import get_args

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet

from recordings.descriptors import descriptor_set, file_descriptor, message_class, parse_fields, recorded_fields
from recordings.run import Cycles
from recordings.schema import (
    ADVICE,
    CAN_FRAME,
    CYCLE,
    CYCLE_TOPICS,
    CYCLE_UNITS,
    ESTIMATE,
    EVENT_TIME,
    FORECAST,
    MISSED,
    OUTCOME,
    TABLE_MEASURED,
    TOPICS,
    VERSION,
)
from recordings.topic import LARGEST_CODE, MOST_FIELDS, Topic
from twin.cycle import Advice, CanFrame, CycleRecord, Estimated, Event, Forecasted, Missed, Outlook
from twin.rocking.response import Outcome

UNITS = {"m": "_m", "m/s2": "_m_s2", "rad": "_rad", "rad/s": "_rad_s", "s": "_s"}


def _pack(topic: Topic, values: list[float]) -> bytes:
    parts = [part for pair in zip(topic.tags, values, strict=True) for part in pair]
    return struct.pack(f"<{topic.struct_format}", *parts)


def test_every_field_of_a_cycle_is_recorded_once() -> None:
    recorded = [field.source for topic in CYCLE_TOPICS for field in topic.fields]
    # The host's time is the message's log_time; forecast and estimate have topics of their own.
    known = [*recorded, "host_time_ns", "forecast", "estimate"]
    assert sorted(known) == sorted(field.name for field in dataclasses.fields(CycleRecord))
    assert set(CYCLE_UNITS) == {field.name for field in dataclasses.fields(Cycles)}


@pytest.mark.parametrize(("topic", "source"), [(FORECAST, Forecasted), (ESTIMATE, Estimated)])
def test_optional_parts_of_a_cycle_are_recorded_field_by_field(topic: Topic, source: type) -> None:
    assert [field.source for field in topic.fields] == [field.name for field in dataclasses.fields(source)]


@pytest.mark.parametrize(("topic", "source"), [(MISSED, Missed), (EVENT_TIME, Event), (CAN_FRAME, CanFrame)])
def test_other_topics_name_real_attributes(topic: Topic, source: type) -> None:
    names = {field.name for field in dataclasses.fields(source)}
    assert {field.source for field in topic.fields} <= names


def test_choices_are_those_of_the_live_twin() -> None:
    assert OUTCOME.names == get_args(Outlook)
    assert set(OUTCOME.names) == {"unknown"} | {outcome.value for outcome in Outcome}
    assert ADVICE.names == get_args(Advice)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_a_topic_can_be_packed_and_is_not_newer_than_the_schema(topic: Topic) -> None:
    assert 1 <= len(topic.fields) <= MOST_FIELDS
    assert topic.since <= VERSION
    assert topic.required == (topic in CYCLE_TOPICS)
    assert not topic.required or topic.since == (1, 0)
    for field in topic.fields:
        assert (field.choices is not None) == (field.kind == "enum")
        assert field.choices is None or len(field.choices.names) <= LARGEST_CODE


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_names_carry_their_unit(topic: Topic) -> None:
    for field in topic.fields:
        assert field.name.endswith(UNITS.get(field.unit, "")), field
        assert field.kind == "double" or field.unit == "1", field


def test_topics_and_messages_are_named_once() -> None:
    assert len({topic.name for topic in TOPICS}) == len({topic.message for topic in TOPICS}) == len(TOPICS)


@pytest.mark.parametrize("topic", TOPICS, ids=lambda topic: topic.name)
def test_packed_bytes_are_what_protobuf_writes(topic: Topic) -> None:
    values = [{"double": 3.5 + place, "enum": 1}.get(field.kind, 7 + place) for place, field in enumerate(topic.fields)]
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
    known = descriptor_set(TABLE_MEASURED)
    assert recorded_fields(TABLE_MEASURED, known) == (TABLE_MEASURED.fields, True)
    for data, sentence in (
        (known.replace(b"acceleration_m_s2", b"acceleration_g_00"), r"^field 2 is not acceleration_m_s2 \(double\)$"),
        (b"", "^its descriptors have no message shake_table_twin.TableMeasured$"),
        (b"\xff\xff", "^its descriptors cannot be parsed$"),
    ):
        with pytest.raises(ValueError, match=sentence):
            recorded_fields(TABLE_MEASURED, data)


def test_fields_of_another_minor_version() -> None:
    older, newer = (
        FileDescriptorSet.FromString(descriptor_set(CYCLE)),
        FileDescriptorSet.FromString(descriptor_set(CYCLE)),
    )
    del older.file[0].message_type[0].field[2]
    assert recorded_fields(CYCLE, older.SerializeToString()) == (CYCLE.fields[:2], True)
    fields = newer.file[0].message_type[0].field
    fields.add(name="work_s", number=4, type=fields[1].type, label=fields[1].label)
    recorded = recorded_fields(CYCLE, newer.SerializeToString())
    assert recorded.fixed
    assert [field.name for field in recorded.fields] == ["cycle", "time_s", "lateness_s", "work_s"]
    fields.add(name="host", number=5, type="TYPE_STRING", label=fields[1].label)
    assert recorded_fields(CYCLE, newer.SerializeToString()) == (CYCLE.fields, False)
