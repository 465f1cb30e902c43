"""Readers of another make decode every topic: Rerun's (Rust), Foxglove's (TypeScript), and what their rules ask for."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections import defaultdict
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FieldDescriptorProto, FileDescriptorSet
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.records import ChunkIndex
from mcap.stream_reader import StreamReader
from rerun.chunk import RrdReader

from recordings import Run, read_run
from recordings.can_traffic import frames
from recordings.schema import ADVICE, CYCLE_TOPICS, OUTCOME, TOPICS, WELL_KNOWN
from tests.recordings.mutations import write_reference

if TYPE_CHECKING:
    from collections.abc import Callable

NODE_MODULES = "TWIN_NODE_MODULES"
"""Environment variable: a node_modules folder with @mcap/core, @mcap/nodejs, @mcap/support and protobufjs."""
EVERY_TOPIC = {topic.name for topic in TOPICS} | set(WELL_KNOWN)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A recording with every topic there is."""
    path = tmp_path_factory.mktemp("other") / "run.mcap"
    write_reference(path)
    run = read_run(path)
    assert set(run.topics) == EVERY_TOPIC
    assert run.complete
    return run


def _check(run: Run, found: dict[str, list[dict[str, Any]]], word: Callable[[Any], str]) -> None:
    """Compare decoded messages of our topics with the run, bit for bit; `word` gives an enum's label."""
    assert {topic: len(messages) for topic, messages in found.items()} == {
        topic.name: run.topics[topic.name] for topic in TOPICS
    }
    for topic in CYCLE_TOPICS:
        for field in topic.fields:
            values = np.array([message[field.name] for message in found[topic.name]], dtype=field.numpy_code)
            np.testing.assert_array_equal(
                values, getattr(run.cycles, field.source), err_msg=f"{topic.name} {field.name}"
            )
    for name in ("/forecast", "/estimate"):
        series = run.series[name]
        for field in series.topic.fields:
            if field.choices is None:
                values = np.array([message[field.name] for message in found[name]], dtype=field.numpy_code)
                np.testing.assert_array_equal(values, series.columns[field.name], err_msg=field.name)
    words = [(word(message["continue_outcome"]), word(message["advice"])) for message in found["/forecast"]]
    codes = zip(*(run.series["/forecast"].columns[name] for name in ("continue_outcome", "advice")), strict=True)
    assert words == [(OUTCOME.labels[outcome], ADVICE.labels[advice]) for outcome, advice in codes]
    assert [int(message["identifier"]) for message in found["/can/frames"]] == [f.identifier for f in frames(run)]


def _rerun(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "rerun", "mcap", *arguments], capture_output=True, text=True, timeout=120, check=True
    )
    return done.stdout


def test_rerun_finds_nothing_wrong(recording: Run) -> None:
    said = _rerun("check", "--full", str(recording.path))
    rows = [line.split() for line in said.splitlines() if "/" in line and not line.startswith("/")]
    states = {row[3]: (row[0], row[-1]) for row in rows if len(row) >= 5 and row[3].startswith("/")}
    assert states == dict.fromkeys(EVERY_TOPIC, ("ok", "—"))


def test_rerun_decodes_every_topic(recording: Run, tmp_path: Path) -> None:
    target = tmp_path / "run.rrd"
    _rerun("convert", str(recording.path), "-o", str(target))
    found: dict[str, list[dict[str, Any]]] = defaultdict(list)
    drawn: dict[str, int] = defaultdict(int)
    for chunk in RrdReader(target).stream():
        if chunk.is_static or chunk.entity_path not in EVERY_TOPIC:
            continue
        batch = chunk.to_record_batch()
        if chunk.entity_path in WELL_KNOWN:
            drawn[chunk.entity_path] += batch.num_rows
            continue
        (name,) = [name for name in batch.schema.names if name.endswith(":message")]
        found[chunk.entity_path] += [row[0] for row in batch.column(name).to_pylist()]
    _check(recording, found, lambda value: value["name"])
    assert drawn == {topic: recording.topics[topic] for topic in WELL_KNOWN}


def test_foxgloves_own_libraries_decode_every_topic(recording: Run) -> None:
    modules, node = os.environ.get(NODE_MODULES), shutil.which("node")
    if modules is None or node is None:
        pytest.skip(f"{NODE_MODULES} names no node_modules folder; npm install @mcap/core @mcap/nodejs @mcap/support")
    script = Path(__file__).with_name("foxglove_reader.cjs")
    done = subprocess.run(
        [node, script, recording.path],
        capture_output=True,
        text=True,
        timeout=120,
        check=True,
        env={**os.environ, "NODE_PATH": modules},
    )
    said = json.loads(done.stdout)
    assert said["done"]
    assert said["streamed"] == sum(recording.topics.values())
    drawn = {topic: said["topics"].pop(topic) for topic in WELL_KNOWN}
    # JSON has no NaN: protobufjs writes null or "NaN".
    found = {
        topic: [{k: float("nan") if v in (None, "NaN") else v for k, v in message.items()} for message in messages]
        for topic, messages in said["topics"].items()
    }
    _check(recording, found, str)
    assert {topic: len(messages) for topic, messages in drawn.items()} == {
        topic: recording.topics[topic] for topic in WELL_KNOWN
    }
    assert [entry["message"] for entry in drawn["/events"]] == [event.message for event in recording.events]
    assert {pose["child_frame_id"] for pose in drawn["/tf"]} == {"table", "block_measured", "block_predicted"}


def test_what_foxglove_and_plotjuggler_ask_of_a_protobuf_channel(recording: Run) -> None:
    """Encodings "protobuf"; a FileDescriptorSet that holds everything it imports, imports first; proto3 scalars only.

    From Foxglove's documentation ("Custom schema encodings", "Message schemas") and the MCAP registry.
    """
    with recording.path.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    for channel in summary.channels.values():
        schema = summary.schemas[channel.schema_id]
        assert (channel.message_encoding, schema.encoding) == ("protobuf", "protobuf")
        expected = {topic.name: topic.schema_name for topic in TOPICS} | WELL_KNOWN
        assert schema.name == expected[channel.topic]
        known: set[str] = set()
        messages: dict[str, Any] = {}
        for described in FileDescriptorSet.FromString(schema.data).file:
            assert described.syntax == "proto3"
            assert set(described.dependency) <= known, f"{schema.name} imports what comes later or not at all"
            known.add(described.name)
            messages |= {f"{described.package}.{message.name}": message for message in described.message_type}
        assert schema.name in messages
        if not schema.name.startswith("foxglove."):
            (message,) = messages.values()
            assert not message.oneof_decl
            for field in message.field:
                assert not field.proto3_optional
                assert field.label == FieldDescriptorProto.LABEL_OPTIONAL
                assert field.type != FieldDescriptorProto.TYPE_GROUP
            for enum in message.enum_type:
                assert enum.value[0].number == 0
                assert len({value.name for value in enum.value}) == len(enum.value)


def test_the_index_says_what_is_there(recording: Run) -> None:
    """No empty topic; every chunk and every message of it indexed; times in their chunk's span; counts right."""
    with recording.path.open("rb") as file:
        summary = make_reader(file, validate_crcs=True).get_summary()
        assert summary is not None
        assert summary.statistics is not None
        counts = summary.statistics.channel_message_counts
        assert {summary.channels[number].topic: count for number, count in counts.items()} == dict(recording.topics)
        assert all(count > 0 for count in counts.values())
        by_channel: dict[int, int] = defaultdict(int)
        indices: list[ChunkIndex] = summary.chunk_indexes
        assert summary.statistics.chunk_count == len(indices)
        file.seek(0)
        records = list(StreamReader(file, emit_chunks=True, validate_crcs=True).records)
    chunks = [record for record in records if type(record).__name__ == "Chunk"]
    assert len(chunks) == len(indices)
    for record in records:
        if type(record).__name__ == "MessageIndex":
            by_channel[record.channel_id] += len(record.records)
    assert by_channel == counts
    data = recording.path.read_bytes()
    for chunk, index in zip(chunks, indices, strict=True):
        assert data[index.chunk_start_offset] == Opcode.CHUNK
        assert (chunk.message_start_time, chunk.message_end_time) == (index.message_start_time, index.message_end_time)
        assert index.message_start_time <= index.message_end_time
        for offset in index.message_index_offsets.values():
            assert data[offset] == Opcode.MESSAGE_INDEX
    # Chunks follow each other in time, so that viewers need not hold them all.
    assert all(a.message_end_time <= b.message_start_time for a, b in pairwise(indices))
