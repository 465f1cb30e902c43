"""What is exported reads back the same in the tools people use: pandas, pyarrow, scipy."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest
from pyarrow import csv, parquet
from scipy.io import loadmat

from recordings import RecordingError, RunWriter, export, export_formats, read_run
from recordings.export import tables_of, with_unit
from recordings.run import Run

if TYPE_CHECKING:
    from conftest import MakeRecords, WriteRun

COLUMNS = {
    "time_s": "time",
    "cycle": "cycle",
    "target_position_m": "target_position",
    "position_m": "position",
    "acceleration_m_s2": "acceleration",
    "status": "status",
    "rotation_rad": "rotation",
    "predicted_rotation_rad": "predicted_rotation",
    "predicted_angular_velocity_rad_s": "predicted_angular_velocity",
    "lateness_s": "lateness",
    "host_time_ns": "host_time_ns",
}


@pytest.fixture
def run(write_run: WriteRun) -> Run:
    return read_run(write_run())


@pytest.fixture
def with_gaps(tmp_path: Path, make_records: MakeRecords) -> Run:
    """A run whose sensor was silent now and then."""
    writer = RunWriter(tmp_path / "gaps.mcap", {})
    for record in make_records(20):
        writer.cycle(replace(record, rotation=float("nan")) if record.cycle % 3 else record)
    writer.finish()
    return read_run(writer.path)


def exported(run: Run, folder: Path, kind: str) -> list[Path]:
    return export.export(run, folder / "out" / f"run.{kind}", kind)


def test_csv_by_pandas(run: Run, tmp_path: Path) -> None:
    files = exported(run, tmp_path, "csv")
    assert [file.name for file in files] == ["run.csv", "run.events.csv", "run.missed.csv", "run.about.json"]
    frame, exact = pd.read_csv(files[0]), csv.read_csv(files[0])
    assert set(frame.columns) == set(COLUMNS)
    for name, source in COLUMNS.items():
        # The text has every digit; some versions of pandas read the last bit wrongly unless told.
        np.testing.assert_array_equal(exact[name].to_numpy(), getattr(run.cycles, source))
        np.testing.assert_allclose(frame[name], getattr(run.cycles, source), rtol=1e-15)
    events = pd.read_csv(files[1])
    assert events["message"].tolist() == [event.message for event in run.events]
    assert events["time_s"].tolist() == [event.time for event in run.events]
    assert pd.read_csv(files[2])[["first", "last"]].to_numpy().tolist() == [[40, 42]]


def test_parquet_by_pandas_and_pyarrow(run: Run, tmp_path: Path) -> None:
    files = exported(run, tmp_path, "parquet")
    assert [file.name for file in files] == ["run.parquet", "run.events.parquet", "run.missed.parquet"]
    frame = pd.read_parquet(files[0])
    table = parquet.read_table(files[0])
    for name, source in COLUMNS.items():
        np.testing.assert_array_equal(frame[name], getattr(run.cycles, source))
        np.testing.assert_array_equal(table[name].to_numpy(), getattr(run.cycles, source))
    assert table.schema.field("acceleration_m_s2").metadata[b"unit"] == b"m/s2"
    about = json.loads(table.schema.metadata[export_formats.ABOUT_KEY])
    assert about["metadata"]["scene"] == {"name": "b6l"}
    assert about["columns"]["cycles"]["rotation_rad"]["unit"] == "rad"


def test_mat_by_scipy(run: Run, tmp_path: Path) -> None:
    (file,) = exported(run, tmp_path, "mat")
    found = loadmat(file, simplify_cells=True)
    for name, source in COLUMNS.items():
        np.testing.assert_array_equal(found["cycles"][name], getattr(run.cycles, source))
        assert found["units"]["cycles"][name]
    assert found["events"]["message"].tolist() == [event.message for event in run.events]
    assert json.loads(found["about"])["complete"] is True


@pytest.mark.parametrize("kind", ["csv", "parquet", "mat"])
def test_a_silent_sensor_is_a_missing_number(with_gaps: Run, tmp_path: Path, kind: str) -> None:
    files = exported(with_gaps, tmp_path, kind)
    if kind == "csv":
        assert ",," in files[0].read_text()
        column = pd.read_csv(files[0])["rotation_rad"]
    elif kind == "parquet":
        column = pd.read_parquet(files[0])["rotation_rad"]
    else:
        column = loadmat(files[0], simplify_cells=True)["cycles"]["rotation_rad"]
    np.testing.assert_array_equal(np.asarray(column), with_gaps.cycles.rotation)


def test_every_column_has_its_unit_in_its_name_or_is_a_count(run: Run) -> None:
    for table in tables_of(run):
        lengths = {column.values.size for column in table.columns}
        assert len(lengths) == 1
        for column in table.columns:
            assert column.unit == "1" or column.name.endswith("_" + column.unit.replace("/", "_"))
            assert column.text


def test_units_in_names() -> None:
    assert with_unit("rotation", "rad") == with_unit("rotation_rad", "rad") == "rotation_rad"
    assert with_unit("cycle", "1") == "cycle"


def test_nothing_is_overwritten_and_nothing_half_is_left(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "run.events.csv").write_text("mine")
    with pytest.raises(RecordingError, match=r"run\.events\.csv exists already and is not overwritten"):
        exported(run, tmp_path, "csv")
    assert [file.name for file in (tmp_path / "out").iterdir()] == ["run.events.csv"]

    def full(*_: object) -> None:
        (tmp_path / "other" / "out" / "run.parquet").write_text("half")
        raise OSError(28, "No space left on device")

    writer = export_formats.WRITERS["parquet"]
    monkeypatch.setitem(export.WRITERS, "parquet", writer._replace(write=full))
    with pytest.raises(RecordingError, match="no space left on device"):
        exported(run, tmp_path / "other", "parquet")
    assert not list((tmp_path / "other" / "out").iterdir())


def test_what_matlab_cannot_hold_is_said(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(export_formats, "LARGEST_MAT", 1000)
    with pytest.raises(RecordingError, match=r"a \.mat file takes 2 GiB, Parquet has no such limit"):
        exported(run, tmp_path, "mat")
    assert not list((tmp_path / "out").iterdir())
