"""The walk-through of a new device, done as it stands there: built, installed, run."""

from __future__ import annotations

import argparse
import itertools
import re
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from devices import installed
from devices.catalogue import find_device, unusable_devices
from devices.clock import ManualClock
from devices.installed import GROUP
from tests.devices.capacity_contract import LIMITS, cases, check_beyond, check_just_above, check_within
from tests.twin.conftest import Kept
from twin.cli import main
from twin.commands.connection import connect
from twin.commands.replay import live_twin
from twin.live import perform
from twin.live_loop import Watch
from twin.rehearsal import rehearse
from twin.scene import load_scene

PAGE = Path(__file__).resolve().parent.parent / "docs" / "new_device.md"
_channels = itertools.count()


def files_of(page: str) -> dict[str, str]:
    """Return the files of the page: name -> text."""
    found = re.findall(
        r"^\*\*`([^`]+)`\*\*[^`]*?(?:`[^`]*`[^`]*?)*?\n\n```(?:python|toml)\n(.*?)```", page, re.M | re.S
    )
    return dict(found)


FILES = files_of(PAGE.read_text(encoding="utf-8"))


@pytest.fixture
def scene_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Install the package of the page for this test, as pip would, and return the path of its scene."""
    site = tmp_path / "site"
    for name, text in FILES.items():
        path = site / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    project = tomllib.loads(FILES["pyproject.toml"])["project"]
    points = project["entry-points"][GROUP]
    info = site / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n")
    (info / "entry_points.txt").write_text(
        f"[{GROUP}]\n" + "".join(f"{name} = {package}\n" for name, package in points.items())
    )
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setattr(installed, "site_folders", lambda: [site])
    monkeypatch.chdir(tmp_path)
    yield site / "bench_sine.toml"
    for module in [name for name in sys.modules if name.partition(".")[0] in points]:
        del sys.modules[module]


def test_the_page_has_the_files_every_device_has_in_under_100_lines() -> None:
    names = [Path(name).name for name in FILES]
    assert names == ["pyproject.toml", "__init__.py", "capacity.toml", "capacity.py", "driver.py", "emulator.py",
                     "bench_sine.toml"]  # fmt: skip
    assert sum(len(text.splitlines()) for text in FILES.values()) < 100


def test_it_is_found_and_whole(scene_path: Path) -> None:
    entry = find_device("bench_table")
    assert entry.capacity.name == "bench_table"
    assert entry.description == "Bench table of our laboratory: one axis, ball screw, CiA 402 drive"
    assert entry.has_driver
    assert entry.emulator.__name__ == "EmulatedBenchTable"
    assert unusable_devices() == []


def test_it_can_be_planned_for(scene_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["plan", str(scene_path)]) == 0
    said = capsys.readouterr().out
    assert "bench_table: 120 mm, 0.4 m/s, 5.886 m/s2" in said
    assert "feasible as asked; the block rocks and stays up" in said


def test_a_scene_runs_on_it(scene_path: Path) -> None:
    scene = load_scene(str(scene_path))
    entry = find_device("bench_table")
    rehearsal = rehearse(scene, entry.capacity)
    options = argparse.Namespace(bus="virtual", channel=f"bench-{next(_channels)}", bus_option=[])
    clock, kept = ManualClock(), Kept()
    with connect(options, scene, entry, entry.capacity, clock=clock) as link, link.table as table:
        table.enable(rehearsal.motion.displacement(0.0))
        report = perform(
            table,
            rehearsal.motion,
            live_twin(scene),
            kept,
            clock,
            trips=scene.trips,
            after=rehearsal.after,
            watch=Watch(release=link.release),
        )
    assert report.tripped is None
    assert report.predicted_outcome == report.measured_outcome == "rocked"
    # It is the bench table that was emulated: slower, and with the encoder of the page.
    positions = {round(record.position / 5e-6, 3) for record in kept.cycles}
    assert all(abs(place - round(place)) < 1e-2 for place in positions)


def test_it_keeps_the_capacity_contract(scene_path: Path) -> None:
    entry = find_device("bench_table")
    found = list(cases(entry.capacity))
    assert {case.limit for case in found} == set(LIMITS)
    for case in found:
        check_within(entry, case, 1.0)
        check_just_above(case)
        check_beyond(entry, case)


def test_it_is_tuned_like_any_other(scene_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["tune", str(scene_path), "--corrections", "2", "--repeats", "2"]) == 0
    assert "kept       tuned/bench_table/emulator-" in capsys.readouterr().out
