"""`twin map`: files, resuming, pictures, what it refuses; and a dask cluster."""

from __future__ import annotations

import importlib.util
import json
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from excitation import SineWave, clip
from tests.facts import B6L, LIMIT, P
from twin import overturning_map
from twin.cli import main
from twin.errors import InputError
from twin.map.axis import read_axis
from twin.map.blocks import CELLS_PER_BLOCK, Question, answers
from twin.map.capacity import reachable
from twin.map.export import export
from twin.map.grid import make_grid
from twin.map.store import MapStore

SMALL = ["map", "b6l_sine", "--amplitude", "0.5:8:12", "--frequency", "0.5:9:11"]


def question(times: bool = False) -> Question:
    rows, columns = np.linspace(0.1, 10.0, 150), np.linspace(0.1, 10.0, 140)
    return Question(make_grid(B6L, "sine", amplitudes=rows, frequencies=columns), times=times, peaks=times)


def test_the_file_holds_the_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "folder" / "map.npz"
    assert main([*SMALL, "--out", str(out), "--full", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    chart = overturning_map(
        B6L, amplitudes=np.linspace(0.5, 8, 12), frequencies=np.linspace(0.5, 9, 11), times=True, peaks=True
    )
    with np.load(out, allow_pickle=False) as file:
        assert np.array_equal(file["outcome"], chart.codes)
        assert np.array_equal(file["impacts"], chart.impacts)
        assert np.array_equal(file["direction"], chart.direction)
        assert np.array_equal(file["overturning_time"], chart.overturning_time, equal_nan=True)
        assert np.array_equal(file["peak_rotation"], chart.peak_rotation, equal_nan=True)
        assert np.array_equal(file["amplitudes"], chart.grid.rows)
        assert file["outcomes"][2] == "overturned"
        assert json.loads(str(file["question"]))["kind"] == "sine"
    assert said["cells"]["overturned"] == int(chart.overturned.sum())
    assert [path.name for path in out.parent.iterdir()] == ["map.npz"]


def test_csv_has_a_line_a_cell(tmp_path: Path) -> None:
    out = tmp_path / "map.csv"
    assert main([*SMALL, "--out", str(out), "--full"]) == 0
    lines = out.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "amplitude,frequency,outcome,impacts,direction,overturning_time_s,peak_rotation_rad"
    assert len(lines) == 1 + 12 * 11
    assert lines[1].startswith("0.5,0.5,stayed,0,0,,")


def test_units() -> None:
    g, p = B6L.gravity, B6L.frequency_parameter
    assert main([*SMALL[:2], "--amplitude", f"{g / 9.81 * 0.3}g", "--frequency", "4Hz"]) == 0
    assert read_axis("--x", "1:3:3", {"": 2.0}).tolist() == [2.0, 4.0, 6.0]
    assert read_axis("--x", "7rad/s", {"": 1.0, "rad/s": 1.0 / p})[0] == pytest.approx(7.0 / p, rel=1e-15)


@pytest.mark.parametrize("ending", [".npz", ".csv"])
def test_a_broken_off_map_goes_on_to_the_same_bytes(tmp_path: Path, ending: str) -> None:
    asked = question(times=True)
    assert asked.grid.size > 2 * CELLS_PER_BLOCK
    part = tmp_path / "part"
    with MapStore(part, asked) as store:
        for answer in answers(asked, None, store.missing()):
            store.put(answer)
        export(store, tmp_path / f"whole{ending}")
    part.unlink()
    with MapStore(part, asked) as store:
        following = answers(asked, None, store.missing())
        store.put(next(following))
        following.close()
        assert not store.complete
        assert 0 < store.cells_done < asked.grid.size
    with MapStore(part, asked, resume=True) as store:
        ranges = list(store.missing())
        assert len(ranges) == 2
        for answer in answers(asked, None, iter(ranges)):
            store.put(answer)
        assert store.cells_done == asked.grid.size
        export(store, tmp_path / f"resumed{ending}")
    assert (tmp_path / f"resumed{ending}").read_bytes() == (tmp_path / f"whole{ending}").read_bytes()


def test_stopping_begins_nothing_new_and_keeps_what_is_under_way(tmp_path: Path) -> None:
    asked = question()
    assert list(answers(asked, None, iter([(0, 10)]), lambda: True)) == []
    with MapStore(tmp_path / "part", asked) as store:
        for answer in answers(asked, None, store.missing(), lambda: store.cells_done > 0):
            store.put(answer)
        assert store.cells_done > 0


def test_an_unfinished_map_is_neither_overwritten_nor_mixed_up(tmp_path: Path) -> None:
    MapStore(tmp_path / "part", question()).__exit__(None, None, None)
    with pytest.raises(InputError, match="unfinished map: --resume"):
        MapStore(tmp_path / "part", question())
    with pytest.raises(InputError, match="another question"):
        MapStore(tmp_path / "part", question(times=True), resume=True)
    with pytest.raises(InputError, match="no unfinished map"):
        MapStore(tmp_path / "nothing", question(), resume=True)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--amplitude", "1:2"], "--amplitude is '1:2'; give START:STOP:COUNT"),
        (["--amplitude", "1:2:0"], "--amplitude asks 0 values"),
        (["--amplitude", "1:2:3kg"], "units: 'g', 'm/s2'"),
        (["--frequency=-1:2:3"], "frequencies must be above 0"),
        (["--gap", "1:2:3mm"], "--gap is no axis of a sine map"),
        (["--kind", "sinus"], "did you mean sine?"),
        (["--kind", "lasting-sine"], "a lasting sine needs --duration"),
        (["--duration", "3"], "--duration is the length of a lasting sine"),
        (["--method", "newmerk"], "did you mean newmark?"),
        (["--model", "linearized"], "did you mean linearised?"),
        (["--restitution", "much"], "--restitution is 'much'"),
        (["--restitution", "1.2"], "restitution is 1.2"),
        (["--restitution", "improved:2"], "share of the half width"),
        (["--initial-tilt", "95"], "initial rotation is 1.65806 rad"),
        (["--out", "map.txt"], "a map ends in .npz or .csv"),
        (["--picture", "map.gif2"], "a picture ends in"),
        (["--resume"], "--resume goes on with an unfinished --out"),
        (["--executor", "slurm://host:1"], "--executor is 'slurm://host:1'"),
    ],
)
def test_what_cannot_be_asked_exits_with_2(
    tmp_path: Path,
    arguments: list[str],
    words: str,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["map", "b6l_sine", "--amplitude", "2", "--frequency", "2", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    [
        ["b6l_sine", "--amplitude", "0.5:8:12", "--frequency", "0.5:9:11", "--initial-tilt", "2"],
        ["b6l_constant", "--amplitude", "0.5:8:6", "--length", "0.02:0.3:6s"],
        ["b6l_sine", "--kind", "double-pulse", "--velocity", "0.1:0.9:5", "--gap", "5:50:5mm"],
        ["b6l_sine", "--kind", "lasting-sine", "--duration", "1", "--amplitude", "1:3:4", "--frequency", "2:4:1"],
    ],
)
def test_pictures(tmp_path: Path, arguments: list[str]) -> None:
    assert main(["map", *arguments, "--picture", str(tmp_path / "map.png")]) == 0
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_what_the_table_can_run_is_what_clip_says() -> None:
    from devices.quanser_st3.capacity import CAPACITY

    grid = make_grid(B6L, "sine", amplitudes=np.linspace(0.1, 10.0, 50), frequencies=np.linspace(0.2, 10.0, 8))
    columns, tops = reachable(grid, CAPACITY)
    assert np.isnan(tops[-1])  # above its frequency
    for w, top in zip(columns, tops, strict=True):
        if math.isfinite(top):
            f = w * P / (2.0 * math.pi)
            assert clip(SineWave(top * LIMIT, f), CAPACITY).feasible
            assert not clip(SineWave((top + 1e-5) * LIMIT, f), CAPACITY).feasible


@pytest.fixture(scope="module", params=[False, True], ids=["threads", "processes"])
def cluster(request: pytest.FixtureRequest) -> Iterator[object]:
    if importlib.util.find_spec("distributed") is None:
        pytest.skip("dask.distributed is not installed (extra `cluster`)")
    from distributed import LocalCluster

    with LocalCluster(
        n_workers=1,
        threads_per_worker=2,
        processes=request.param,
        dashboard_address=None,
        protocol="tcp",
        host="127.0.0.1",
    ) as made:
        yield made


@pytest.mark.filterwarnings("default")  # dask's own, in its own threads
def test_a_dask_cluster_gives_the_same_map(cluster: object, tmp_path: Path) -> None:
    assert main([*SMALL, "--out", str(tmp_path / "here.npz")]) == 0
    address = str(cluster.scheduler_address).removeprefix("tcp://")
    assert main([*SMALL, "--out", str(tmp_path / "there.npz"), "--executor", f"dask://{address}"]) == 0
    assert (tmp_path / "there.npz").read_bytes() == (tmp_path / "here.npz").read_bytes()
