"""What laboratories have: tables written in many ways, points of camera systems; and what is none of it."""

from __future__ import annotations

import contextlib
import math
import re
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recordings import Geometry, RecordingError, read_run
from recordings.import_map import UNITS, parse_map
from recordings.import_run import write_import
from recordings.import_table import LARGEST_FILE, TextTable, read_table, read_text
from recordings.importing import Measured, measured_in
from tests.facts import B6L
from twin.live_twin import LiveTwin
from twin.simulation import simulate

ROWS = [(k * 2e-3, 0.01 * math.sin(25.0 * k * 2e-3), 0.1 * math.cos(5.0 * k * 2e-3)) for k in range(300)]
GRAVITY = 9.81


def text_of(separator: str, decimal: str, head: str = "", end: str = "") -> str:
    lines = [separator.join(f"{value:.9f}".replace(".", decimal) for value in row) + end for row in ROWS]
    return head + "\n".join(lines) + "\n"


def table_of(text: str, **options: str) -> TextTable:
    return read_table(text, "lab.csv", **options)


def taken(text: str, mapping: str, **options: float) -> Measured:
    return measured_in(table_of(text), parse_map([mapping]), "lab.csv", gravity=GRAVITY, **options)


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), ("   ", "."), (" ", ",")]
)
@pytest.mark.parametrize("end", ["", "\r"])
def test_tables_in_all_spellings(separator: str, decimal: str, end: str) -> None:
    head = f"Test 12, of 3.4.2019\n\n{separator.join(['time', 'x', 'phi'])}\n"
    table = table_of(text_of(separator, decimal, head, end))
    np.testing.assert_allclose(table.values, ROWS, atol=1e-9)
    assert table.lines[0] == 4
    assert [names[0] for names in table.names] == ["time", "x", "phi"]


def test_a_separator_at_the_end_of_each_line() -> None:
    table = table_of("t;x;\n0;1;\n1;2;\n2;3;\n")
    assert table.values.tolist() == [[0, 1], [1, 2], [2, 3]]
    assert [names[0] for names in table.names] == ["t", "x"]


def test_units_below_the_names_and_missing_values() -> None:
    table = table_of('# export\n"Point 1";"Point 1";"Point 2"\nX [mm];Y [mm];X [mm]\n1,5;2,5;-\n2,5;;3,0\n\n# end\n')
    assert table.names[0] == ("X [mm]", "Point 1", "Point 1 X [mm]")
    np.testing.assert_array_equal(table.values, [[1.5, 2.5, np.nan], [2.5, np.nan, 3.0]])


@pytest.mark.parametrize("coding", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
def test_texts_of_other_systems(tmp_path: Path, coding: str) -> None:
    path = tmp_path / "lab.csv"
    path.write_text("Zeit;Drehung [°]\n0,0;1,0\n0,1;2,0\n", encoding=coding)
    assert table_of(read_text(path)).names[1][0] == "Drehung [°]"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("", "lab.csv has no table"),
        ("one line of words\nand another\n", "lab.csv has no table"),
        ("t,x\n0,1\n1,2\n2,three\n", r"lab.csv, line 4: 'three' is no number \(with a decimal point\)"),
        ("t;x\n0,5;1\n1,5;2\n2.5;3\n", r"lab.csv, line 4: '2.5' is no number \(with a decimal comma\)"),
        ("0,1\n1,2\n2,3,4\n", "lab.csv, line 3: 3 fields, where the lines before have 2"),
        ("0;1\n1;2\n;\n", "lab.csv, line 3: no number at all"),
    ],
)
def test_what_is_no_table_is_one_sentence_with_the_line(text: str, sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        table_of(text)


def test_files_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(RecordingError, match=r"none\.csv cannot be read: no such file"):
        read_text(tmp_path / "none.csv")
    (tmp_path / "b.bin").write_bytes(bytes(100))
    with pytest.raises(RecordingError, match="is no text file"):
        read_text(tmp_path / "b.bin")
    monkeypatch.setattr("recordings.import_table.LARGEST_FILE", 10)
    with pytest.raises(RecordingError, match="the limit is 0 MiB"):
        read_text(tmp_path / "b.bin")
    assert LARGEST_FILE == 256 * 2**20


def test_the_map_reads_columns_units_and_places() -> None:
    text = text_of(",", ".", "Stage time,x [mm],phi\n")
    found = taken(text, 'time="Stage time"[ms] displacement=x[mm] rotation=#3[deg]')
    assert found.step == pytest.approx(2e-6)
    np.testing.assert_allclose(found.position, [row[1] * 1e-3 for row in ROWS], atol=1e-12)
    np.testing.assert_allclose(found.rotation, [math.radians(row[2]) for row in ROWS], atol=1e-10)


def test_accelerations_in_g_are_the_scenes() -> None:
    found = taken(text_of(",", "."), "time=#1[s] acceleration=#2[g]")
    np.testing.assert_allclose(found.acceleration, [row[1] * GRAVITY for row in ROWS], atol=1e-8)
    assert "acceleration: as given" in found.words


def test_a_rate_stands_for_a_time_column() -> None:
    found = taken(text_of(",", "."), "rate=0.5[kHz] rotation=#3[rad]")
    assert found.step == pytest.approx(2e-3)
    assert found.acceleration.tolist() == [0.0] * 300
    assert "the base is taken to stand still" in found.words[-1]


def test_a_displacement_is_differentiated_and_the_noise_said() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0.0, 3.0, 1e-3)
    x = 0.01 * np.sin(8.0 * math.pi * time) + 1e-6 * rng.standard_normal(time.size)
    text = "t,x\n" + "\n".join(f"{a:.3f},{b:.9f}" for a, b in zip(time, x, strict=True))
    found = taken(text, "time=t[s] displacement=x[m]", bandwidth=30.0)
    true = -0.01 * (8.0 * math.pi) ** 2 * np.sin(8.0 * math.pi * time)
    assert np.std((found.acceleration - true)[30:-30]) < 0.1
    assert re.search(r"noise (9\.|1)[0-9]*e-0[67] m of the displacement makes 0\.0[0-9]+ m/s2", found.words[-1])


def test_times_printed_with_too_few_digits_are_put_on_their_grid() -> None:
    # 400 Hz with three decimals: steps of 2 and 3 ms.
    text = "t,x\n" + "\n".join(f"{k * 2.5e-3:.3f},{k}" for k in range(400))
    found = taken(text, "time=t[s] rotation=x[urad]")
    assert found.step == pytest.approx(2.5e-3, rel=1e-4)
    assert found.cycle.tolist() == list(range(400))


def test_missing_samples_are_gaps() -> None:
    kept = [k for k in range(100) if k not in (40, 41, 42)]
    text = "t,x,p\n" + "\n".join(f"{k * 1e-2:.2f},{math.sin(k * 0.1):.6f},0.1" for k in kept)
    found = taken(text, "time=t[s] displacement=x[mm] rotation=p[rad]")
    assert found.cycle.tolist() == kept
    assert "3 samples are missing" in found.words


def point(x: float, z: float, angle: np.ndarray, base: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where a point of the block is: turned about the corner it stands on (x to the right, z up)."""
    corner = np.copysign(0.03, angle)
    c, s = np.cos(angle), np.sin(angle)
    return base + corner + (x - corner) * c + z * s, z * c - (x - corner) * s


@pytest.mark.parametrize("as_displacement", [False, True])
@pytest.mark.parametrize("base_turns", [0.0, 0.01])
def test_the_rotation_of_points_is_the_blocks(as_displacement: bool, base_turns: float) -> None:
    """What GOM's Aramis exports: coordinates, or displacements from a reference, of points on block and table."""
    time = np.arange(0.0, 2.0, 5e-3)
    angle = simulate(B6L, initial_rotation=0.0, initial_angular_velocity=0.8).rotation(time)
    base = 0.02 * np.sin(6.0 * time)
    places = {"p1": (-0.02, 0.1), "p2": (0.02, 0.2), "p3": (0.0, 0.26)}
    paths = {name: point(x, z, angle, base) for name, (x, z) in places.items()}
    paths |= {"base1": (base - 0.1, np.zeros_like(base)), "base2": (base + 0.1, np.zeros_like(base))}
    tilt = base_turns * np.sin(9.0 * time)
    # The camera, or the table, turns too: everything about the same point.
    paths = {
        name: (x * np.cos(tilt) + z * np.sin(tilt), z * np.cos(tilt) - x * np.sin(tilt))
        for name, (x, z) in paths.items()
    }
    heads, columns, mapping = ["t"], [time], ["time=t[s]"]
    for name, (x, z) in paths.items():
        first = (x[0], z[0])
        for axis, values, start in zip("xz", (x, z), first, strict=True):
            heads.append(f"{name}{axis}")
            if as_displacement:
                columns.append(1e3 * (values - start))
                mapping.append(f"{name}.d{axis}={name}{axis}[mm] {name}.{axis}0={1e3 * start}[mm]")
            else:
                columns.append(1e3 * values)
                mapping.append(f"{name}.{axis}={name}{axis}[mm]")
    rows = "\n".join(";".join(f"{value:.9f}" for value in row) for row in np.stack(columns, axis=1))
    found = taken(";".join(heads) + "\n" + rows, " ".join(mapping))
    np.testing.assert_allclose(found.rotation, angle, atol=1e-6)
    if not base_turns:
        np.testing.assert_allclose(found.position, base - base[0], atol=1e-9)
    assert any("least-squares rigid rotation of 3 points" in words for words in found.words)


@pytest.mark.parametrize(
    ("mapping", "sentence"),
    [
        ("", "give time=COLUMN"),
        ("time=t[s] rate=5[Hz] rotation=p[rad]", "give time=COLUMN"),
        ("time=t", r"'time=t' is not WHAT=COLUMN\[UNIT\]"),
        ("time=t[parsec]", "time is in 'parsec'; known units of time are s, ms"),
        ("tiem=t[s]", "there is no 'tiem'; known are time, displacement"),
        ("time=t[s] time=u[s]", "time is given twice"),
        ("time='t[s]", "cannot be read: no closing quotation"),
    ],
)
def test_maps_that_cannot_be_read(mapping: str, sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        parse_map([mapping])


@pytest.mark.parametrize(
    ("head", "mapping", "sentence"),
    [
        ("t,x,p", "time=t[s] rotation=q[rad]", "has no column 'q'; it has 3: 't', 'x', 'p'"),
        ("t,x,x", "time=t[s] rotation=x[rad]", "has 2 columns named 'x': give its place, as #2"),
        ("t,x,p", "time=t[s] rotation=#4[rad]", "column #4; lab.csv has 3"),
        ("t,x [mm],p", "time=t[s] displacement=x[m]", r"is in m, but lab.csv calls its column 'x \[mm\]'"),
        ("t,x,p", "time=t[s]", "neither a rotation nor a motion of the base"),
        ("t,x,p", "time=t[s] a.x=x[m]", "point a has x; a point wants x and z"),
        ("t,x,p", "time=t[s] a.x=x[m] a.z=p[m]", "one point on the block"),
        ("t,x,p", "time=t[s] a.x=x[m] a.z=p[m] b.x=x[m] b.z=p[m]", "points a, b: the points lie all in one place"),
        ("t,x,p", "time=t[s] rotation=p[rad] a.x=x[m] a.z=p[m] b.x=p[m] b.z=x[m]", "by a column and by points"),
        ("t,x,p", "time=t[s] displacement=x[m] base.x=p[m]", "by a column and by points"),
        ("t,x,p", "rate=-1[Hz] rotation=p[rad]", "rate is -1 Hz"),
        ("t,x,p", "rate=often[Hz] rotation=p[rad]", "rate is 'often'; it must be a number"),
    ],
)
def test_maps_that_do_not_fit(head: str, mapping: str, sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        taken(text_of(",", ".", head + "\n"), mapping)


EVEN = "".join(f"{k},{k % 3}\n" for k in range(10))


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        ("0,1\n1,2\n1,3\n2,4\n3,5\n", "line 4: the time goes from 1 to 1 s; it must rise"),
        (f"{EVEN}10.4,1\n11,1\n12,1\n", "line 12: the times are not evenly spaced; 10.4 s is 0."),
        ("0,1\n1,2\n,3\n3,4\n4,5\n", "line 4: the time is missing"),
        ("0,1\n1,\n2,3\n3,4\n4,5\n", "line 3: the base displacement is missing; the twin needs every one"),
        ("0,1\n1,2\n2,3\n", "has 3 rows of numbers; it takes 5"),
        ("0,1\n1,2\n2,3\n3,3\n4,3\n90000,4\n", "misses 89995 samples in a row|not evenly spaced"),
    ],
)
def test_rows_that_cannot_be_used(rows: str, sentence: str) -> None:
    with pytest.raises(RecordingError, match=sentence):
        taken("t,x\n" + rows, "time=t[s] displacement=x[m]")


@pytest.mark.parametrize(
    ("mapping", "sentence"),
    [
        ("rotation=p[rad]", r"line 3: the rotation is 4 rad; the limit is 3.1416 rad: is its unit"),
        ("acceleration=x[g]", r"line 4: the base acceleration is 19620 m/s2; the limit is 10000 m/s2: is its unit"),
    ],
)
def test_a_value_that_no_block_has_is_most_often_a_unit(mapping: str, sentence: str) -> None:
    rows = "\n".join(f"{k},{1000 * k},{4 * k}" for k in range(6))
    with pytest.raises(RecordingError, match=re.escape(sentence)):
        taken(f"t,x,p\n{rows}\n", f"time=t[s] {mapping}")


def test_the_recording_that_comes_of_it(tmp_path: Path) -> None:
    kept = np.array([k for k in range(600) if not 100 <= k < 105])
    acceleration = 3.0 * np.sin(25.0 * kept * 2e-3) * (kept < 125)
    measured = Measured(kept, 2e-3, np.full(kept.size, np.nan), acceleration, np.zeros(kept.size))
    path = tmp_path / "a.mcap"
    write_import(measured, LiveTwin(B6L), path, {"import": {"file": "lab.csv"}}, Geometry(0.06, 0.27), 10**18)
    run = read_run(path)
    assert run.complete
    assert run.cycles.cycle.tolist() == kept.tolist()
    assert [(gap.first, gap.last) for gap in run.missed] == [(100, 104)]
    assert np.array_equal(run.cycles.acceleration, acceleration)
    assert np.max(np.abs(run.cycles.predicted_rotation)) > 1e-3
    assert "impact" in [event.name for event in run.events]
    twin = LiveTwin(B6L)
    again = [twin.measure(time, a) for time, a in zip(run.cycles.time, run.cycles.acceleration, strict=True)]
    assert again == run.cycles.predicted_rotation.tolist()


@given(st.text(max_size=300))
def test_fuzzed_tables_give_a_table_or_a_sentence(text: str) -> None:
    with contextlib.suppress(RecordingError):
        table = table_of(text)
        assert table.values.shape == (len(table.lines), len(table.names))


@given(
    st.lists(
        st.lists(st.sampled_from(["0", "1.5", "2,5", "-", "", "x", "1e9", "nan", "9" * 400]), min_size=1, max_size=5),
        max_size=12,
    ),
    st.sampled_from([",", ";", "\t", " "]),
)
def test_fuzzed_rows_give_measurements_or_a_sentence(rows: list[list[str]], separator: str) -> None:
    text = "\n".join(separator.join(row) for row in rows)
    with contextlib.suppress(RecordingError):
        found = taken(text, "time=#1[s] displacement=#2[mm] rotation=#2[deg]")
        assert np.all(np.isfinite(found.acceleration))


@given(st.text(alphabet="abtimexz0.=[]# \"'s\\", max_size=40))
def test_fuzzed_maps_give_entries_or_a_sentence(text: str) -> None:
    with contextlib.suppress(RecordingError):
        found = parse_map([text])
        assert all(any(entry.unit in units for units in UNITS.values()) for entry in found.values())
