"""The chart: what it calls right or wrong, what it writes, and how its command ends."""

from __future__ import annotations

import csv
import dataclasses
import json
import math
from pathlib import Path

import numpy as np
import pytest

from tests.facts import B6L, FREE_IMPACTS, FREE_REST
from twin.chart import survey as chart_module
from twin.chart.failures import Check, Quantity, Row, rows
from twin.chart.measure import best_time, compared, make_reference, map_points, map_truth, trajectory_points
from twin.chart.peers import follow, peer_solvers
from twin.chart.solvers import NONE, TOLERANCE, Solver, own_solvers
from twin.chart.survey import COLUMNS, Chart, jobs, new_chart, table, write_table
from twin.chart.task import Answer, Task, difference, sample_times, sine
from twin.chart.verdict import Verdict, examine, judge
from twin.cli import main
from twin.errors import InputError

FREE = Task("free", rotation=0.15)


def solver(name: str) -> Solver:
    return next(s for s in own_solvers() if s.name == name)


def still(stated: float = 1e-10, **changes: object) -> Answer:
    """An answer of a block that rocked once."""
    base = Answer(
        uplift=0.0,
        impacts=np.array([0.25]),
        rates=np.array([1.5]),
        rest=4.2,
        overturning=None,
        overturned=False,
        peak=0.15,
        stated=stated,
        end=math.inf,
        rotation=np.zeros_like,
    )
    return dataclasses.replace(base, **changes)


def test_every_method_is_a_column_and_the_default_comes_first() -> None:
    from twin.rocking.methods import METHODS

    names = [s.name for s in own_solvers()]
    assert names[: len(METHODS)] == list(METHODS)
    assert names[0] == "taylor"
    assert {"model linearised", "model quasi-linear", "model auto"} <= set(names)


def test_the_rows_are_twelve_and_carry_the_known_answers() -> None:
    found = rows()
    assert [row.number for row in found] == list(range(1, 13))
    impacts = [c for c in found[1].checks if c.quantity is Quantity.IMPACT]
    assert [c.answer for c in impacts] == [FREE_IMPACTS[n][0] for n in (1, 3, 10, 50, 100)]
    assert found[1].checks[-1].answer == pytest.approx(FREE_REST, abs=1e-13)
    assert len(found[2].checks) == 2000
    assert all(len(quick.checks) <= len(full.checks) for quick, full in zip(rows(quick=True), found, strict=True))


@pytest.mark.parametrize("number", range(1, 13))
def test_the_default_is_right_in_every_row(number: int) -> None:
    finding = examine(solver("taylor"), rows(quick=True)[number - 1])
    expected = Verdict.NOT_APPLICABLE if number == 8 else Verdict.RIGHT
    assert finding.verdict is expected, finding.detail


@pytest.mark.parametrize(("name", "number"), [("closed-form", 4), ("newmark", 8)])
def test_a_refusal_is_called_one(name: str, number: int) -> None:
    finding = examine(solver(name), rows(quick=True)[number - 1])
    assert finding.verdict is Verdict.REFUSED
    assert finding.detail


def test_the_linearised_model_is_caught_outside_its_range() -> None:
    finding = examine(solver("model linearised"), rows(quick=True)[11])
    assert finding.verdict is Verdict.WRONG
    assert "truth" in finding.detail


@pytest.mark.parametrize(
    ("answer", "stated", "verdict"),
    [
        (0.25, 1e-10, Verdict.RIGHT),
        (0.25 + 1e-9, 1e-10, Verdict.WRONG),
        # The same error, stated: 1e-8 rad at 1.5 rad/s is 7e-9 s.
        (0.25 + 1e-9, 1e-8, Verdict.RIGHT),
    ],
)
def test_an_impact_is_held_to_the_stated_error(answer: float, stated: float, verdict: Verdict) -> None:
    check = Check(FREE, Quantity.IMPACT, 0.25, 1e-13)
    assert judge(check, still(stated, impacts=np.array([answer])))[0] is verdict


def test_a_simpler_model_is_held_to_its_share() -> None:
    check = Check(FREE, Quantity.IMPACT, 0.2505)
    assert judge(check, still(), relative=0.01)[0] is Verdict.RIGHT
    assert judge(check, still(), relative=0.001)[0] is Verdict.WRONG


@pytest.mark.parametrize(
    ("truth", "said", "verdict"),
    [
        (True, True, Verdict.RIGHT),
        (True, False, Verdict.WRONG),
        (True, None, Verdict.REFUSED),
        (None, None, Verdict.RIGHT),
        (None, True, Verdict.WRONG),
    ],
)
def test_outcomes(truth: bool | None, said: bool | None, verdict: Verdict) -> None:
    assert judge(Check(FREE, Quantity.OVERTURNS, truth), still(overturned=said))[0] is verdict


@pytest.mark.parametrize(
    ("quantity", "changes"),
    [
        (Quantity.IMPACT, {"impacts": np.zeros(0), "rates": np.zeros(0)}),
        (Quantity.REST, {"rest": None}),
        (Quantity.OVERTURNING, {}),
        (Quantity.RETURNS, {"impacts": np.zeros(0)}),
        (Quantity.STAYS, {}),
        (Quantity.ROTATION, {"end": 1.0}),
    ],
)
def test_what_is_missing_is_wrong(quantity: Quantity, changes: dict[str, object]) -> None:
    assert judge(Check(FREE, quantity, True, 1e-3, at=2.0), still(**changes))[0] is Verdict.WRONG


def test_a_row_is_as_wrong_as_its_worst_check() -> None:
    task = Task("two", rotation=0.15)
    row = Row(1, "two", (Check(task, Quantity.REST, 4.2, 1e-9), Check(task, Quantity.PEAK, 0.2, 1e-9)))
    calls: list[Task] = []

    def run(task: Task, setting: float | None) -> Answer:
        calls.append(task)
        return still()

    finding = examine(Solver("made up", run), row)
    assert (finding.verdict, finding.right, finding.wrong) == (Verdict.WRONG, 1, 1)
    assert len(calls) == 1  # one run answers both
    assert examine(Solver("made up", run, peer=True), row).verdict is Verdict.NOT_APPLICABLE


def test_difference_sees_a_shift_and_a_missing_impact() -> None:
    reference = solver("taylor").run(FREE, None)
    times = sample_times(reference)
    assert times[-1] < FREE_REST + 1e-12
    assert difference(reference, reference, times).rotation == 0.0
    moved = dataclasses.replace(reference, rotation=lambda t: reference.rotation(t) + 1e-5)
    assert difference(moved, reference, times).rotation == pytest.approx(1e-5)
    fewer = dataclasses.replace(reference, impacts=reference.impacts[:50], rates=reference.rates[:50])
    assert math.isinf(difference(fewer, reference, times).impacts)
    shorter = dataclasses.replace(reference, end=1.0)
    assert math.isinf(difference(shorter, reference, times).rotation)


def test_the_reference_is_checked_by_an_independent_code() -> None:
    reference = make_reference(Task("sine", sine(3.0, 3.0)), solver("taylor"), [solver("dop853")])
    assert 0.0 < reference.checks["dop853"] < 1e-11
    assert reference.floor == pytest.approx(reference.checks["dop853"])


def test_points_get_more_accurate_with_the_step() -> None:
    reference = make_reference(Task("sine", sine(3.0, 3.0)), solver("taylor"), [])
    points = trajectory_points(solver("newmark"), reference, 0.001, quick=True)
    errors = [p.error for p in points]
    assert errors == sorted(errors, reverse=True)
    order = math.log(errors[0] / errors[1]) / math.log(points[0].setting / points[1].setting)
    assert order == pytest.approx(2.0, abs=0.2)
    refused = trajectory_points(solver("closed-form"), reference, 0.001, quick=True)
    assert len(refused) == 1
    assert "closed form" in refused[0].refused


def test_the_best_time_is_of_at_most_200_runs() -> None:
    import gc

    collecting: list[bool] = []
    best, runs = best_time(lambda: collecting.append(gc.isenabled()), 10.0)
    assert runs == len(collecting) == 200
    assert not any(collecting)
    assert gc.isenabled()
    assert 0.0 <= best < 10.0


def test_wrong_and_undecided_cells_are_counted_apart() -> None:
    right = np.array([0, 0, 1, 1, 2], dtype=np.int8)
    codes = np.array([0, 1, 1, 2, 0], dtype=np.int8)
    point = compared("made up", NONE, None, codes, right, 1.0)
    assert (point.wrong, point.undecided, point.cells) == (1, 1, 5)


def test_a_map_of_a_solver_that_always_stands() -> None:
    truth = map_truth(solver("taylor"), 5)
    assert truth.axis[-1] == 10.0
    falls = int(np.sum(truth.codes == 1))
    assert 0 < falls < truth.codes.size
    point = map_points(Solver("stands", lambda *_: still()), truth, 1.0, quick=True)[0]
    assert point.wrong == falls


class Straight:
    """A peer that flies straight, and lands where told."""

    def __init__(self, codes: list[int]) -> None:
        self.codes = codes

    def fly(
        self, t: float, phi: float, v: float, side: float, piece: np.ndarray, end: float
    ) -> tuple[float, float, float, int, object]:
        code = self.codes.pop(0)
        return min(end, t + 0.1), 0.0 if code == 1 else 1.6, -1.0 if code == 1 else 1.0, code, lambda x: x * 0.0 + 0.01


def test_a_peer_is_followed_over_its_impacts() -> None:
    answer = follow(Straight([1, 1, 2]), FREE)
    assert answer.impacts == pytest.approx([0.1, 0.2])
    assert np.sign(answer.rates) == pytest.approx([-1.0, 1.0])
    assert answer.overturned is True
    assert answer.overturning == pytest.approx(0.3)
    assert answer.rotation(np.array([0.05, 0.15, 0.25, 0.4])) == pytest.approx([0.01, -0.01, 0.01, 0.5 * math.pi])


def test_peers_that_are_absent_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("twin.chart.peers.find_spec", lambda name: None if name == "heyoka" else object())
    solvers, absent = peer_solvers()
    assert absent == ["heyoka"]
    assert "heyoka" not in [s.name for s in solvers]


@pytest.mark.parametrize("name", ["SciPy events", "heyoka", "CVODE"])
def test_installed_peers_follow_the_sine_and_its_end(name: str) -> None:
    peer = next((s for s in peer_solvers()[0] if s.name == name), None)
    if peer is None:
        pytest.skip(f"{name} is not installed")
    task = Task("sine", sine(3.0, 3.0))
    reference = solver("taylor").run(task, None)
    found = difference(peer.run(task, 1e-12), reference, sample_times(reference))
    assert found.rotation < 1e-9
    assert found.impacts < 1e-10
    # A contact during the wave, then its end in mid-flight: the end is no second contact.
    pulse = sine(1.5, 2.0)
    cut = peer.run(Task("to the end of the wave", pulse, duration=pulse.duration), 1e-12)
    assert cut.impacts.size == 1
    assert cut.overturned is True


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """A chart of two methods, one peer left out, and two rows: all parts, little work."""
    kept = [solver("taylor"), solver("closed-form")]
    quick = [dataclasses.replace(s, quick=(1e-6,) if s.knob == TOLERANCE else ()) for s in kept]
    monkeypatch.setattr(chart_module, "own_solvers", lambda: quick)
    monkeypatch.setattr(chart_module, "peer_solvers", lambda: ([], ["heyoka", "CVODE"]))
    monkeypatch.setattr(chart_module, "rows", lambda **_: [rows(quick=True)[k] for k in (1, 3)])


@pytest.mark.usefixtures("small")
@pytest.mark.parametrize("ending", ["png", "svg"])
def test_the_command_writes_picture_and_points(ending: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "new" / f"chart.{ending}"
    assert main(["chart", "--quick", "--out", str(out)]) == 0
    assert out.stat().st_size > 20_000
    said = capsys.readouterr()
    assert "absent     heyoka, CVODE" in said.out
    assert said.err == ""
    with out.with_suffix(".csv").open(encoding="utf-8", newline="") as file:
        lines = list(csv.DictReader(file))
    assert tuple(lines[0]) == COLUMNS
    assert {line["panel"] for line in lines} == {"trajectory", "map", "failures"}
    refused = [line for line in lines if line["verdict"] == "refused"]
    assert all(line["reason"] for line in refused)


@pytest.mark.usefixtures("small")
def test_json_and_a_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    t = np.arange(0.0, 2.0, 0.01)
    record = tmp_path / "quake.csv"
    record.write_text(
        "time_s,acceleration_m_s2\n" + "\n".join(f"{x:.2f},{4.0 * math.sin(8.0 * x):.6f}" for x in t), encoding="utf-8"
    )
    arguments = ["chart", "--quick", "--json", "--record", str(record), "--out", str(tmp_path / "c.png")]
    assert main(arguments) == 0
    data = json.loads(capsys.readouterr().out)
    assert set(data["references"]) == {"free", "sine", "record"}
    assert any(p["case"] == "record" and p["time_s"] > 0.0 for p in data["points"])


@pytest.mark.usefixtures("small")
def test_a_default_that_is_wrong_is_an_exit_code(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    wrong = Row(1, "a wrong answer", (Check(FREE, Quantity.REST, 1.0, 1e-9),))
    monkeypatch.setattr(chart_module, "rows", lambda **_: [wrong])
    assert main(["chart", "--quick", "--out", str(tmp_path / "c.png")]) == 1
    assert "taylor, a wrong answer" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--out", "chart.xyz"], "ends in .png"),
        (["--record", "nowhere.at2"], "nowhere.at2"),
        (["--scale", "2"], "--record"),
        (["--record", "nowhere.at2", "--scale", "nan"], "finite"),
    ],
)
def test_bad_input_is_one_sentence(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["chart", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.count("\n") == 1


@pytest.mark.usefixtures("small")
def test_ctrl_c_keeps_the_points(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def stop(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(chart_module, "map_truth", stop)
    assert main(["chart", "--quick", "--out", str(tmp_path / "c.png")]) == 1
    assert "stopped" in capsys.readouterr().err
    assert (tmp_path / "c.csv").read_text(encoding="utf-8").count("\n") > 3
    assert not (tmp_path / "c.png").exists()


def test_a_table_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(InputError, match="cannot be written"):
        write_table(Chart(True, [], []), tmp_path / "file" / "points.csv")


def test_every_job_has_a_name_and_an_empty_chart_an_empty_table() -> None:
    chart = new_chart(quick=True)
    names = [name for name, _ in jobs(chart, None)]
    assert len(set(names)) == len(names)
    assert table(chart) == []
    assert B6L.slenderness == FREE.block.slenderness
