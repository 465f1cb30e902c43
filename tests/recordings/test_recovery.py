"""Damage in the middle: what follows it is found again, and what was lost is said."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from mcap.opcode import Opcode
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from mcap_protobuf.decoder import DecoderFactory

from recordings import RecordingError, cycle_blocks, decompression, read_run, recover, resync
from recordings.decompression import open_chunk
from recordings.descriptors import descriptor_set, message_class
from recordings.records import split
from recordings.schema import CYCLE_TOPICS
from tests.recordings.disk_faults import FullDisk
from tests.recordings.mutations import open_chunk_body
from twin.cli import main

if TYPE_CHECKING:
    from conftest import MakeRecords, WriteRun

    from recordings.run import Run
    from twin.cycle import CycleRecord


def _records(data: bytes) -> list[tuple[int, int, int]]:
    """(opcode, offset, end) of every record of a whole file."""
    found: list[tuple[int, int, int]] = []
    offset = 8
    while offset < len(data) - 8:
        opcode, length = struct.unpack_from("<BQ", data, offset)
        found.append((opcode, offset, offset + 9 + length))
        offset += 9 + length
    return found


def _chunks(data: bytes) -> list[tuple[int, int]]:
    return [(start, end) for opcode, start, end in _records(data) if opcode == Opcode.CHUNK]


def _kept(run: Run) -> set[int]:
    return {record.cycle for record in run.cycles}


def test_channels_are_defined_before_the_first_chunk_that_needs_them_and_in_it(write_run: WriteRun) -> None:
    """So that a damaged chunk hides no other; and readers that look into chunks alone find them too."""
    data = write_run().read_bytes()
    outside: set[int] = set()
    inside: set[int] = set()
    used: set[int] = set()
    for opcode, start, end in _records(data):
        body = data[start + 9 : end]
        if opcode == Opcode.CHANNEL:
            outside.add(int.from_bytes(body[:2], "little"))
        elif opcode == Opcode.CHUNK:
            messages, others = split(open_chunk_body(body))
            inside |= {int.from_bytes(part[:2], "little") for kind, part in others if kind == Opcode.CHANNEL}
            used |= set(messages.channels.tolist())
            assert used <= outside
            assert used <= inside
        elif opcode == Opcode.DATA_END:
            break
    assert len(used) == 10


@pytest.mark.parametrize("truncated", [False, True])
def test_a_damaged_first_chunk_costs_its_own_cycles_alone(write_run: WriteRun, truncated: bool) -> None:
    path = write_run()
    whole = read_run(path)
    data = bytearray(path.read_bytes())
    start, end = _chunks(bytes(data))[0]
    data[(start + end) // 2] ^= 0xFF
    path.write_bytes(data[: _chunks(bytes(data))[-1][1]] if truncated else data)
    run = read_run(path)
    # Ticked by the record's own time: the first chunk has one cycle, the next 50.
    assert _kept(whole) - _kept(run) == {0}
    assert "1 damaged chunks are left out, with 9 messages" in run.problems


def test_damage_to_a_definition_costs_nothing(write_run: WriteRun) -> None:
    path = write_run()
    original = path.read_bytes()
    whole = read_run(path)
    for opcode, start, end in _records(original):
        if opcode in (Opcode.SCHEMA, Opcode.CHANNEL):
            for place in (start, start + 1, start + 9, start + 20, (start + end) // 2):
                data = bytearray(original)
                data[place] ^= 0x41
                path.write_bytes(data)
                run = read_run(path)
                assert _kept(run) >= _kept(whole) - {0}, (opcode, start, place)
                assert run.problems or start > original.index(b"statistics"), place


def test_a_damaged_definition_never_leaves_a_field_out_quietly(write_run: WriteRun) -> None:
    """The number of a field is damaged where no checksum tells, and so is the end of the file: the first chunk does."""
    path = write_run()
    data = bytearray(path.read_bytes())
    whole = read_run(path)
    data[-30] ^= 0xFF
    place = data.index(b"statusword\x18\x03") + len(b"statusword")
    data[place] ^= 0x40
    path.write_bytes(data)
    run = read_run(path)
    assert not run.complete
    assert list(run.cycles) == list(whole.cycles)
    # Where the first chunk is damaged too, nothing is left that could be trusted.
    start, end = _chunks(bytes(data))[0]
    data[(start + end) // 2] ^= 0xFF
    path.write_bytes(data)
    with pytest.raises(RecordingError, match="in topic /table/measured: its descriptors are damaged"):
        read_run(path)


def test_a_wrong_length_anywhere_does_not_hide_the_chunks_behind_it(write_run: WriteRun) -> None:
    path = write_run()
    original = path.read_bytes()
    whole = read_run(path)
    chunks = _chunks(original)
    for opcode, start, _ in _records(original):
        if start > chunks[-1][0]:
            break
        for length in (0, 5, 2**20, 2**62):
            data = bytearray(original)
            data[start + 1 : start + 9] = struct.pack("<Q", length)
            path.write_bytes(data)
            run = read_run(path)
            lost = len(whole.cycles) - len(run.cycles)
            assert not run.complete, (opcode, start, length)
            assert lost <= (51 if opcode == Opcode.CHUNK else 0), (opcode, start, length)


def test_bytes_put_in_between_are_passed_over(write_run: WriteRun) -> None:
    path = write_run()
    original, whole = path.read_bytes(), read_run(path)
    start, _ = _chunks(original)[3]
    fake = struct.pack("<BQQQQII", Opcode.CHUNK, 2**40, 1, 2, 3, 4, 3) + b"lz4"
    path.write_bytes(original[:start] + fake * 20 + b"\x00" * 700 + original[start:])
    run = read_run(path)
    assert list(run.cycles) == list(whole.cycles)
    assert f"{len(fake) * 20 + 700} bytes in the middle of it are no records and are passed over" in run.problems


def test_blocks_are_the_cycles(tmp_path: Path, write_run: WriteRun, make_records: MakeRecords) -> None:
    path = write_run(count=9000)
    run = read_run(path)
    blocks = list(cycle_blocks(path))
    assert len(blocks) > 1
    assert [record for block in blocks for record in block] == list(run.cycles)
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    assert [record for block in cycle_blocks(cut) for record in block] == list(read_run(cut).cycles)
    cut.write_bytes(b"")
    with pytest.raises(RecordingError, match="is empty"):
        list(cycle_blocks(cut))


def _by_topic(path: Path, records: list[CycleRecord]) -> Path:
    """Write a recording topic by topic, as other tools sort it, in small chunks of Zstandard."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=2000, compression=CompressionType.ZSTD)
        writer.start()
        for topic in CYCLE_TOPICS:
            schema = writer.register_schema(topic.schema_name, "protobuf", descriptor_set(topic))
            channel = writer.register_channel(topic.name, "protobuf", schema)
            for record in records:
                message = message_class(topic)(**{f.name: getattr(record, f.source) for f in topic.fields})
                writer.add_message(channel, record.host_time_ns, message.SerializeToString(), 1, record.cycle)
        writer.finish()
    return path


def test_a_file_sorted_by_topic_reads_the_same(tmp_path: Path, make_records: MakeRecords) -> None:
    records = make_records(2000)[1:]
    path = _by_topic(tmp_path / "sorted.mcap", records)
    assert list(read_run(path).cycles) == records
    assert [record for block in cycle_blocks(path) for record in block] == records
    # Chunks of Zstandard are found again too.
    data = bytearray(path.read_bytes())
    start, _ = _chunks(bytes(data))[5]
    data[start + 1 : start + 9] = struct.pack("<Q", 2**62)
    path.write_bytes(data)
    assert 1900 < len(read_run(path).cycles) < 1999


# recover


def test_a_whole_file_is_recovered_message_by_message(write_run: WriteRun, tmp_path: Path) -> None:
    path = write_run()
    recovery = recover(path, tmp_path / "clean.mcap")
    assert recovery.complete
    assert (recovery.lost, recovery.cycles_lost, recovery.bytes_left, recovery.cut) == ({}, 0, 0, False)

    def everything(name: Path) -> list[object]:
        with name.open("rb") as file:
            reader = make_reader(file, validate_crcs=True)
            return [
                (channel.topic, channel.metadata, schema and schema.data, replace(message, channel_id=0))
                for schema, channel, message in reader.iter_messages(log_time_order=False)
            ]

    assert everything(recovery.out) == everything(path)
    clean, before = read_run(recovery.out), read_run(path)
    assert clean.complete
    assert list(clean.cycles) == list(before.cycles)
    assert (clean.events, clean.missed, clean.topics) == (before.events, before.missed, before.topics)
    assert {name: clean.metadata[name] for name in before.metadata} == before.metadata
    assert clean.metadata["recovery"]["from"] == "run.mcap"
    assert sum(recovery.written.values()) == sum(before.topics.values())


def test_what_was_lost_is_said(write_run: WriteRun, tmp_path: Path) -> None:
    path = write_run()
    whole = read_run(path)
    data = bytearray(path.read_bytes())
    for start, end in (_chunks(bytes(data))[2], _chunks(bytes(data))[4]):
        data[(start + end) // 2] ^= 0xFF
    path.write_bytes(data)
    recovery = recover(path, tmp_path / "clean.mcap")
    assert recovery.damaged_chunks == 2
    assert recovery.cycles_lost == len(whole.cycles) - recovery.cycles
    assert 60 < recovery.cycles_lost < 110
    assert recovery.duration_lost == pytest.approx(recovery.cycles_lost * 1e-3)
    assert {recovery.lost[topic.name] for topic in CYCLE_TOPICS} == {recovery.cycles_lost}
    written = {topic: count - recovery.lost.get(topic, 0) for topic, count in whole.topics.items()}
    assert {topic: count for topic, count in written.items() if count} == recovery.written
    # The same from the indices behind the chunks, where the file has no statistics.
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: data.index(b"statistics") - 13])
    again = recover(cut, tmp_path / "again.mcap")
    assert again.lost == recovery.lost
    assert again.cut


@pytest.mark.parametrize("share", [0.02, 0.1, 0.4, 0.8, 0.999])
def test_a_cut_file_becomes_a_clean_one(write_run: WriteRun, tmp_path: Path, share: float) -> None:
    path = write_run()
    path.write_bytes(path.read_bytes()[: int(path.stat().st_size * share)])
    cut = read_run(path)
    recovery = recover(path, tmp_path / "clean.mcap")
    assert not recovery.complete
    clean = read_run(recovery.out)
    assert clean.complete
    assert list(clean.cycles) == list(cut.cycles)
    with recovery.out.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert sum(1 for _ in reader.iter_decoded_messages()) == sum(recovery.written.values())


@pytest.mark.parametrize("room", [0, 300, 20_000])
def test_a_full_disk_is_one_sentence_about_the_new_file_and_leaves_none(
    write_run: WriteRun, tmp_path: Path, room: int
) -> None:
    out = tmp_path / "clean.mcap"
    with pytest.raises(RecordingError, match=r"clean\.mcap cannot be written: No space left on device"):
        recover(write_run(), out, disk=partial(FullDisk, room=room))
    assert not out.exists()


def test_a_file_cut_in_its_first_bytes_has_nothing_to_recover(write_run: WriteRun, tmp_path: Path) -> None:
    path = write_run()
    path.write_bytes(path.read_bytes()[:30])
    with pytest.raises(RecordingError, match=r"run\.mcap holds nothing that could be recovered"):
        recover(path, tmp_path / "clean.mcap")
    assert not (tmp_path / "clean.mcap").exists()


def test_topics_nobody_knows_are_recovered_too(tmp_path: Path, make_records: MakeRecords) -> None:
    path = tmp_path / "run.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        for topic in CYCLE_TOPICS:
            schema = writer.register_schema(topic.schema_name, "protobuf", descriptor_set(topic))
            channel = writer.register_channel(topic.name, "protobuf", schema)
            for record in make_records(3):
                message = message_class(topic)(**{f.name: getattr(record, f.source) for f in topic.fields})
                writer.add_message(channel, 5, message.SerializeToString(), 5, record.cycle)
        channel = writer.register_channel("/camera", "json", 0, {"lens": "wide"})
        writer.add_message(channel, 6, b"{}", 6)
        writer.add_attachment(0, 0, "photo.jpg", "image/jpeg", bytes(100))
        writer.finish()
    recovery = recover(path, tmp_path / "clean.mcap")
    assert recovery.problems == ("1 attachments are not copied",)
    with recovery.out.open("rb") as file:
        (found,) = [
            (schema, channel.metadata, message.data)
            for schema, channel, message in make_reader(file).iter_messages(topics=["/camera"])
        ]
    assert found == (None, {"lens": "wide"}, b"{}")


def test_the_command_says_it_in_words_and_as_json(
    write_run: WriteRun, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_run()
    monkeypatch.chdir(path.parent)
    assert main(["recover", "run.mcap"]) == 0
    assert "damage     none: the file was whole" in capsys.readouterr().out
    data = path.read_bytes()
    Path("cut.mcap").write_bytes(data[:-40])
    assert main(["recover", "cut.mcap"]) == 0
    assert "lost       nothing that was measured: only the end of the file" in capsys.readouterr().out
    start, end = _chunks(data)[2]
    Path("hit.mcap").write_bytes(data[: start + 60] + b"XXXX" + data[start + 64 : -6000])
    assert main(["recover", "hit.mcap", "--out", "clean.mcap", "--json"]) == 1
    said = json.loads(capsys.readouterr().out)
    assert said["cycles_lost"] > 0
    assert not said["nothing_lost"]
    assert said["out"] == "clean.mcap"
    assert main(["recover", "hit.mcap", "--out", "cleaner.mcap"]) == 1
    words = capsys.readouterr().out
    assert f"lost       {said['cycles_lost']} cycles among them" in words
    assert "lost       what came after" in words or not said["cut"]
    assert end > start


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["run.mcap", "--out", "run.mcap"], "run.mcap exists already and is not overwritten"),
        (["run.mcap", "--out", "clean.csv"], "clean.csv: a recording ends in .mcap"),
        (["run.mcap", "--out", "none/clean.mcap"], "none/clean.mcap cannot be written: No such file or directory"),
        (["none.mcap"], "none.mcap cannot be read: No such file or directory"),
        (["text.mcap"], "text.mcap is not an MCAP file"),
    ],
)
def test_what_cannot_be_recovered_is_one_sentence(
    write_run: WriteRun,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    sentence: str,
) -> None:
    path = write_run()
    monkeypatch.chdir(path.parent)
    Path("text.mcap").write_text("time_s,rotation_rad\n")
    assert main(["recover", *arguments]) == 2
    assert sentence in capsys.readouterr().err


def _looks_like_a_chunk(length: int) -> bytes:
    head = struct.pack("<BQQQQII", Opcode.CHUNK, length, 1, 2, 100, 99, 3)
    return head + b"lz4" + struct.pack("<Q", length - 28 - 4 - 3 - 8) + b"x" * 17


def test_a_file_full_of_what_looks_like_chunks_is_given_up(
    tmp_path: Path, write_run: WriteRun, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_run()
    data = path.read_bytes()
    tried: list[int] = []
    monkeypatch.setattr(
        resync,
        "open_chunk",
        lambda body, budget, proven: tried.append(len(body)) or open_chunk(body, budget, proven=proven),
    )
    monkeypatch.setattr(decompression, "FILE_ALLOWANCE", 0)
    start, end = _chunks(data)[2]
    fakes = _looks_like_a_chunk(60) * 20_000
    path.write_bytes(data[:start] + bytes(50) + fakes + data[start:end])
    # The first two chunks, which have cycles 0 to 50 without the gap.
    assert len(read_run(path).cycles) == 48
    # Each costs 4 KiB of forty times the file.
    assert len(tried) < 40 * path.stat().st_size / resync.LEAST_COST
    assert 5_000 < len(tried) < 20_000
    # Those that do not even agree with themselves cost nothing.
    tried.clear()
    fakes = _looks_like_a_chunk(60).replace(b"lz4", b"lz4?") * 20_000
    path.write_bytes(data[:start] + bytes(50) + fakes + data[start:])
    assert len(read_run(path).cycles) == len(read_run(write_run("whole.mcap")).cycles)
    assert len(tried) == 1
