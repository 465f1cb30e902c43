"""The command line as a user meets it: exit codes, sentences, JSON; one real run, recorded, replayed and viewed."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from recordings.reader import read_run
from tests.twin.conftest import SHORT, SINE
from twin.cli import main

QUICK = SHORT.format(block="", excitation=SINE)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, object]]:
    """One run in real time by the command itself, in a process of its own: the recording and what `--json` said."""
    folder = tmp_path_factory.mktemp("run")
    (folder / "quick.toml").write_text(QUICK, encoding="utf-8")
    for attempt in range(5):
        done = twin(["run", "quick.toml", "--json", "--out", f"run{attempt}.mcap"], folder)
        if "SYNC lost" not in done.stdout:
            break
        # The machine stood still for 20 ms and the drive stopped itself, as it should: not what is tested here.
    assert done.returncode == 0, done.stdout + done.stderr
    return folder / f"run{attempt}.mcap", json.loads(done.stdout)


def twin(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-W", "error", "-m", "twin.cli", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        timeout=120,
        env=environment(),
    )


def environment() -> dict[str, str]:
    root = str(Path(__file__).resolve().parents[3])
    return {**os.environ, "PYTHONPATH": root}


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    """Run a command that must exit with 2 and one sentence on stderr; return the sentence."""
    try:
        code = main(arguments)
    except SystemExit as exit_by_parser:
        code = exit_by_parser.code
    assert code == 2
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    return said.err.strip()


def test_help_needs_nothing_heavy() -> None:
    heavy = ("numpy", "numba", "rerun", "scipy", "pydantic", "matplotlib", "can")
    code = f"import sys, twin.cli; twin.cli.parser().format_help(); print([n for n in {heavy!r} if n in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment(), check=True)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("command", ["scenes", "plan", "run", "emulate", "replay", "view"])
def test_every_command_has_help_and_exit_codes(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    assert ended.value.code == 0
    text = capsys.readouterr().out
    assert "--json" in text
    assert "exit codes" in text


def test_scenes(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["scenes", "--json"]) == 0
    assert "b6l_sine" in json.loads(capsys.readouterr().out)
    assert main(["scenes", "b6l_sine"]) == 0
    assert "width_mm = 60" in capsys.readouterr().out


def test_plan_says_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture = tmp_path / "new" / "plan.png"
    assert main(["plan", "b6l_cosine", "--out", str(picture)]) == 0
    assert "feasible as asked; the block rocks and stays up" in capsys.readouterr().out
    assert picture.stat().st_size > 10_000


@pytest.mark.parametrize(
    ("excitation", "code"),
    [
        ('kind = "sine"\namplitude_g = 0.3\nfrequency_hz = 4', 0),
        ('kind = "sine"\namplitude_g = 0.1\nfrequency_hz = 4', 0),
        ('kind = "sine"\namplitude_g = 0.45\nfrequency_hz = 3', 1),
        ('kind = "sine"\namplitude_g = 2.0\nfrequency_hz = 8', 1),
        ('kind = "double_pulse"\npeak_velocity_m_s = 0.1\nstop_gap_mm = 10', 1),
    ],
)
def test_plan_exit_codes(excitation: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(SHORT.format(block="", excitation=excitation), encoding="utf-8")
    assert main(["plan", str(path), "--json"]) == code
    data = json.loads(capsys.readouterr().out)
    assert (data["feasible_as_asked"] and data["stays_up"]) == (code == 0)


def test_the_run_says_what_it_came_to(recording: tuple[Path, dict[str, object]]) -> None:
    path, said = recording
    assert said["tripped"] is None
    assert said["recording_complete"] is True
    assert path.with_suffix(".rrd").stat().st_size > 10_000
    cycles = said["cycles"]
    assert isinstance(cycles, dict)
    run = read_run(path)
    assert run.complete
    assert len(run.cycles) == cycles["executed"]
    missed = sum(gap.last - gap.first + 1 for gap in run.missed)
    assert missed == cycles["missed"]
    numbers = set(run.cycles.cycle.tolist())
    gone = {number for gap in run.missed for number in range(gap.first, gap.last + 1)}
    assert not numbers & gone
    assert numbers | gone == set(range(len(numbers) + len(gone)))


def test_a_recording_explains_itself(recording: tuple[Path, dict[str, object]]) -> None:
    metadata = read_run(recording[0]).metadata
    assert {"scene", "clip", "capacity", "capacity_provenance", "versions", "processor", "result", "timing"} <= set(
        metadata
    )
    assert json.loads(metadata["scene"]["json"])["block"]["width_mm"] == 60
    assert "placeholder" in metadata["capacity_provenance"]["stroke"]
    assert metadata["versions"]["numba"]
    assert float(metadata["timing"]["lateness_p99_us"]) >= 0.0


def test_replay_is_bit_identical(recording: tuple[Path, dict[str, object]], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(recording[0]), "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["checked"] == "bits"
    assert data["identical"] is True
    assert data["largest_change_rad"] == 0.0
    assert main(["replay", str(recording[0]), "--speed", "100"]) == 0
    assert "identical to the recorded ones, bit for bit" in capsys.readouterr().out


def test_a_truncated_recording_replays_as_far_as_it_goes(
    recording: tuple[Path, dict[str, object]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cut = tmp_path / "cut.mcap"
    whole = recording[0].read_bytes()
    cut.write_bytes(whole[: len(whole) // 2])
    assert main(["replay", str(cut), "--json"]) == 0
    said = capsys.readouterr()
    data = json.loads(said.out)
    assert data["complete"] is False
    assert data["identical"] is True
    assert 0 < data["cycles"] < len(read_run(recording[0]).cycles)
    assert "note:" in said.err


def test_view_writes_a_rerun_file(
    recording: tuple[Path, dict[str, object]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = tmp_path / "view.rrd"
    assert main(["view", str(recording[0]), "--out", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["complete"] is True
    assert out.stat().st_size > 10_000


def test_view_does_not_overwrite(
    recording: tuple[Path, dict[str, object]], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = recording[0].read_bytes()
    assert "ends in .rrd" in refused(["view", str(recording[0]), "--out", str(recording[0])], capsys)
    assert recording[0].read_bytes() == before
    taken = tmp_path / "taken.rrd"
    taken.write_text("mine", encoding="utf-8")
    assert "exists already" in refused(["view", str(recording[0]), "--out", str(taken)], capsys)
    assert taken.read_text(encoding="utf-8") == "mine"


def test_run_does_not_overwrite(recording: tuple[Path, dict[str, object]], capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(["run", "b6l_free", "--out", str(recording[0])], capsys)
    assert "exists already" in said


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["plan", "nowhere"], "no scene named 'nowhere'"),
        (["plan", "no/where.toml"], "cannot read"),
        (["run", "nowhere"], "no scene named"),
        (["tune", "b6l_constant"], "air_track is set by hand and released"),
        (["run", "--device", "quanser_st4"], "did you mean quanser_st3"),
        (
            ["run", "--device", "quanser_st3", "--bus", "socketcan", "--channel", "can9", "--arm"],
            "confirmed at a terminal",
        ),
        (["run", "--bus", "socketcan"], "may have a real table on it"),
        (["run", "--bus-option", "bitrate"], "is not KEY=VALUE"),
        (["run", "--out", "run.rrd"], "a recording ends in .mcap"),
        (["emulate", "--bus", "virtual"], "ends at this process"),
        (["emulate", "--bus", "nosuchbus"], "cannot be opened here"),
        (["plan", "--record", "missing.at2"], "cannot read"),
        (["plan", "--scale", "2"], "--scale belongs to a record"),
        (["plan", "--record", "x.at2", "--scale", "nan"], "must be finite"),
        (["plan", "--out", "plan.xyz"], "a page ends in .pdf, .png, .svg or .html"),
        (["replay", "missing.mcap"], "cannot be read"),
        (["replay", __file__], "is not an MCAP file"),
        (["replay", __file__, "--speed", "0"], "--speed is 0.0"),
        (["replay", __file__, "--speed", "nan"], "--speed is nan"),
        (["view", "missing.mcap"], "cannot be read"),
        (["view", __file__], "is not an MCAP file"),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(arguments, capsys)
    assert words in said
    assert len(said.splitlines()) == 1


@pytest.mark.parametrize("command", [["run", "b6l_free", "--out"], ["plan", "--out"]])
def test_a_folder_that_cannot_be_written(
    command: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("in the way", encoding="utf-8")
    ending = "run.mcap" if command[0] == "run" else "plan.png"
    said = refused([*command, str(tmp_path / "file" / ending)], capsys)
    assert "cannot be written" in said


def test_a_recording_of_something_else(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from mcap.writer import Writer

    path = tmp_path / "other.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("other", "jsonschema", b"{}")
        channel = writer.register_channel("/other", "json", schema)
        writer.add_message(channel, 0, b"{}", 0)
        writer.finish()
    assert "no topic" in refused(["replay", str(path)], capsys)


posix = pytest.mark.skipif(sys.platform == "win32", reason="sends POSIX signals to a child")


def started(folder: Path, *arguments: str) -> tuple[subprocess.Popen[str], Path]:
    """Start a run and return it once its recording has begun to grow."""
    process = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "twin.cli",
            "run",
            "b6l_free",
            "--json",
            "--out",
            "stopped.mcap",
            "--no-rrd",
            *arguments,
        ],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    recording = folder / "stopped.mcap"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not recording.exists() or recording.stat().st_size < 60_000):
        time.sleep(0.05)
    return process, recording


@posix
@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_a_signal_is_a_controlled_stop(name: str, tmp_path: Path) -> None:
    process, recording = started(tmp_path)
    process.send_signal(getattr(signal, name))
    out, err = process.communicate(timeout=60)
    assert process.returncode == 1, err
    assert json.loads(out)["tripped"] == f"operator: stop was asked ({name})"
    run = read_run(recording)
    assert run.complete
    assert "trip" in [event.name for event in run.events]


def children(parent: int) -> list[int]:
    """Return the processes whose parent is `parent`: the fourth field of /proc/PID/stat, behind the bracketed name."""
    found: list[int] = []
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            fields = (folder / "stat").read_text().rpartition(")")[2].split()
            if int(fields[1]) == parent:
                found.append(int(folder.name))
    return found


def command_line(pid: int) -> str:
    return (Path("/proc") / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode()


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="finds the recorder's process in /proc")
def test_a_dead_recorder_stops_the_run(tmp_path: Path) -> None:
    process, recording = started(tmp_path)
    recorders = [pid for pid in children(process.pid) if "spawn_main" in command_line(pid)]
    assert recorders
    for pid in recorders:
        os.kill(pid, signal.SIGKILL)
    out, err = process.communicate(timeout=60)
    assert process.returncode == 1, err
    said = json.loads(out)
    assert said["tripped"].startswith("recorder: ")
    assert said["recording_complete"] is False
    # What was written before is there.
    assert len(read_run(recording).cycles) > 100


def test_ctrl_c_outside_the_cycle_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def interrupted(_: object) -> int:
        raise KeyboardInterrupt

    monkeypatch.setattr("twin.commands.plan.run", interrupted)
    assert main(["plan"]) == 130
    assert capsys.readouterr().err == "twin plan: interrupted\n"


def test_two_processes(tmp_path: Path) -> None:
    """`twin emulate` serves, `twin run` performs, over udp_multicast on this machine alone."""
    (tmp_path / "quick.toml").write_text(QUICK, encoding="utf-8")
    bus = ["--bus", "udp_multicast", "--bus-option", f"port={43000 + os.getpid() % 1000}"]
    server = subprocess.Popen(
        [sys.executable, "-m", "twin.cli", "emulate", "quick.toml", "--json", *bus],
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    try:
        assert server.stdout is not None
        if not server.stdout.readline():
            _, err = server.communicate(timeout=60)
            if "cannot be opened here" in err:
                pytest.skip(f"no multicast here: {err.strip()}")
            pytest.fail(err)
        for attempt in range(5):
            # After a stall of 20 ms the drive stops itself, as it should; the next run says that it knows.
            again = ["--reset"] if attempt else []
            out = ["--out", f"run{attempt}.mcap", "--no-rrd", *again]
            done = twin(["run", "quick.toml", "--json", *out, *bus], tmp_path)
            if done.returncode == 0:
                break
        assert done.returncode == 0, done.stdout + done.stderr
        said = json.loads(done.stdout)
        assert said["measured"]["outcome"] == said["predicted"]["outcome"] == "rocked"
    finally:
        server.terminate()
        server.communicate(timeout=60)
    assert server.returncode == (0 if sys.platform != "win32" else server.returncode)
