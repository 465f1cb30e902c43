"""Nothing real moves unarmed; staged levels; simulated time; a kept trip is acknowledged by name."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from twin.cli import main
from twin.commands.latch import LATCHES, latch
from twin.commands.operator import Operator
from twin.scene import load_scene

REAL = ["--device", "quanser_st3", "--bus", "socketcan", "--channel", "can9"]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_real_table_is_a_dry_run_unless_armed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", *REAL, "--gain", "0.25"]) == 0
    said = capsys.readouterr()
    assert "dry run    nothing moved" in said.err
    assert "gain       0.25 of the whole pulse" in said.out
    assert "limits     the base stays within +-108.0 mm" in said.out
    assert not Path("runs").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["run", "--arm"], "--arm belongs to a real table"),
        (["run", "--gain", "0"], "--gain is 0; it must be above 0 and at most 1"),
        (["run", "--gain", "1.5"], "--gain is 1.5"),
        (["run", "--gain", "nan"], "--gain is nan"),
        (["run", "--fast", "--bus", "udp_multicast"], "--fast is simulated time"),
    ],
)
def test_what_does_not_go_together(arguments: list[str], said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(arguments) == 2
    assert said in capsys.readouterr().err


def test_a_kept_trip_holds_an_armed_run(capsys: pytest.CaptureFixture[str]) -> None:
    latch("quanser_st3", "following_error: 21 mm", Path("runs/a.mcap"), LATCHES)
    assert main(["run", *REAL, "--arm"]) == 2
    assert "acknowledge it with --reset" in capsys.readouterr().err
    assert main(["run", *REAL]) == 0, "a dry run says what would happen"


def test_simulated_time_gives_the_same_recording_twice(capsys: pytest.CaptureFixture[str]) -> None:
    seen = []
    for name in ("one", "two"):
        assert main(["run", "b6l_free", "--fast", "--json", "--out", f"{name}.mcap"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert said["scheduling"] == "simulated time"
        seen.append((said["predicted"], said["measured"], said["cycles"]["executed"], said["cycles"]["missed"]))
    assert seen[0] == seen[1]
    assert seen[0][3] == 0
    assert main(["replay", "one.mcap"]) == 0
    assert "bit for bit" in capsys.readouterr().out


def test_the_gain_scales_the_whole_pulse() -> None:
    scene = load_scene("b6l_sine")
    full, quarter = scene.pulse(), scene.with_gain(0.25).pulse()
    assert full is not None
    assert quarter is not None
    assert quarter.peak_acceleration == pytest.approx(0.25 * full.peak_acceleration)
    assert quarter.duration == full.duration


def test_a_second_signal_cuts_the_power() -> None:
    operator = Operator()
    assert operator.stopped() is None
    operator.ask(2)
    assert operator.words() == "operator: stop was asked (SIGINT)"
    assert not operator.cut()
    operator.ask(15)
    assert operator.cut()
    assert operator.words() == "operator: stop was asked (SIGINT)"
