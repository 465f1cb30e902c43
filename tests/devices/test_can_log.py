"""CAN frames written for other tools, read again by python-can's readers."""

from __future__ import annotations

from pathlib import Path

import can
import pytest

from devices.can_log import KINDS, LoggedFrame, write_can_log
from devices.errors import LogFileError

START = 1_760_000_000.0
FRAMES = [
    LoggedFrame(START + 0.002, 0x181, bytes.fromhex("37120001"), False),
    LoggedFrame(START, 0x080, b"\x01", True),
    LoggedFrame(START + 0.001, 0x7FF, bytes(range(8)), True),
    LoggedFrame(START + 0.003, 0x281, b"", False),
]


@pytest.mark.parametrize("kind", KINDS)
def test_what_is_written_is_read_again(tmp_path: Path, kind: str) -> None:
    path = tmp_path / f"traffic{kind}"
    assert write_can_log(path, iter(FRAMES)) == 4
    with can.LogReader(path) as reader:
        read = list(reader)
    ordered = sorted(FRAMES)
    assert [message.arbitration_id for message in read] == [frame.identifier for frame in ordered]
    assert [bytes(message.data) for message in read] == [frame.data for frame in ordered]
    assert not any(message.is_extended_id or message.is_remote_frame or message.is_error_frame for message in read)
    assert [message.is_rx for message in read] == [not frame.sent for frame in ordered]
    steps = [message.timestamp - read[0].timestamp for message in read]
    assert steps == pytest.approx([0.0, 0.001, 0.002, 0.003], abs=2e-6)
    if kind != ".asc":
        assert read[0].timestamp == pytest.approx(START, abs=1e-3)


@pytest.mark.parametrize(
    ("name", "frames", "sentence"),
    [
        ("traffic.csv", [], "traffic.csv is no CAN log; its name must end in .blf, .asc, .log"),
        ("there.blf", [], "there.blf exists already and is not overwritten"),
        ("none/traffic.blf", [], "No such file or directory"),
        ("traffic.blf", [LoggedFrame(START, 0x800, b"", True)], "traffic.blf cannot be written: "),
        ("traffic.blf", [LoggedFrame(START, 0x80, bytes(9), True)], "traffic.blf cannot be written: "),
    ],
)
def test_what_cannot_be_written_is_one_sentence(
    tmp_path: Path, name: str, frames: list[LoggedFrame], sentence: str
) -> None:
    (tmp_path / "there.blf").write_bytes(b"precious")
    with pytest.raises(LogFileError, match=sentence):
        write_can_log(tmp_path / name, frames)
    assert (tmp_path / "there.blf").read_bytes() == b"precious"
    assert [path.name for path in tmp_path.iterdir()] == ["there.blf"]
