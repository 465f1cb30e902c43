"""`twin calibrate` as a user meets it."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.facts import B6L
from tests.twin.calibration.rockings import rocking
from twin.cli import main
from twin.scene import load_scene


@pytest.fixture(scope="module")
def table(tmp_path_factory: pytest.TempPathFactory) -> Path:
    recording = rocking(B6L, 0.15, 0.92, held=0.2)
    path = tmp_path_factory.mktemp("tables") / "rocking.csv"
    rows = [f"{time:.4f},{value:.7f}" for time, value in zip(recording.time, recording.rotation, strict=True)]
    path.write_text("\n".join(["time_s,rotation_rad", *rows]))
    return path


def said(arguments: list[str], capsys: pytest.CaptureFixture[str], code: int = 0) -> dict[str, object]:
    assert main(["calibrate", *arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def refused(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main(["calibrate", *arguments]) == 2
    text = capsys.readouterr().err.strip()
    assert "\n" not in text
    return text


def test_the_emulated_block_is_recognised(capsys: pytest.CaptureFixture[str]) -> None:
    """The sample's block has 1 % less restitution and 0.5 % more slenderness than the scene's, at the same diagonal."""
    estimates = said(["free"], capsys)["estimates"]
    truth = {
        "restitution": 0.99 * B6L.housner_restitution,
        "slenderness": 1.005 * B6L.slenderness,
        "frequency_parameter": B6L.frequency_parameter,
        "initial_tilt": math.radians(6.0),
    }
    for name, value in truth.items():
        found = estimates[name]  # type: ignore[index]
        assert abs(found["value"] - value) < 3.0 * found["standard_deviation"] < 0.03 * value, name


def test_after_the_shaking_what_is_free_is_taken(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["calibrate", "sine"]) == 0
    text = capsys.readouterr().out
    assert "free of shaking from" in text
    assert "verdict    rocks as a rigid block" in text


def test_a_block_that_falls_under_the_shaking_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert "the base moves until" in refused(["fall"], capsys)


def test_a_table_with_usual_names_needs_no_map(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plain = said([str(table)], capsys)
    mapped = said([str(table), "--map", "time=#1[s] rotation=rotation_rad[rad]"], capsys)
    assert plain["estimates"] == mapped["estimates"]
    assert plain["estimates"]["restitution"]["value"] == pytest.approx(0.92, abs=1e-3)  # type: ignore[index]
    assert plain["first_flight"] == "held"


def test_other_units_decimal_commas_and_base_motion(
    table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    values = np.loadtxt(table, delimiter=",", skiprows=1)
    rows = [f"{1e3 * t:.1f};{math.degrees(r):.6f};0".replace(".", ",") for t, r in values]
    path = tmp_path / "grad.csv"
    path.write_text("\n".join(["t;phi;x", *rows]))
    found = said([str(path), "--map", "time=t[ms] rotation=phi[deg] displacement=x[mm]"], capsys)
    assert found["estimates"]["restitution"]["value"] == pytest.approx(0.92, abs=1e-3)  # type: ignore[index]


def test_picture_scene_and_edge(table: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    picture, scene = tmp_path / "fit.png", tmp_path / "block.toml"
    code = main(
        ["calibrate", "free", "--edge", str(table), "--out", str(picture), "--scene-out", str(scene)]
    )  # fmt: skip
    assert code == 0
    text = capsys.readouterr().out
    assert "material   " in text
    assert picture.stat().st_size > 10_000
    whole = tmp_path / "whole.toml"
    whole.write_text(f'{scene.read_text()}\n[excitation]\nkind = "none"\n\n[table]\ndevice = "quanser_st3"\n')
    assert load_scene(str(whole)).block.restitution == pytest.approx(0.9202, abs=3e-4)
    assert main(["calibrate", "free", "--scene-out", "-"]) == 0
    assert "\n[uncertainty]" in capsys.readouterr().out


def test_nominal_geometry(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    size = ["--width-mm", "60", "--height-mm", "270"]
    fixed = said([str(table), *size, "--fix", "slenderness", "--fix", "frequency"], capsys)["estimates"]
    assert fixed["slenderness"]["standard_deviation"] == 0.0  # type: ignore[index]
    loose = said([str(table), *size, "--geometry-percent", "0.01"], capsys)["estimates"]
    assert 0.0 < loose["slenderness"]["standard_deviation"] < 1.01e-4 * B6L.slenderness  # type: ignore[index]


def test_a_part_of_it(table: Path, capsys: pytest.CaptureFixture[str]) -> None:
    part = said([str(table), "--from", "0.5", "--to", "1.5"], capsys)
    times = [impact["time_s"] for impact in part["impacts"]]  # type: ignore[union-attr, attr-defined]
    assert times
    assert min(times) > 0.5
    assert max(times) < 1.5


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["nowhere.mcap"], "cannot be read"),
        (["nosample"], "no file nosample"),
        (["free", "--fix", "slenderness", "--width-mm", "60"], "belong together"),
        (["free", "--width-mm", "-1", "--height-mm", "270"], "must be above 0"),
        (["free", "--geometry-percent", "0"], "must be above 0"),
        (["free", "--out", "fit.bmp"], "ends in .png"),
        (["free", "--from", "100"], "no measured rotation between"),
        (["free", "--scene", "nothing"], "no scene named"),
        (["free", "--scene-out", "no/such/folder/x.toml"], "cannot be written"),
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


@pytest.mark.parametrize(
    ("text", "arguments", "sentence"),
    [
        ("a,b\n1,2\n2,3\n", [], "say with --map"),
        ("time_s,rotation_rad\n1,2\n", [], "no table"),
        ("time_s,rotation_rad\n1,0\n2,0\n3,0\n4,0\n5,0\n6,0\n", [], "6 samples"),
        ("t,r\n1,0\n2,0\n", ["--fix", "frequency", "--map", "time=t[s] rotation=r[rad]"], "rows of numbers"),
    ],
)
def test_bad_tables_are_one_sentence(
    text: str, arguments: list[str], sentence: str, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "table.csv"
    path.write_text(text)
    assert sentence in refused([str(path), *arguments], capsys)


def test_outcomes_are_told_by_their_column(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "trials.csv"
    path.write_text("kind,amplitude_g,frequency_hz,overturned\ncosine,0.3,2,no\n")
    assert "table" not in refused([str(path)], capsys)
