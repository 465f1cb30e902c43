"""A campaign on the emulated table: one run after another, a stop between, resumed where it stopped."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.twin.conftest import SHORT
from twin.cli import main

# In simulated time, without forecast and viewer: over in a second or two of processor time.
FAST = ["--fast", "--no-rrd"]
SCENE = SHORT.replace("[twin]", "[twin]\nforecast = false\ncycle_hz = 250")
STAYS = 'kind = "sine"\namplitude_g = 0.1\nfrequency_hz = 4'
FALLS = '[run.excitation]\nkind = "sine"\namplitude_g = 0.5\nfrequency_hz = 3.5\n'


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "stays.toml").write_text(SCENE.format(block="", excitation=STAYS), encoding="utf-8")
    return tmp_path


def write(text: str) -> None:
    Path("all.toml").write_text(text, encoding="utf-8")


def run(*options: str, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, object]]:
    code = main(["run", "all.toml", *FAST, "--json", *options])
    said = capsys.readouterr()
    assert "Traceback" not in said.err
    return code, json.loads(said.out) if said.out else {"error": said.err}


def test_runs_one_by_one_and_goes_on_where_it_stopped(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [50, 100]\n[[run]]\nname = "../one"\n')
    # Not a terminal: nobody can be asked, and each call makes one run.
    code, said = run(capsys=capsys)
    assert (code, said["done"], said["runs"]) == (1, 1, 2)
    assert "no terminal" in str(said["ended"])
    code, said = run(capsys=capsys)
    assert (code, said["done"], said["ended"]) == (0, 2, None)
    code, said = run(capsys=capsys)
    assert (code, said["done"]) == (0, 2)
    recordings = sorted(path.name for path in Path("runs/all").glob("*.mcap"))
    assert [name.rpartition("-")[0] for name in recordings] == ["001-one-50pct", "002-one-100pct"]
    assert {path.name for path in Path().iterdir()} == {"stays.toml", "all.toml", "runs"}
    # What was performed cannot change under the campaign; what follows can.
    write('scene = "stays.toml"\nlevels_percent = [50, 90]\n[[run]]\nname = "../one"\n')
    code, said = run(capsys=capsys)
    assert code == 2
    assert "no longer has it there; --restart begins again" in str(said["error"])
    write('scene = "stays.toml"\nlevels_percent = [50, 100, 100]\n[[run]]\nname = "../one"\n')
    code, said = run("--yes", capsys=capsys)
    assert (code, said["done"]) == (0, 3)


def test_a_fall_ends_the_call_and_the_next_goes_on_behind_it(capsys: pytest.CaptureFixture[str]) -> None:
    write(f'scene = "stays.toml"\nlevels_percent = [100]\n[[run]]\nname = "falls"\n{FALLS}[[run]]\nname = "stays"\n')
    code, said = run("--yes", capsys=capsys)
    assert (code, said["done"]) == (1, 1)
    assert "overturned the block" in str(said["ended"])
    code, said = run("--yes", capsys=capsys)
    assert (code, said["done"]) == (0, 2)
    performed = said["performed"]
    assert isinstance(performed, list)
    assert [(entry["run"], entry["ended"], entry["measured"]) for entry in performed] == [
        ("falls", "fell", "overturned"),
        ("stays", "performed", "stayed"),
    ]


def test_a_trip_ends_the_call_and_its_run_is_made_again(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [50, 100]\n[[run]]\n')
    code, said = run("--yes", "--fault", "operator_stop@0.3", capsys=capsys)
    if "error" in said:
        pytest.fail(str(said["error"]))
    assert (code, said["done"]) == (1, 0)
    assert "trip" in str(said["ended"])
    code, said = run("--yes", capsys=capsys)
    assert (code, said["done"]) == (0, 2)
    performed = said["performed"]
    assert isinstance(performed, list)
    assert [(entry["number"], entry["ended"]) for entry in performed] == [
        (1, "tripped"),
        (1, "performed"),
        (2, "performed"),
    ]


def test_a_run_that_was_killed_is_said_and_made_again(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [100]\n[[run]]\n')
    Path("runs/all").mkdir(parents=True)
    under_way = {"number": 1, "time": "2026-01-01T00:00:00+00:00", "recording": "runs/all/001.mcap"}
    Path("runs/all/progress.json").write_text(json.dumps({"campaign": "all", "under_way": under_way}), encoding="utf-8")
    assert main(["run", "all.toml", *FAST]) == 0
    said = capsys.readouterr().out
    assert "WARNING    run 1 was begun at 2026-01-01" in said
    assert "summary    1 of 1 runs done" in said


def test_restart_keeps_what_was_done_aside(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [100]\n[[run]]\n')
    run(capsys=capsys)
    code, said = run("--restart", capsys=capsys)
    assert (code, said["done"]) == (0, 1)
    assert len(list(Path("runs/all").glob("progress-*.json"))) == 1
    assert len(list(Path("runs/all").glob("*.mcap"))) >= 1


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--gain", "0.5"], "--gain belongs to a scene"),
        (["--scale", "2"], "--record and --scale belong to a scene"),
        (["--out", "one.mcap"], "recorded into a folder"),
        (["--device", "quanser_st3", "--yes"], "--yes is for emulators"),
    ],
)
def test_what_does_not_go_with_a_campaign(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\n[[run]]\n')
    assert main(["run", "all.toml", *options]) == 2
    assert said in capsys.readouterr().err
    assert not Path("runs").exists()


def test_what_belongs_to_a_campaign_alone(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "stays.toml", "--yes"]) == 2
    assert "--yes belongs to a campaign" in capsys.readouterr().err


def test_a_damaged_progress_is_one_sentence(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\n[[run]]\n')
    Path("runs/all").mkdir(parents=True)
    Path("runs/all/progress.json").write_text('{"campaign": 3', encoding="utf-8")
    assert main(["run", "all.toml", "--yes"]) == 2
    assert "--restart begins again" in capsys.readouterr().err


def test_a_real_table_unarmed_is_a_dry_run_of_all(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [50, 100]\n[[run]]\n')
    real = ["--device", "quanser_st3", "--bus", "socketcan", "--channel", "can9"]
    assert main(["run", "all.toml", *real]) == 0
    said = capsys.readouterr()
    assert said.err.count("dry run    nothing moved") == 2
    assert "gain       0.5 of the whole pulse" in said.out
    assert not Path("runs").exists()


def test_a_real_table_is_armed_for_each_run_at_a_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    write('scene = "stays.toml"\nlevels_percent = [50, 100]\n[[run]]\n')
    real = ["--device", "quanser_st3", "--bus", "socketcan", "--channel", "can9", "--arm"]
    assert main(["run", "all.toml", *real]) == 2
    assert "confirmed at a terminal" in capsys.readouterr().err
    assert '"under_way": null' in Path("runs/all/progress.json").read_text(encoding="utf-8"), "nothing was begun"
