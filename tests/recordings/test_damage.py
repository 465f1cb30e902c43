"""Whatever the bytes are: a run, or one sentence."""

from __future__ import annotations

import contextlib
import struct
import zlib
from collections import defaultdict
from typing import TYPE_CHECKING

import lz4.frame
import pytest
import zstandard
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.writer import MCAP0_MAGIC, Writer

from recordings import RecordingError, read_run
from recordings.decompression import DamagedChunkError, decompress
from recordings.descriptors import descriptor_set
from recordings.schema import CYCLE_TOPICS
from tests.recordings.fuzzing import fuzz
from tests.recordings.mutations import FORGED, HARMLESS

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from conftest import WriteRun


def test_a_truncated_file_still_opens(write_run: WriteRun, tmp_path: Path) -> None:
    whole = write_run()
    data, expected = whole.read_bytes(), list(read_run(whole).cycles)
    spread = range(8, len(data), 97)
    offsets = [*spread, *range(max(spread) + 1, len(data))]
    cut, last = tmp_path / "cut.mcap", 0
    for offset in offsets:
        cut.write_bytes(data[:offset])
        run = read_run(cut)
        got = list(run.cycles)
        assert not run.complete
        assert run.problems
        assert got == expected[: len(got)], offset
        assert len(got) >= last
        last = len(got)
    assert last == len(expected)


def test_a_cut_loses_no_more_than_the_open_chunk(write_run: WriteRun, tmp_path: Path) -> None:
    # Ticked by the record's own time, a chunk is closed every 0.05 s: 50 cycles.
    data = write_run().read_bytes()
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: data.index(b"statistics")])
    assert len(read_run(cut).cycles) == 297


def test_a_damaged_chunk_is_left_out_and_said(write_run: WriteRun) -> None:
    path = write_run()
    data = bytearray(path.read_bytes())
    middle = len(data) // 3
    data[middle] ^= 0x40
    path.write_bytes(data)
    run = read_run(path)
    assert not run.complete
    whole = {record.cycle for record in run.cycles}
    assert 0 < len(whole) < 297 or any("checksum" in problem for problem in run.problems)


def _flip(data: bytearray, place: int, value: int) -> None:
    data[place % len(data)] = value


def _lie(data: bytearray, place: int, value: int) -> None:
    data[place % len(data) :][:8] = struct.pack("<Q", value << 24)
    place %= max(len(data) - 8, 1)
    data[place : place + 8] = struct.pack("<Q", value << 24)


def test_fuzzed_files_give_a_run_or_a_sentence(write_run: WriteRun) -> None:
    path = write_run(count=120)
    original = path.read_bytes()
    fuzzed = path.with_name("fuzzed.mcap")

    @settings(max_examples=250, deadline=None)
    @given(
        st.lists(
            st.tuples(st.sampled_from([_flip, _lie]), st.integers(0, len(original) - 1), st.integers(0, 255)),
            min_size=1,
            max_size=6,
        )
    )
    def fuzz(changes: list[tuple[Callable[[bytearray, int, int], None], int, int]]) -> None:
        data = bytearray(original)
        for change, place, value in changes:
            change(data, place, value)
        fuzzed.write_bytes(data)
        with contextlib.suppress(RecordingError):
            assert len(list(read_run(fuzzed).cycles)) <= 120

    fuzz()


@settings(max_examples=100, deadline=None)
@given(tail=st.binary(max_size=400))
def test_random_bytes_after_the_magic(tmp_path_factory: pytest.TempPathFactory, tail: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "random.mcap"
    path.write_bytes(MCAP0_MAGIC + tail)
    assert not read_run(path).complete


@pytest.mark.parametrize(
    ("content", "sentence"),
    [(b"", "is empty"), (b"time,rotation\n0,0\n", "is not an MCAP file"), (MCAP0_MAGIC[:5], "is not an MCAP file")],
)
def test_files_that_are_no_recording(tmp_path: Path, content: bytes, sentence: str) -> None:
    path = tmp_path / "no.mcap"
    path.write_bytes(content)
    with pytest.raises(RecordingError, match=sentence):
        read_run(path)


def test_files_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"none\.mcap cannot be read: No such file"):
        read_run(tmp_path / "none.mcap")
    with pytest.raises(RecordingError, match="cannot be read"):
        read_run(tmp_path)


def _foreign(path: Path, topics: list[tuple[str, str, str]], metadata: dict[str, str] | None = None) -> Path:
    descriptors = defaultdict(bytes, {topic.schema_name: descriptor_set(topic) for topic in CYCLE_TOPICS})
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        if metadata is not None:
            writer.add_metadata("schema", metadata)
        for topic, schema_name, encoding in topics:
            schema = writer.register_schema(schema_name, encoding, descriptors[schema_name])
            writer.add_message(writer.register_channel(topic, encoding, schema), 1, b"{}", 1)
        writer.finish()
    return path


def test_a_missing_topic_is_named(tmp_path: Path) -> None:
    topics = [(topic.name, topic.schema_name, "protobuf") for topic in CYCLE_TOPICS if topic.name != "/block/predicted"]
    with pytest.raises(RecordingError, match="has no topic /block/predicted"):
        read_run(_foreign(tmp_path / "run.mcap", topics))
    with pytest.raises(RecordingError, match="has no topic /table/target"):
        read_run(_foreign(tmp_path / "other.mcap", [("/camera", "Image", "protobuf")]))


def test_another_message_in_a_topic_is_named(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"has 'Image' in topic /cycle, not 'shake_table_twin\.Cycle' in protobuf"):
        read_run(_foreign(tmp_path / "a.mcap", [("/cycle", "Image", "protobuf")]))
    with pytest.raises(RecordingError, match="in topic /cycle"):
        read_run(_foreign(tmp_path / "b.mcap", [("/cycle", "shake_table_twin.Cycle", "jsonschema")]))


def test_a_newer_major_version_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="has schema version 2; this version of shake-table-twin reads up to 1"):
        read_run(_foreign(tmp_path / "run.mcap", [], {"major": "2", "minor": "0"}))


def test_messages_that_do_not_decode_are_counted(tmp_path: Path) -> None:
    topics = [(topic.name, topic.schema_name, "protobuf") for topic in CYCLE_TOPICS]
    run = read_run(_foreign(tmp_path / "run.mcap", topics, {"major": "1"}))
    assert len(run.cycles) == 0
    assert run.problems == ("5 messages cannot be decoded and are left out",)


def test_bombs_do_not_go_off() -> None:
    zeros = bytes(8_000_000)
    for compression, bomb in (("zstd", zstandard.compress(zeros)), ("lz4", lz4.frame.compress(zeros))):
        for declared in (100, 200_000, 8_000_000, 2**63):
            with pytest.raises(DamagedChunkError):
                decompress(compression, bomb[:20_000], declared, 0)


@pytest.mark.parametrize("compression", ["lz4", "zstd", ""])
def test_honest_chunks_decompress(compression: str) -> None:
    plain = bytes(range(256)) * 40
    data = {"lz4": lz4.frame.compress, "zstd": zstandard.compress, "": bytes}[compression](plain)
    assert decompress(compression, data, len(plain), zlib.crc32(plain)) == plain
    with pytest.raises(DamagedChunkError, match="wrong checksum"):
        decompress(compression, data, len(plain), 1)
    with pytest.raises(DamagedChunkError):
        decompress(compression, data[:-7], len(plain), 0)


def test_unknown_compression() -> None:
    with pytest.raises(DamagedChunkError, match="unknown compression 'rar'"):
        decompress("rar", b"abc", 3, 0)


@pytest.mark.parametrize("seed", [1, 2])
def test_mutated_files_give_a_run_or_a_sentence_and_nothing_made_up(seed: int) -> None:
    """The benchmark fuzz_recordings.py does the same a hundred thousand times."""
    result = fuzz(220, seed)
    assert result.opened["cut"] == result.files["cut"] == 20
    assert result.recovered["cut"] == result.written["cut"] > 0
    for kind in ("lie of length", "splice", "bomb", "hostile metadata"):
        assert result.recovered[kind] >= 0.9 * result.written[kind], "\n".join(result.lines())
    assert result.recovered["flip"] >= 0.5 * result.written["flip"]


@pytest.mark.parametrize("kind", [*HARMLESS, *FORGED])
def test_any_seed_of_a_mutation(kind: str) -> None:
    @settings(max_examples=15, deadline=None)
    @given(st.integers(0, 2**32))
    def mutate(seed: int) -> None:
        fuzz(1, seed, [kind], cycles=12)

    mutate()
