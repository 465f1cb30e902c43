"""`twin plan --find` and `twin plan CAMPAIGN.toml` as a user meets them."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.twin.conftest import SHORT, SINE
from twin.campaign import load_campaign
from twin.cli import main


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(SHORT.format(block="", excitation=SINE), encoding="utf-8")
    return tmp_path


def test_finds_draws_and_writes_a_campaign(capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["plan", "mine.toml", "--find", "overturn at 3 Hz", "--proposals", "1", "--json"]
    assert main([*arguments, "--campaign", "new/found.toml", "--levels", "50,100", "--out", "found.png"]) == 0
    said = json.loads(capsys.readouterr().out)
    (proposal,) = said["proposals"]
    assert proposal["excitation"]["frequency_hz"] == 3.0
    assert proposal["overturning"]["low"] > 0.9
    assert max(proposal["usage"].values()) <= 1.0
    assert Path("found.png").stat().st_size > 10_000
    campaign = load_campaign("new/found.toml")
    assert [step.level for step in campaign.steps] == [50.0, 100.0]
    assert campaign.steps[1].scene.excitation.model_dump(exclude_none=True) == proposal["excitation"]
    # Written over is nothing.
    assert main([*arguments, "--campaign", "new/found.toml"]) == 2
    assert "is there already" in capsys.readouterr().err

    assert main(["plan", "new/found.toml", "--json"]) == 1
    runs = json.loads(capsys.readouterr().out)["runs"]
    assert [run["feasible_as_asked"] for run in runs] == [True, True]
    assert runs[1]["outcome"] == "overturned"
    assert runs[1]["overturning"]["probability"] > 0.9


def test_a_safe_amplitude_in_words(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", "mine.toml", "--find", "largest safe amplitude"]) == 0
    said = capsys.readouterr().out
    assert "goal       largest safe amplitude, probability of overturning below 1 %" in said
    assert "the first unsafe amplitude is" in said
    assert said.splitlines()[-1] == "verdict    1 run proposed"


def test_a_campaign_beyond_the_table_is_planned_and_said(capsys: pytest.CaptureFixture[str]) -> None:
    excitation = '[run.excitation]\nkind = "sine"\namplitude_g = 3\nfrequency_hz = 3\n'
    Path("all.toml").write_text(
        f'scene = "mine.toml"\nlevels_percent = [5, 100]\n[[run]]\n{excitation}', encoding="utf-8"
    )
    assert main(["plan", "all.toml"]) == 1
    lines = capsys.readouterr().out.splitlines()
    assert "run 1 at 5 %: stayed; overturns in 0 %" in lines[1]
    assert "NOT AS ASKED, clipped to" in lines[2]
    assert lines[-1].startswith("verdict    2 runs, 1 of 2 NOT FEASIBLE AS ASKED")


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["mine.toml", "--find", "the best run"], 'goals are: "overturn"'),
        (["mine.toml", "--find", "overturn", "--levels", "100,10"], "--levels is '100,10'"),
        (["mine.toml", "--find", "overturn", "--levels", "a"], "--levels is 'a'"),
        (["mine.toml", "--find", "overturn", "--levels", "nan"], "--levels is 'nan'"),
        (["mine.toml", "--find", "overturn", "--campaign", "a.txt"], "a campaign ends in .toml"),
        (["mine.toml", "--find", "overturn", "--campaign", "mine.toml"], "nothing is written over"),
        (["mine.toml", "--find", "overturn", "--proposals", "0"], "--proposals is 0"),
        (["mine.toml", "--find", "separate restitution"], "give the measured one with --restitution"),
        (["mine.toml", "--campaign", "a.toml"], "--campaign belongs to --find"),
        (["mine.toml", "--levels", "10"], "--levels belongs to --find"),
        (["all.toml", "--find", "overturn"], "--find belongs to a scene"),
    ],
)
def test_bad_input_is_one_sentence(options: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path("all.toml").write_text('scene = "mine.toml"\n[[run]]\n', encoding="utf-8")
    assert main(["plan", *options]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert "Traceback" not in error
