"""`twin tune` on the emulated ST-III, and what later plans and runs make of what it kept."""

from __future__ import annotations

import argparse
import itertools
import json
from dataclasses import replace
from pathlib import Path

import pytest

from devices.catalogue import find_device
from devices.clock import ManualClock
from tests.twin.conftest import SHORT, SINE
from twin.cli import main
from twin.commands.connection import connect
from twin.commands.replay import live_twin
from twin.commands.tuned_run import TunedRun, reproduced, tuned_run
from twin.errors import InputError
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import rehearse
from twin.scene import Scene, load_scene
from twin.tuned_folder import keep, read
from twin.tuning.play import Measured

_channels = itertools.count()
# The pauses of the shortest scenes are 0.1 s; a correction takes what it needs of them.
TEXT = SHORT.format(block="mass_kg = 2.5692", excitation=SINE).replace("settle_s = 0.1", "settle_s = 0.4")


@pytest.fixture(scope="module")
def tuned(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict]:
    """One tuning by the command itself: the folder with scene, picture and kept command, and what `--json` said."""
    folder = tmp_path_factory.mktemp("tune")
    (folder / "mine.toml").write_text(TEXT, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        said: list[str] = []
        patch.setattr("builtins.print", lambda text="", **_: said.append(str(text)))
        assert main(["tune", "mine.toml", "--json", "--out", "new/tune.png"]) == 0
    return folder, json.loads(said[-1])


def options(folder: Path, **changes) -> argparse.Namespace:
    given = {"device": "emulator", "bus": "virtual", "channel": f"tuned-{next(_channels)}", "bus_option": [],
             "tuned": folder / "tuned", "untuned": False}  # fmt: skip
    return argparse.Namespace(**given | changes)


def looked_up(scene: Scene, folder: Path, **changes) -> TunedRun:
    entry = find_device("quanser_st3")
    return tuned_run(options(folder, **changes), entry, rehearse(scene, entry.capacity))


def reproduction(scene: Scene, folder: Path, **changes) -> float:
    """Perform the scene with its specimen, and return the rms error of the base acceleration, of the asked peak."""
    entry = find_device("quanser_st3")
    given = options(folder, **changes)
    rehearsal = rehearse(scene, entry.capacity)
    run = tuned_run(given, entry, rehearsal)
    clock, measured = ManualClock(), Measured()
    with connect(given, scene, entry, entry.capacity, clock=clock) as link, link.table as table:
        run.check(table)
        table.enable(rehearsal.motion.displacement(0.0))
        report = perform(
            table,
            rehearsal.motion,
            live_twin(scene),
            measured,
            clock,
            after=rehearsal.after,
            targets=run.targets,
            watch=Watch(release=link.release),
        )
    assert report.tripped is None
    achieved = reproduced(rehearsal, measured)
    assert achieved is not None
    return achieved.rms


def test_the_error_falls_and_the_command_is_kept(tuned: tuple[Path, dict]) -> None:
    folder, said = tuned
    assert said["improved"] is True
    assert said["reason"] == "converged: the error no longer falls"
    assert said["before"]["rms"] > 0.1
    assert said["after"]["rms"] < 0.01
    assert said["runs"] == 3 * (len(said["steps"]) + 1)
    command = read(folder / said["kept"])
    assert command.after.rms == said["after"]["rms"]
    assert command.purpose.machine == "emulator"
    assert command.payload == command.purpose.payload == 2.5692
    assert (folder / "new" / "tune.png").stat().st_size > 10_000


def test_a_later_run_with_the_specimen_uses_it(tuned: tuple[Path, dict]) -> None:
    folder, said = tuned
    scene = load_scene(str(folder / "mine.toml"))
    after, before = (reproduction(scene, folder, untuned=untuned) for untuned in (False, True))
    assert before == pytest.approx(said["before"]["rms"], rel=0.1)
    assert after < 0.015
    run = looked_up(scene, folder)
    assert run.data["used"] == "yes"
    assert float(run.data["remaining_rms"]) == said["after"]["rms"]
    (line,) = run.lines
    assert f"{said['after']['rms']:.2%} rms" in line
    assert said["kept"] in line


def test_untuned_is_said(tuned: tuple[Path, dict]) -> None:
    folder, said = tuned
    run = looked_up(load_scene(str(folder / "mine.toml")), folder, untuned=True)
    assert run.targets is None
    assert run.data == {"used": "no", "reason": f"no: --untuned; {folder / said['kept']} is there"}


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("frequency_hz = 4", "frequency_hz = 4.1", "no: the table is sent the command as asked"),
        ("[twin]", "[twin]\ncycle_hz = 500", "is for another cycle time: not used"),
        ("mass_kg = 2.5692", "mass_kg = 3", "is for another payload: not used"),
    ],
)
def test_another_run_does_not_get_it(old: str, new: str, said: str, tuned: tuple[Path, dict], tmp_path: Path) -> None:
    changed = tmp_path / "mine.toml"
    changed.write_text(TEXT.replace(old, new), encoding="utf-8")
    run = looked_up(load_scene(str(changed)), tuned[0])
    assert run.targets is None
    assert said in run.lines[0]


def test_another_capacity_or_the_real_table_does_not_get_it(tuned: tuple[Path, dict]) -> None:
    folder, _ = tuned
    scene, entry = load_scene(str(folder / "mine.toml")), find_device("quanser_st3")
    other = rehearse(scene, entry.capacity.model_copy(update={"velocity": 0.5}))
    assert "is for another capacity: not used" in tuned_run(options(folder), entry, other).lines[0]
    real = tuned_run(options(folder, device="quanser_st3"), entry, rehearse(scene, entry.capacity))
    assert real.targets is None
    assert "is for another machine, set of the emulator's numbers: not used" in real.lines[0]


def test_another_machine_of_the_same_kind_is_refused(tuned: tuple[Path, dict], tmp_path: Path) -> None:
    folder, said = tuned
    scene, entry = load_scene(str(folder / "mine.toml")), find_device("quanser_st3")
    command = read(folder / said["kept"])
    keep(tmp_path / "tuned", command.model_copy(update={"identity": "1-2-3-4"}))
    given = options(tmp_path)
    run = tuned_run(given, entry, rehearse(scene, entry.capacity))
    with connect(given, scene, entry, entry.capacity) as link, link.table as table:
        with pytest.raises(InputError, match=r"was made on the machine 1-2-3-4; this one is 7FFFFFFF-"):
            run.check(table)
        targets = list(run.targets or ())
        targets[1500] += 0.01
        with pytest.raises(InputError, match=r"set-point of cycle 1500 asks .*; quanser_st3 has .*; give --untuned"):
            replace(run, targets=targets, command=command).check(table)


def test_the_plan_knows_both(tuned: tuple[Path, dict], monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    folder, said = tuned
    monkeypatch.chdir(folder)
    assert main(["plan", "mine.toml", "--out", "plan.png"]) == 0
    lines = [line for line in capsys.readouterr().out.splitlines() if line.startswith("achieved")]
    assert len(lines) == 2
    assert lines[0].startswith("achieved   as asked (measured by twin tune on ")
    assert f"error {said['before']['rms']:.2%} rms" in lines[0]
    assert lines[1].startswith("achieved   corrected (measured by twin tune on ")
    assert f"error {said['after']['rms']:.2%} rms" in lines[1]
    assert "block rocked, peak 0.0" in lines[1]
    main(["plan", "mine.toml", "--json"])
    asked, corrected = json.loads(capsys.readouterr().out)["achieved"]
    assert corrected["rms"] == said["after"]["rms"]
    # A lag alone does not matter to the block.
    peak = rehearse(load_scene("mine.toml"), find_device("quanser_st3").capacity).response.peak_rotation
    assert [asked["peak_rotation_rad"], corrected["peak_rotation_rad"]] == pytest.approx([peak] * 2, rel=0.02)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["b6l_free"], "nothing shakes: there is no pulse to tune"),
        (["b6l_constant"], "air_track is set by hand and released: it follows no command that could be corrected"),
        (["b6l_sine", "--repeats", "1"], "--repeats is 1; it must be at least 2"),
        (["b6l_sine", "--corrections", "0"], "--corrections is 0; it must be at least 1"),
        (["b6l_sine", "--payload-kg", "101"], "--payload-kg is 101; it must be 0 to 100 kg"),
        (["b6l_sine", "--payload-kg", "nan"], "--payload-kg is nan"),
        (["b6l_sine", "--out", "tune.txt"], "a picture ends in .png, .svg or .pdf"),
        (["b6l_sine", "--device", "quanser_st3"], "needs the bus it is on: give --bus"),
        (["nowhere"], "no scene named 'nowhere'"),
    ],
)
def test_what_cannot_be_tuned_is_one_sentence(arguments: list[str], words: str, tmp_path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["tune", *arguments]) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_a_scene_with_faults_is_not_tuned(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "faulty.toml"
    path.write_text(TEXT + '\n[[fault]]\nname = "sync_lost"\nat_s = 1.0\n', encoding="utf-8")
    assert main(["tune", str(path)]) == 2
    assert "a table with faults cannot be tuned" in capsys.readouterr().err


def test_a_real_table_asks_first(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["tune", "b6l_sine", "--device", "quanser_st3", "--bus", "udp_multicast", "--arm"]
    assert main(arguments) == 2
    said = capsys.readouterr()
    assert "TAKE THE SPECIMEN OFF; fix a dead mass of 2.5692 kg in its place" in said.out
    assert "it is confirmed at a terminal, which this is not" in said.err


def test_a_run_that_trips_ends_it_and_nothing_is_kept(tmp_path: Path, monkeypatch, capsys) -> None:
    monkeypatch.chdir(tmp_path)
    Path("tight.toml").write_text(
        TEXT.replace("[twin]", "[trips.following_error]\nlimit_mm = 0.5\n[twin]"), encoding="utf-8"
    )
    assert main(["tune", "tight.toml", "--json"]) == 1
    said = capsys.readouterr()
    assert "nothing is kept: following_error: the table is" in said.err
    assert json.loads(said.out)["kept"] is None
    assert not Path("tuned").exists()


def test_what_the_capacity_holds_back_is_said(tmp_path: Path, monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    """A pulse at the very acceleration of a table whose loop has to be told more than it shall do."""
    monkeypatch.chdir(tmp_path)
    Path("slow.toml").write_text(
        'name = "slow"\nstroke_mm = 216\nvelocity_m_s = 0.0375\nacceleration_g = 0.3\n', encoding="utf-8"
    )
    text = TEXT.replace("frequency_hz = 4", "frequency_hz = 25").replace(
        'device = "quanser_st3"', 'device = "quanser_st3"\ncapacity_file = "slow.toml"'
    )
    Path("mine.toml").write_text(text, encoding="utf-8")
    assert main(["tune", "mine.toml", "--corrections", "3"]) == 0
    said = capsys.readouterr().out
    assert "gain reduced by the capacity: set-point of cycle" in said
    assert "ended      no room inside the capacity for a further correction: set-point of cycle" in said
    assert "slow has 2.943 m/s2" in said
