"""The commands for what one does with a recording, as a user meets them: on the samples that ship."""

from __future__ import annotations

import contextlib
import json
import math
import os
import re
import select
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import psutil
import pytest

from devices.cia301.buses import CanBus, open_bus
from devices.errors import BusUnavailable
from recordings import read_run
from recordings.rewrite import Contents, own_metadata, write_recording
from recordings.run import Cycles
from recordings.samples import sample_names, sample_path
from recordings.viewer import Viewer
from tests.twin.conftest import perform_on, short_scene
from twin.cli import main
from twin.commands import replay_onto_bus
from twin.commands.recording import scene_in
from twin.live_loop import Ends

ROOT = Path(__file__).resolve().parents[3]


def said(arguments: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, object]:
    assert main([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(arguments) == 2
    text = capsys.readouterr().err.strip()
    assert "\n" not in text
    return text


def environment() -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT)}


def test_samples_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    found = said(["samples"], capsys)
    assert list(found) == sample_names()
    assert main(["samples"]) == 0
    assert "free rocking" in capsys.readouterr().out


@pytest.mark.parametrize("name", sample_names())
def test_samples_replay(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    found = said(["replay", name], capsys)
    assert found["agrees"] is True
    assert found["played"] == found["cycles"]


def test_replay_plays_a_sample_where_none_is_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay"]) == 0
    text = capsys.readouterr().out
    assert text.startswith(f"sample     {sample_names()[0]}: ")
    assert "rad of the recorded ones" in text or "bit for bit" in text


def test_a_twin_that_changed_is_reported(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    run = read_run(sample_path("free"))
    scene = json.loads(run.metadata["scene"]["json"])
    scene["block"]["height_mm"] = 270.001
    metadata = {**own_metadata(run.metadata), "scene": {"name": "free", "json": json.dumps(scene)}}
    path = tmp_path / "other.mcap"
    write_recording(Contents(metadata, run.geometry, run.cycles, run.events, run.missed), path)
    assert main(["replay", str(path)]) == 1
    text = capsys.readouterr().out
    assert "NOT" in text
    assert re.search(
        r"changed    most at [0-9.]+ s: [-+0-9.]+ rad then, [-+0-9.]+ rad now; rocked with a peak of", text
    )
    found = said(["replay", str(path)], capsys, code=1)
    assert 1e-9 < found["largest_change_rad"] < 1e-2


def test_a_what_if_beside_the_original(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "other.mcap"
    found = said(["replay", "free", "--set", "block.restitution=0.8", "--out", str(out)], capsys)
    before, after = found["before"], found["after"]
    assert isinstance(before, dict)
    assert isinstance(after, dict)
    assert len(before["impacts"]) > len(after["impacts"]) > 5
    assert found["largest_difference_rad"] > 0.01
    assert found["notes"] == []
    # What was written is a recording like any other: it replays to the bit, and compares with the original.
    again = said(["replay", str(out)], capsys)
    assert again["identical"] is True
    assert scene_in(read_run(out)).block.restitution == 0.8
    compared = said(["compare", "free", str(out)], capsys)
    assert compared["shift_s"] == 0.0
    assert compared["first"]["name"] == "free (predicted)"
    assert compared["rms_rad"] == pytest.approx(found["rms_rad"], rel=1e-6)


def test_a_what_if_that_moves_the_base_is_performed_by_the_emulator(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "other.mcap"
    changes = ["--set", "excitation.amplitude_g=0.45", "--set", "excitation.frequency_hz=3", "--set", "twin.futures=7"]
    found = said(["replay", "sine", *changes, "--out", str(out)], capsys)
    assert found["before"]["outcome"] == "rocked"
    assert found["after"]["outcome"] == "overturned"
    assert "because excitation.amplitude_g, excitation.frequency_hz moves the base otherwise" in found["base_motion"]
    assert found["notes"] == ["twin.futures: no prediction depends on that"]
    # The sample `fall` was made of that scene: the same emulator, the same code, the same bits.
    assert np.array_equal(read_run(out).cycles.acceleration, read_run(sample_path("fall")).cycles.acceleration)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ("block.restitutoin=0.9", "block.restitutoin is not a key here; did you mean restitution?"),
        ("blok.restitution=0.9", "blok is not a key here; did you mean block?"),
        ("block.restitution=1.5", "less than or equal to 1 (given: 1.5)"),
        ("block.width_mm.x=1", "width_mm is a value, not a table"),
        ("block.width_mm=wide", "should be a valid number"),
        ("excitation.amplitude_m_s2=3", "give amplitude_g or amplitude_m_s2, in one unit: both are given"),
        ("block=3", "should be an object"),
        ("nonsense", "is not KEY=VALUE, as in block.restitution=0.9"),
        ("block.width_mm=none", "block.width_mm is missing"),
    ],
)
def test_changes_that_are_none(change: str, sentence: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert sentence in refused(["replay", "sine", "--set", change], capsys)


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["replay", "sin"], "no sample of that name; did you mean sine?"),
        (["replay", "sine", "--speed", "0.01"], "--speed is 0.01; it must be 0.1 to 100"),
        (["replay", "sine", "--speed", "1000"], "--speed is 1000.0; it must be 0.1 to 100"),
        (["replay", "sine", "--out", "a.mcap"], "--out belongs to --set or --onto-emulator"),
        (["replay", "sine", "--set", "block.mass_kg=1", "--out", "a.csv"], "a recording ends in .mcap"),
        (["replay", "sine", "--channel", "can0"], "--channel and --bus-option belong to --to-bus"),
        (["replay", "sine", "--to-bus", "udp_multicast", "--onto-emulator"], "neither with --set nor with"),
        (["replay", "sine", "--to-bus", "virtual"], "ends at this process"),
        (["replay", "sine", "--to-bus", "socketcan", "--channel", "can0"], "may have a real table on it"),
        (["replay", "sine", "--to-bus", "udp_multicast", "--bus-option", "hop_limit=1"], "may have a real table on it"),
        (["compare", "sine", "none.mcap"], "none.mcap cannot be read"),
        (["compare", "sine", "--shift", "late"], "--shift is 'late'; it must be auto or a number"),
        (["compare", "sine", "--out", "a.xyz"], "a picture ends in .png, .svg or .pdf"),
        (["export", "sine", "--to", "csv", "--out", "a.mat"], "a csv file ends in .csv"),
        (["view", "sine", "--at", "1"], "--at belongs to --png"),
        (["view", "sine", "--follow", "--png", "a.png"], "it goes neither with --png"),
        (["view", "sine", "--map", "none.npz", "--out", "a.rrd"], "none.npz cannot be read"),
        (["import", "none.csv", "--map", "time=t[s]"], "none.csv cannot be read: no such file"),
        (["import", "none.csv", "--out", "a.csv"], "a recording ends in .mcap"),
        (["import", __file__], "say with --map which column is what"),
        (["import", __file__, "--map", "time=t[s] rotation=p[rad]"], "has no table"),
        (["import", __file__, "--map", "time=t[s] rotation=p[rad]", "--bandwidth", "0"], "--bandwidth is 0 Hz"),
        (["import", __file__, "--scene", "b6l_sin"], "did you mean b6l_sine?"),
    ],
)
def test_bad_input_is_one_sentence(
    arguments: list[str],
    sentence: str,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert sentence in refused(arguments, capsys)
    assert not list(tmp_path.iterdir())


def test_onto_the_emulator_it_measures_the_same_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "again.mcap"
    found = said(["replay", "sine", "--onto-emulator", "--out", str(out)], capsys)
    assert found["ended"] is None
    # The sample was recorded on that emulator, with that seed.
    assert found["identical"] == {"position": True, "acceleration": True, "rotation": True}
    assert said(["replay", str(out)], capsys)["identical"] is True


def test_onto_another_emulator_the_measured_values_lie_beside_the_recorded(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "again.mcap"
    change = ["--set", "table.specimen.restitution_change_percent=-20"]
    found = said(["replay", "free", "--onto-emulator", *change, "--out", str(out)], capsys)
    assert found["identical"]["acceleration"] is True
    assert found["differences"]["rotation"]["largest"] > 0.01
    one, two = read_run(sample_path("free")).cycles, read_run(out).cycles
    apart = np.abs(two.rotation - one.rotation)
    assert found["differences"]["rotation"]["largest"] == pytest.approx(float(np.max(apart)))


def test_a_run_that_was_stopped_is_stopped_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The drive's own ramp has no set-points: NaN in the recording, a quick stop on the emulator."""
    asked = iter([None] * 620 + [Ends("operator", "stop was asked")] * 10_000)
    scene = short_scene()
    report, kept = perform_on(scene, stopped=lambda: next(asked))
    assert report.tripped is not None
    cycles = Cycles.of(kept.cycles)
    assert np.isnan(cycles.target_position[-1])
    path = tmp_path / "stopped.mcap"
    metadata = {"scene": {"name": "short", "json": scene.model_dump_json()}}
    write_recording(Contents(metadata, None, cycles, tuple(kept.events), ()), path)
    found = said(["replay", str(path), "--onto-emulator"], capsys)
    assert found["ended"] is None
    assert found["cycles"] == len(cycles)
    assert found["identical"] == {"position": True, "acceleration": True, "rotation": True}


def test_onto_a_bus_other_tools_hear_it(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(replay_onto_bus, "LISTEN", 0.05)
    port = 45000 + os.getpid() % 1000
    options = ["--to-bus", "udp_multicast", "--bus-option", f"port={port}", "--speed", "20"]
    try:
        tool = open_bus("udp_multicast", port=port)
    except BusUnavailable as error:
        pytest.skip(str(error))
    with tool:
        found = said(["replay", "fall", *options], capsys)
        heard = 0
        while tool.receive(0.2) is not None:
            heard += 1
    assert found["whole"] is True
    # The receive buffer of a socket nobody reads from meanwhile is finite.
    assert 0 < heard <= found["frames"] == 5 * found["cycles"]
    monkeypatch.setattr(CanBus, "receive", lambda *_: (0x080, b"\x01"))
    assert "somebody else is talking on" in refused(["replay", "fall", *options], capsys)


def test_compare_draws_and_says(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "new" / "sine.png"
    assert main(["compare", "sine", "--out", str(picture)]) == 0
    text = capsys.readouterr().out
    assert "Housner's for this block: 0.9294" in text
    assert picture.stat().st_size > 20_000
    found = said(["compare", "sine"], capsys)
    # The emulated block is made with a restitution one percent lower.
    measured = found["first"]
    assert measured["restitution"] == pytest.approx(0.99 * 0.929411764, abs=4.0 * measured["restitution_error"])
    assert found["energy_unit"] == "J"


def test_export_and_import_give_the_same_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    table, back = tmp_path / "sine.csv", tmp_path / "back.mcap"
    assert len(said(["export", "sine", "--to", "csv", "--out", str(table)], capsys)["files"]) == 3
    mapping = "time=time_s[s] acceleration=acceleration_m_s2[m/s2] rotation=rotation_rad[rad]"
    found = said(["import", str(table), "--map", mapping, "--scene", "b6l_sine", "--out", str(back)], capsys)
    original, copy = read_run(sample_path("sine")), read_run(back)
    assert found["samples"] == len(original.cycles)
    assert np.array_equal(copy.cycles.rotation, original.cycles.rotation)
    # The same base motion on the same block: the same prediction, but for the rounding of the times.
    np.testing.assert_allclose(copy.cycles.predicted_rotation, original.cycles.predicted_rotation, atol=1e-9)
    assert said(["compare", "sine", str(back)], capsys)["rms_rad"] == pytest.approx(0.0, abs=1e-12)


def test_an_earthquake_record_becomes_a_recording(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    values = 0.3 * np.sin(25.0 * np.arange(200) * 0.01) * np.exp(-0.01 * np.arange(200))
    rows = "\n".join(" ".join(f"{value:.7E}" for value in row) for row in values.reshape(-1, 5))
    head = "PEER\nMADE UP, 1 JAN 2026\nACCELERATION TIME HISTORY IN UNITS OF G\n200 0.01 NPTS, DT\n"
    record, out = tmp_path / "quake.at2", tmp_path / "quake.mcap"
    record.write_text(head + rows)
    found = said(["import", str(record), "--scale", "1.5", "--out", str(out)], capsys)
    assert found["samples"] == 200
    run = read_run(out)
    np.testing.assert_allclose(run.cycles.acceleration, 1.5 * 9.81 * values, rtol=1e-6)
    assert math.isnan(run.cycles.rotation[0])
    assert scene_in(run).excitation.kind == "record"
    assert said(["replay", str(out)], capsys)["agrees"] is True
    assert "belong to tables" in refused(["import", str(record), "--map", "time=t[s]", "--out", "b.mcap"], capsys)


def test_keys_of_older_scenes_are_left_out_and_said(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    from dataclasses import replace

    run = read_run(sample_path("sine"))
    scene = json.loads(run.metadata["scene"]["json"])
    scene["twin"]["of_another_age"] = 3
    scene["excitation"]["colour"] = "blue"
    metadata = {**run.metadata, "scene": {"name": "old", "json": json.dumps(scene)}}
    assert scene_in(replace(run, metadata=metadata)).excitation.kind == "sine"
    note = capsys.readouterr().err
    assert "twin.of_another_age" in note
    assert "excitation.colour" in note


@pytest.fixture
def web(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[str], dict[str, object]]]:
    process = subprocess.Popen(
        [sys.executable, "-m", "twin.cli", "view", "fall", "--web", "--json"],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    assert process.stdout is not None
    line = process.stdout.readline()
    if not line:
        process.kill()
        pytest.fail(process.communicate()[1])
    try:
        yield process, json.loads(line)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.communicate()


@pytest.mark.skipif(sys.platform == "win32", reason="ends it by a signal")
def test_the_web_viewer_is_served_to_this_machine_only_and_ends_with_the_command(
    web: tuple[subprocess.Popen[str], dict[str, object]],
) -> None:
    import urllib.request

    process, found = web
    servers = psutil.Process(process.pid).children(recursive=True)
    bound = [c.laddr for server in servers for c in server.net_connections("inet") if c.status == psutil.CONN_LISTEN]
    assert len(bound) == 2
    assert {address.ip for address in bound} == {"127.0.0.1"}
    page = str(found["page"])
    assert int(page.split(":")[2].split("/")[0]) in {address.port for address in bound}
    with urllib.request.urlopen(page, timeout=10.0) as answer:  # noqa: S310 - our own server
        assert b"Rerun" in answer.read(2000)
    process.send_signal(signal.SIGINT)
    assert process.wait(30.0) == 0
    assert not [server for server in servers if server.is_running() and server.status() != psutil.STATUS_ZOMBIE]


def test_a_picture_of_the_window(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "new" / "fall.png"
    if main(["view", "fall", "--png", str(path), "--json"]) != 0:
        sentence = capsys.readouterr().err
        assert "the Rerun viewer finds no graphics driver; a software one is enough" in sentence
        pytest.skip(sentence)
    assert json.loads(capsys.readouterr().out)["png"] == str(path)
    data = path.read_bytes()
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert len(data) > 50_000
    assert "exists already and is not overwritten" in refused(["view", "fall", "--png", str(path)], capsys)


def test_no_graphics_driver_is_one_sentence(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from recordings import RecordingError, view_picture

    def fails(_: object = ()) -> Viewer:
        raise RecordingError("the Rerun viewer ended at once (exit code 1): is there a display?")

    monkeypatch.setattr(view_picture, "start_viewer", fails)
    assert "mesa-vulkan-drivers" in refused(["view", "fall", "--png", str(tmp_path / "a.png")], capsys)


def read_terminal(descriptor: int, wanted: str, limit: float) -> str:
    """Read a terminal's screen until `wanted` is in it."""
    text, end = "", time.monotonic() + limit
    while wanted not in text and time.monotonic() < end:
        if select.select([descriptor], [], [], 0.1)[0]:
            with contextlib.suppress(OSError):
                data = os.read(descriptor, 65536)
                if not data:
                    break
                text += data.decode("utf-8", "replace")
    assert wanted in text, text[-2000:]
    return text


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo terminals are POSIX's")
def test_a_replay_is_steered_by_keys_in_a_terminal() -> None:
    import pty
    import termios

    leader, terminal = pty.openpty()
    before = termios.tcgetattr(terminal)
    process = subprocess.Popen(
        [sys.executable, "-m", "twin.cli", "replay", "free", "--speed", "0.1"],
        stdin=terminal,
        stdout=terminal,
        stderr=terminal,
        env=environment(),
        start_new_session=True,
    )
    try:
        read_terminal(leader, "keys: space pauses", 60.0)
        read_terminal(leader, "x 0.1", 30.0)
        os.write(leader, b" ")
        os.write(leader, b"\x1b[C")
        first = read_terminal(leader, "paused", 30.0)
        os.write(leader, b"...")
        stepped = first + read_terminal(leader, "s   paused", 30.0)
        os.write(leader, b" ++++++++++")
        # At a hundred times its speed it is over at once.
        end = stepped + read_terminal(leader, "predicted  peak", 60.0)
        assert "checked    predictions" in end
        assert process.wait(30.0) == 0
        # The terminal is as it was: it shows what is typed, and waits for Return.
        assert termios.tcgetattr(terminal)[3] == before[3]
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait()
        os.close(leader)
        os.close(terminal)


@pytest.mark.skipif(sys.platform == "win32", reason="pseudo terminals are POSIX's")
def test_a_replay_is_quit_by_a_key_and_says_how_far_it_came() -> None:
    import pty

    leader, terminal = pty.openpty()
    process = subprocess.Popen(
        [sys.executable, "-m", "twin.cli", "replay", "free", "--speed", "0.1"],
        stdin=terminal,
        stdout=subprocess.PIPE,
        stderr=terminal,
        text=True,
        env=environment(),
        start_new_session=True,
    )
    try:
        read_terminal(leader, "x 0.1", 60.0)
        os.write(leader, b"q")
        out, _ = process.communicate(timeout=60.0)
        assert process.returncode == 0
        assert re.search(r"free\.mcap: [0-9]+ of [0-9]+ cycles", out)
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.kill()
        process.wait()
        os.close(leader)
        os.close(terminal)
