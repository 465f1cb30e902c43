"""What is read back is what was written, bit for bit, with our reader and with the plain libraries."""

from __future__ import annotations

import io
import math
import struct
import tempfile
from dataclasses import astuple, replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import NonSeekingReader, make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from recordings import Geometry, RecordingError, RunWriter, read_run
from recordings.descriptors import descriptor_set, message_class
from recordings.schema import CYCLE_TOPICS, EVENT_TIME, MISSED, WELL_KNOWN
from twin.cycle import CycleRecord, Event, Missed

if TYPE_CHECKING:
    from conftest import MakeRecords, WriteRun

NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
HOST = st.integers(0, 2**63 - 1)
WHOLE = st.integers(0, 2**40)
TEXT = st.text(st.characters(codec="utf-8"), max_size=30)
RECORDS = st.lists(
    st.builds(CycleRecord, WHOLE, st.floats(-1e9, 1e9), HOST, *[NUMBERS] * 7, status=st.integers(0, 2**32 - 1)),
    max_size=20,
    unique_by=lambda record: record.cycle % 2**32,
).map(lambda records: sorted(records, key=lambda record: record.cycle))
EVENTS = st.lists(
    st.builds(Event, NUMBERS, HOST, st.sampled_from(["info", "warning", "error"]), TEXT, TEXT), max_size=5
)


def _bits(value: object) -> list[bytes]:
    return [struct.pack("<d", item) if isinstance(item, float) else repr(item).encode() for item in astuple(value)]


@settings(max_examples=60, deadline=None)
@given(RECORDS, EVENTS, st.lists(st.builds(Missed, WHOLE, WHOLE, HOST), max_size=3))
def test_round_trip_is_bit_exact(records: list[CycleRecord], events: list[Event], missed: list[Missed]) -> None:
    metadata = {"scene": {"toml": "[block]\nwidth_mm = 60", "é": ""}}
    with tempfile.TemporaryDirectory() as folder:
        writer = RunWriter(Path(folder) / "run.mcap", metadata, Geometry(0.06, 0.27))
        for gap in missed:
            writer.missed(gap)
        for event in events:
            writer.event(event)
        for record in records:
            writer.cycle(record)
            writer.tick(record.time)
        writer.finish({"end": {"outcome": "ROCKED"}})
        run = read_run(writer.path)
    assert run.complete, run.problems
    assert [_bits(record) for record in run.cycles] == [_bits(record) for record in records]
    assert [_bits(event) for event in run.events] == [_bits(event) for event in events]
    assert list(run.missed) == missed
    assert run.metadata["scene"] == metadata["scene"]
    assert run.metadata["end"] == {"outcome": "ROCKED"}
    assert run.geometry == Geometry(0.06, 0.27)


def test_the_clocks_relation_is_fitted_over_the_run(tmp_path: Path, make_records: MakeRecords) -> None:
    """A host clock that runs 30 ppm fast and answers 40 to 90 us late, against numpy's least squares."""
    late = [40_000 + (k * 7919) % 50_000 for k in range(2000)]
    start = 1_760_000_000_123_456_789
    records = [
        replace(record, host_time_ns=start + late[k] + round(k * 1e6 * (1 + 30e-6)))
        for k, record in enumerate(make_records(2000))
    ]
    writer = RunWriter(tmp_path / "run.mcap", {})
    for record in records:
        writer.cycle(record)
        # An event's time is not that of its arrival, and must not count.
        writer.event(Event(record.time - 1.0, record.host_time_ns, "info", "phase", ""))
    writer.finish()
    run = read_run(writer.path)
    said = run.metadata["clock"]
    lag = (run.cycles.host_time_ns - start) * 1e-9 - run.cycles.time
    (drift, offset), (residual, *_) = np.polyfit(run.cycles.time, lag, 1, full=True)[:2]
    assert float(said["drift_ppm"]) == pytest.approx(drift * 1e6, abs=1e-3)
    assert float(said["drift_ppm"]) == pytest.approx(30.0, abs=2.0)
    assert int(said["fit_offset_ns"]) - start == pytest.approx(offset * 1e9, abs=2)
    assert float(said["residual_us"]) == pytest.approx(math.sqrt(residual / 2000) * 1e6, abs=1e-3)
    assert said["samples"] == "2000"
    assert int(said["origin_ns"]) == records[0].host_time_ns
    assert run.schema_version == (1, 1)


def test_counts_and_topics(write_run: WriteRun) -> None:
    run = read_run(write_run())
    assert len(run.cycles) == 297
    assert {run.topics[topic.name] for topic in CYCLE_TOPICS} == {297}
    assert (run.topics["/events"], run.topics["/cycle/missed"], run.topics["/scene"]) == (3, 1, 1)
    # 0.3 s at 50 Hz, three frames each.
    assert run.topics["/tf"] == 3 * 15
    assert len(run.cycles.between(10, 30)) == 20
    assert next(iter(run.cycles.between(10, 30))).cycle == 10


def test_a_plain_reader_decodes_every_message(write_run: WriteRun) -> None:
    path = write_run()
    run = read_run(path)
    found: dict[str, list[object]] = {}
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        for _, channel, _, message in reader.iter_decoded_messages():
            found.setdefault(channel.topic, []).append(message)
        metadata = [record.name for record in reader.iter_metadata()]
    assert {topic: len(messages) for topic, messages in found.items()} == run.topics
    assert [message.rotation_rad for message in found["/block/predicted"]] == run.cycles.predicted_rotation.tolist()
    assert [message.acceleration_m_s2 for message in found["/table/measured"]] == run.cycles.acceleration.tolist()
    assert found["/events"][2].message == "command minus feedback is 12 mm; the limit is 10 mm"
    assert metadata[:2] == ["schema", "geometry"]
    assert metadata[-1] == "statistics"


def test_publish_time_is_the_tables_clock_and_log_time_the_hosts(write_run: WriteRun) -> None:
    path = write_run()
    run = read_run(path)
    origin = int(run.metadata["clock"]["origin_ns"])
    with path.open("rb") as file:
        messages = [message for _, _, message in NonSeekingReader(file).iter_messages(topics="/cycle")]
    for message, record in zip(messages, run.cycles, strict=True):
        assert message.publish_time - origin == round(record.time * 1e9)
        assert message.log_time == record.host_time_ns
        assert message.sequence == record.cycle
    assert all(b.publish_time - a.publish_time in (1_000_000, 4_000_000) for a, b in pairwise(messages))


def test_a_file_of_another_protobuf_writer_reads_the_same(tmp_path: Path, make_records: MakeRecords) -> None:
    """Protobuf leaves zeros out and may add fields of a newer minor version: no fixed layout."""
    records = [replace(record, status=0, lateness=0.0) for record in make_records(5)]
    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic in CYCLE_TOPICS:
            schema = writer.register_schema(topic.schema_name, "protobuf", descriptor_set(topic))
            channel = writer.register_channel(topic.name, "protobuf", schema)
            for record in records:
                message = message_class(topic)(**{f.name: getattr(record, f.source) for f in topic.fields})
                newer = message.SerializeToString() + b"\x79" + struct.pack("<d", 1.0)
                writer.add_message(channel, record.host_time_ns, newer, 0, record.cycle)
        writer.finish()
    run = read_run(path)
    assert run.complete
    assert list(run.cycles) == records


def test_an_existing_file_is_not_overwritten_silently(write_run: WriteRun, tmp_path: Path) -> None:
    path = write_run()
    before = path.read_bytes()
    with pytest.raises(RecordingError, match="exists already and is not overwritten"):
        RunWriter(path, {})
    assert path.read_bytes() == before
    RunWriter(path, {}, overwrite=True).finish()
    assert path.read_bytes() != before


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(RecordingError, match=r"run\.mcap cannot be written: "):
        RunWriter(tmp_path / "file" / "run.mcap", {})


@pytest.mark.parametrize("name", ["schema", "clock", "geometry", "recorder"])
def test_own_metadata_names_are_reserved(tmp_path: Path, name: str) -> None:
    with pytest.raises(RecordingError, match=f"metadata name '{name}' is reserved"):
        RunWriter(tmp_path / "run.mcap", {name: {}})
    assert not list(tmp_path.iterdir())


def test_a_run_without_a_cycle_is_an_empty_run(tmp_path: Path) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {})
    writer.finish()
    writer.finish()
    run = read_run(writer.path)
    assert (len(run.cycles), run.events, run.missed, run.geometry) == (0, (), (), None)
    assert run.complete


def test_the_block_without_a_sensor_has_no_measured_pose(tmp_path: Path, make_records: MakeRecords) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {}, Geometry(0.06, 0.27))
    writer.cycle(replace(make_records(1)[0], rotation=math.nan))
    writer.finish()
    assert read_run(writer.path).topics["/tf"] == 2


def test_every_topic_describes_its_units(write_run: WriteRun) -> None:
    with write_run().open("rb") as file:
        summary = make_reader(io.BytesIO(file.read())).get_summary()
    assert summary is not None
    channels = {channel.topic: channel for channel in summary.channels.values()}
    assert set(channels) == {topic.name for topic in (*CYCLE_TOPICS, MISSED, EVENT_TIME)} | set(WELL_KNOWN)
    for topic in (*CYCLE_TOPICS, MISSED, EVENT_TIME):
        assert channels[topic.name].metadata == {f.name: f.words for f in topic.fields}
