"""Topics a run may have: forecast, estimate, CAN frames; and topics and fields of other versions."""

from __future__ import annotations

import math
import struct
from dataclasses import astuple, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, get_args

import numpy as np
import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.writer import Writer
from mcap_protobuf.decoder import DecoderFactory

from recordings import Recorder, RecordingError, RunWriter, read_run
from recordings.can_export import export_can
from recordings.can_traffic import CanTap, frames
from recordings.consumer import pack_cycle, pack_frame, unpack
from recordings.descriptors import descriptor_set, message_class
from recordings.schema import CYCLE, CYCLE_TOPICS, ESTIMATE, FORECAST
from twin.cycle import Advice, CanFrame, CycleRecord, Estimated, Forecasted, Outlook

if TYPE_CHECKING:
    from conftest import MakeRecords

NUMBERS = st.floats(allow_nan=True, allow_infinity=True)
OUTLOOKS, ADVICES = st.sampled_from(get_args(Outlook)), st.sampled_from(get_args(Advice))
FORECASTS = st.builds(
    Forecasted, OUTLOOKS, NUMBERS, NUMBERS, NUMBERS, OUTLOOKS, NUMBERS, NUMBERS, NUMBERS, ADVICES, NUMBERS,
    st.integers(0, 2**32 - 1), NUMBERS, NUMBERS, NUMBERS, NUMBERS,
)  # fmt: skip
ESTIMATES = st.builds(Estimated, *[NUMBERS] * 7)
FORECAST_SEEN = Forecasted(
    "rocked", 0.4, 0.03, math.nan, "overturned", -0.1, 1.0, 0.61, "stopping would topple it", 0.002, 32
)
ESTIMATE_SEEN = Estimated(0.1, -0.2, 0.931, 0.004)
FRAMES = [
    CanFrame(1_760_000_000_000_000_500, 0x080, b"\x01", True),
    CanFrame(1_760_000_000_000_100_000, 0x181, bytes.fromhex("3712efbeadde"), False),
    CanFrame(1_760_000_000_000_200_000, 0x7FF, b"", False),
    CanFrame(1_760_000_000_000_300_000, 0x201, bytes(range(248, 256)), True),
]


class Keeps:
    """A sink for everything."""

    def __init__(self) -> None:
        self.values: list[Any] = []
        self.cycle = self.missed = self.event = self.frame = self.values.append


def _bits(value: Any) -> list[Any]:
    return [struct.pack("<d", item) if isinstance(item, float) else item for item in astuple(value)]


@settings(max_examples=60, deadline=None)
@given(st.lists(st.tuples(st.none() | FORECASTS, st.none() | ESTIMATES), max_size=6))
def test_forecast_and_estimate_go_through_the_pipe_bit_for_bit(
    parts: list[tuple[Forecasted | None, Estimated | None]],
) -> None:
    records = [
        CycleRecord(k, k * 1e-3, 1_760_000_000_000_000_000, *[0.1 * k] * 7, 0x1237, forecast, estimate)
        for k, (forecast, estimate) in enumerate(parts)
    ]
    sink = Keeps()
    assert unpack(b"".join(map(pack_cycle, records)), sink) == len(records)
    for sent, got in zip(records, sink.values, strict=True):
        assert replace(got, forecast=None, estimate=None) == replace(sent, forecast=None, estimate=None)
        for name in ("forecast", "estimate"):
            before, after = getattr(sent, name), getattr(got, name)
            assert type(before) is type(after)
            assert before is None or _bits(before) == _bits(after)


def test_a_word_nobody_knows_is_refused_by_the_recorder_not_by_the_run(
    tmp_path: Path, make_records: MakeRecords
) -> None:
    record = make_records(1)[0]
    wrong = replace(FORECAST_SEEN, advice="hope")  # pyright: ignore[reportArgumentType]
    with Recorder(tmp_path / "run.mcap", {}) as recorder:
        recorder.cycle(replace(record, forecast=wrong))
        recorder.frame(CanFrame(0, 0x80, bytes(9), True))
        recorder.cycle(record)
    report = recorder.finish()
    assert (report.written, report.refused) == (1, 2)


def test_forecasts_estimates_and_frames_are_in_the_file_where_they_were_given(
    tmp_path: Path, make_records: MakeRecords
) -> None:
    records = make_records(40)
    for k in range(0, 40, 4):
        records[k] = replace(records[k], forecast=replace(FORECAST_SEEN, age=k * 1e-3))
    for k in range(10, 20):
        records[k] = replace(records[k], estimate=replace(ESTIMATE_SEEN, rotation=0.01 * k))
    recorder = Recorder(tmp_path / "run.mcap", {})
    for record in records:
        recorder.cycle(record)
    for frame in FRAMES:
        recorder.frame(frame)
    report = recorder.finish()
    assert (report.written, report.complete) == (44, True)
    run = read_run(report.path)
    assert run.complete, run.problems
    assert run.unknown == ()
    forecast, estimate = run.series["/forecast"], run.series["/estimate"]
    assert forecast.sequence.tolist() == list(range(0, 40, 4))
    assert forecast.host_time_ns.tolist() == [records[k].host_time_ns for k in range(0, 40, 4)]
    origin = int(run.metadata["clock"]["origin_ns"])
    assert forecast.table_time_ns.tolist() == [origin + k * 1_000_000 for k in range(0, 40, 4)]
    assert forecast.columns["age_s"].tolist() == [k * 1e-3 for k in range(0, 40, 4)]
    assert set(forecast.columns["advice"].tolist()) == {3}
    assert np.all(np.isnan(forecast.columns["continue_overturning_s"]))
    assert [field.name for field in forecast.topic.fields] == list(forecast.columns)
    assert estimate.columns["rotation_rad"].tolist() == [0.01 * k for k in range(10, 20)]
    assert list(frames(run)) == FRAMES
    assert len(run.series["/can/frames"]) == 4
    assert [record.cycle for record in run.cycles] == list(range(40))


def test_a_plain_reader_sees_words_and_frames(tmp_path: Path, make_records: MakeRecords) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {})
    writer.cycle(replace(make_records(1)[0], forecast=FORECAST_SEEN, estimate=ESTIMATE_SEEN))
    writer.frame(FRAMES[1])
    writer.finish()
    with writer.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        found = {channel.topic: message for _, channel, _, message in reader.iter_decoded_messages()}
    seen = found["/forecast"]
    names = seen.DESCRIPTOR.fields_by_name["advice"].enum_type.values_by_number
    assert names[seen.advice].name == "ADVICE_STOPPING_WOULD_TOPPLE_IT"
    assert (seen.continue_margin, seen.futures) == (0.4, 32)
    assert found["/estimate"].restitution == 0.931
    frame = found["/can/frames"]
    assert (frame.identifier, frame.length, frame.data) == (0x181, 6, 0xDEADBEEF1237)


def test_a_run_without_them_has_no_such_topics(tmp_path: Path, make_records: MakeRecords) -> None:
    writer = RunWriter(tmp_path / "run.mcap", {})
    writer.cycle(make_records(1)[0])
    writer.finish()
    run = read_run(writer.path)
    assert run.series == {}
    assert not {"/forecast", "/estimate", "/can/frames"} & set(run.topics)
    assert list(frames(run)) == []
    with pytest.raises(RecordingError, match=r"run\.mcap has no CAN traffic"):
        export_can(run, tmp_path / "traffic.blf")


def test_a_tap_hands_frames_on_and_they_leave_as_blf(tmp_path: Path, make_records: MakeRecords) -> None:
    can = pytest.importorskip("can")
    writer = RunWriter(tmp_path / "run.mcap", {})
    writer.cycle(make_records(1)[0])
    tap = CanTap(writer)
    for frame in FRAMES:
        tap(frame.host_time_ns * 1e-9, frame.identifier, frame.data, frame.sent)
    writer.finish()
    run = read_run(writer.path)
    assert export_can(run, tmp_path / "traffic.blf") == 4
    with can.LogReader(tmp_path / "traffic.blf") as log:
        read = [(message.arbitration_id, bytes(message.data), not message.is_rx) for message in log]
    assert read == [(frame.identifier, frame.data, frame.sent) for frame in FRAMES]
    with pytest.raises(RecordingError, match="exists already"):
        export_can(run, tmp_path / "traffic.blf")


def test_frames_give_way_to_cycles_where_the_queue_is_full(tmp_path: Path, make_records: MakeRecords) -> None:
    with Recorder(tmp_path / "run.mcap", {}, bound=1) as recorder:
        recorder.frame(FRAMES[0])
        recorder.cycle(make_records(1)[0])
    report = recorder.finish()
    assert (report.written, report.dropped) == (1, 1)


def test_a_packed_frame_is_what_it_was() -> None:
    sink = Keeps()
    assert unpack(b"".join(map(pack_frame, FRAMES)), sink) == 4
    assert sink.values == FRAMES


# Other versions


def _write(path: Path, records: list[CycleRecord], changed: dict[str, bytes], tail: dict[str, bytes]) -> None:
    """Write as another version would: descriptors of `changed` topics, and `tail` behind each of their messages."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        writer.add_metadata("schema", {"major": "1", "minor": "9"})
        for topic in CYCLE_TOPICS:
            schema = writer.register_schema(
                topic.schema_name, "protobuf", changed.get(topic.name, descriptor_set(topic))
            )
            channel = writer.register_channel(topic.name, "protobuf", schema)
            for record in records:
                message = message_class(topic)(**{f.name: getattr(record, f.source) for f in topic.fields})
                data = message.SerializeToString() + tail.get(topic.name, b"")
                writer.add_message(channel, record.host_time_ns, data, record.host_time_ns, record.cycle)
        schema = writer.register_schema("shake_table_twin.Trip", "protobuf", b"\xff")
        writer.add_message(writer.register_channel("/trips", "protobuf", schema), 1, b"\x01", 1)
        writer.finish()


def test_a_newer_minor_version_reads_and_what_is_unknown_is_listed(tmp_path: Path, make_records: MakeRecords) -> None:
    files = FileDescriptorSet.FromString(descriptor_set(CYCLE))
    fields = files.file[0].message_type[0].field
    fields.add(name="work_s", number=4, type=fields[1].type, label=fields[1].label)
    records = make_records(5)[1:]
    tail = b"\x21" + struct.pack("<d", 1e-4)
    _write(tmp_path / "run.mcap", records, {"/cycle": files.SerializeToString()}, {"/cycle": tail})
    run = read_run(tmp_path / "run.mcap")
    assert run.complete, run.problems
    assert list(run.cycles) == records
    assert run.unknown == ("/trips",)
    assert run.topics["/trips"] == 1


def test_a_field_that_an_older_minor_version_lacks_is_nan(tmp_path: Path, make_records: MakeRecords) -> None:
    files = FileDescriptorSet.FromString(descriptor_set(CYCLE))
    del files.file[0].message_type[0].field[2]
    # What an older writer would not have written is cut off: key and value of the last field.
    records = [replace(record, lateness=0.0) for record in make_records(5)[1:]]
    _write(tmp_path / "run.mcap", records, {"/cycle": files.SerializeToString()}, {})
    run = read_run(tmp_path / "run.mcap")
    assert run.complete, run.problems
    assert np.all(np.isnan(run.cycles.lateness))
    assert run.cycles.time.tolist() == [record.time for record in records]


def test_an_optional_topic_with_another_message_is_left_out_and_said(tmp_path: Path, make_records: MakeRecords) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic in (*CYCLE_TOPICS, FORECAST):
            schema = writer.register_schema(
                topic.schema_name, "protobuf", descriptor_set(ESTIMATE if topic is FORECAST else topic)
            )
            channel = writer.register_channel(topic.name, "protobuf", schema)
            for record in make_records(2):
                values = {f.name: getattr(record, f.source) for f in topic.fields} if topic.required else {}
                writer.add_message(channel, 1, message_class(topic)(**values).SerializeToString(), 1, record.cycle)
        writer.finish()
    run = read_run(path)
    assert len(run.cycles) == 2
    assert len(run.problems) == 1
    assert "has another shake_table_twin.Forecast in topic /forecast" in run.problems[0]
    assert run.series == {}
