"""`twin sensitivity`: text, JSON, pictures, and what it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from twin.cli import main

SMALL = ["--cells", "9", "--draws", "40", "--quasi-linear", "0"]


@pytest.mark.parametrize("scene", ["b6l_constant", "b6l_free"])
def test_words_and_picture(scene: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "folder" / "sensitivity.png"
    assert main(["sensitivity", scene, *SMALL, "--out", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")
    said = capsys.readouterr().out
    assert said.startswith(f"scene      {scene}: ")
    assert said.endswith(f"picture    {out}\n")
    assert "linearised" in said
    assert ("pulse      none" in said) is (scene == "b6l_free")


def test_json_is_the_whole_study(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", "b6l_double_pulse", *SMALL, "--tilt-spread", "0.2", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said["perturbed"]["draws"] == sum(said["perturbed"]["outcomes"].values()) == 40
    assert said["perturbed"]["tilt_spread_rad"] == pytest.approx(0.0034906585)
    panel = said["pulse"]["over_amplitude"]
    assert (len(panel["classes"]), len(panel["classes"][0])) == (9, 9)
    assert [found["model"] for found in said["pulse"]["differences"]] == ["linearised", "quasi-linear"]
    assert said["free"]["quarter_s"]["nonlinear"] == pytest.approx(0.1808, abs=1e-3)


def test_the_quasi_linear_model_is_stepped_on_a_coarse_grid(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["sensitivity", "b6l_cosine", "--cells", "9", "--draws", "10", "--quasi-linear", "1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["pulse"]["differences"][1]
    assert found["compared"] + found["refused"] == 1


def test_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples = "\n".join(f"{0.02 * k:.2f},{a}" for k, a in enumerate([0.0, 0.3, -0.4, 0.35, 0.1] * 60))
    (tmp_path / "quake.csv").write_text("time_s,acceleration_g\n" + samples, encoding="utf-8")
    arguments = ["sensitivity", "b6l_sine", "--record", str(tmp_path / "quake.csv"), "--cells", "5", "--draws", "10"]
    assert main(arguments) == 0
    assert "quasi-linear model is not asked" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nowhere"], "no scene named 'nowhere'"),
        (["b6l_sine", "--cells", "2"], "--cells is 2"),
        (["b6l_sine", *SMALL, "--out", "study.gif2"], "a picture ends in"),
        (["b6l_sine", "--scale", "2"], "--scale belongs to a record"),
    ],
)
def test_what_cannot_be_asked_exits_with_2(
    arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["sensitivity", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1
