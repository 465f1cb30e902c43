"""A run's place on a map of `twin map`, and maps that are none."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest

from recordings import RecordingError, read_run
from recordings.map_point import map_with_run
from recordings.samples import sample_path
from tests.facts import B6L
from twin.cli import main

SINE = read_run(sample_path("sine")).metadata


@pytest.fixture(scope="module")
def map_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("map") / "map.npz"
    grid = ["--amplitude", "0.1:3:30", "--frequency", "0.5:6:12"]
    assert main(["map", "b6l_sine", *grid, "--out", str(path), "--json"]) == 0
    return path


def test_the_place_is_that_of_the_pulse(map_file: Path) -> None:
    found = map_with_run(map_file, SINE, 9.81)
    assert found.pixels.shape == (30, 12, 3)
    amplitude = 0.32 * 9.81 / B6L.uplift_acceleration
    frequency = 2.0 * np.pi * 5.0 / B6L.frequency_parameter
    assert found.point is not None
    column, row = found.point
    assert np.interp(column, np.arange(12), found.columns) == pytest.approx(frequency, rel=1e-9)
    assert np.interp(row, np.arange(30), found.rows) == pytest.approx(amplitude, rel=1e-9)
    assert "rocked" in found.present
    assert "| light blue | rocked |" in found.legend_text
    assert (found.column_text(0.0), found.row_text(1.0)) == ("0.5", "3")


def test_a_run_outside_is_said_to_be(map_file: Path) -> None:
    given = json.loads(SINE["excitation"]["given"])
    given["parameters"]["frequency"] = 50.0
    found = map_with_run(map_file, {"excitation": {"given": json.dumps(given)}}, 9.81)
    assert found.point is None
    assert "this run lies outside" in found.name


@pytest.mark.parametrize(
    ("metadata", "sentence"),
    [
        ({}, "does not say which pulse was given"),
        ({"excitation": {"given": "null"}}, "is a map of sine pulses; the run was shaken by nothing"),
        (
            {"excitation": {"given": '{"type": "ConstantPulse", "kind": "constant pulse", "parameters": {}}'}},
            "is a map of sine pulses; the run was shaken by constant pulse",
        ),
        ({"excitation": {"given": '{"type": "SineWave", "parameters": {}}'}}, "lacks its parameters"),
    ],
)
def test_runs_without_a_place(map_file: Path, metadata: dict[str, dict[str, str]], sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        map_with_run(map_file, metadata, 9.81)


def test_files_that_are_no_map(tmp_path: Path, map_file: Path) -> None:
    with pytest.raises(RecordingError, match="cannot be read: no such file"):
        map_with_run(tmp_path / "none.npz", SINE, 9.81)
    (tmp_path / "text.npz").write_text("no")
    with pytest.raises(RecordingError, match="is no map of `twin map`"):
        map_with_run(tmp_path / "text.npz", SINE, 9.81)
    np.savez(tmp_path / "other.npz", a=np.zeros(3))
    with pytest.raises(RecordingError, match="is no map of `twin map`"):
        map_with_run(tmp_path / "other.npz", SINE, 9.81)
    np.savez(tmp_path / "pickle.npz", outcome=np.array([object()]), question=np.array("{}"))
    with pytest.raises(RecordingError, match="is no map of `twin map`"):
        map_with_run(tmp_path / "pickle.npz", SINE, 9.81)
    with zipfile.ZipFile(map_file) as source, zipfile.ZipFile(tmp_path / "bomb.npz", "w") as bomb:
        for name in source.namelist():
            data = source.read(name)
            bomb.writestr(name, data.replace(b"(30, 12)", b"(99999, 9999)") if name == "outcome.npy" else data)
    with pytest.raises(RecordingError, match=r"is no map of `twin map`: outcome\.npy is too large"):
        map_with_run(tmp_path / "bomb.npz", SINE, 9.81)
