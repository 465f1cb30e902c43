"""`--driver hil`, and a user's own numbers for the emulated table."""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import pytest

from devices.catalogue import find_device
from devices.clock import ManualClock
from devices.positioning import bring_to
from tests.devices.quanser_st3.quanser_board import MovingBoard, module
from tests.twin.conftest import SHORT, SINE, Kept
from twin.cli import main
from twin.commands.connection import connect, device_for
from twin.commands.emulator_words import emulator_data, emulator_lines
from twin.commands.inputs import capacity_for, emulator_numbers
from twin.commands.replay import live_twin
from twin.errors import InputError
from twin.live import perform
from twin.rehearsal import rehearse
from twin.scene import Scene, parse_scene

CAPACITY_FILE = """
name = "ours"
stroke_mm = 216
velocity_m_s = 0.664
acceleration_g = 1.0
"""
WIRED = '[hil]\nboard = "q8_usb"\namperes_per_volt = 2.0\n'


def scene_with(folder: Path, more: str, mass: str = "mass_kg = 2.5692") -> Scene:
    (folder / "ours.toml").write_text(CAPACITY_FILE + more, encoding="utf-8")
    text = SHORT.format(block=mass, excitation=SINE).replace("[twin]", 'capacity_file = "ours.toml"\n[twin]')
    return parse_scene(text, name="ours", folder=folder)


def options(**given: object) -> argparse.Namespace:
    asked = {"device": "quanser_st3", "driver": "hil", "bus": "virtual", "channel": None, "bus_option": []}
    return argparse.Namespace(**{**asked, **given})


def test_the_command_ends_at_the_software_that_is_not_there(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "b6l_sine", "--device", "quanser_st3", "--driver", "hil"]) == 2
    said = capsys.readouterr().err.strip()
    assert said.startswith("twin run: --driver hil: quanser.hardware is not installed here: ")
    assert "\n" not in said


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ({"device": "emulator"}, "--driver hil is for a real table, the emulator speaks cia402: name the table with"),
        ({"driver": "hill"}, "quanser_st3 has no driver 'hill'; did you mean hil"),
        ({"bus": "socketcan"}, "--driver hil is on no CAN bus: leave out --bus"),
        ({"channel": "can0"}, "is on no CAN bus"),
        ({"bus_option": ["bitrate=1"]}, "is on no CAN bus"),
        ({}, "needs board and amperes_per_volt in the table .hil. of its capacity file"),
    ],
)
def test_what_cannot_be_is_said_before_anything_is_asked(
    given: dict[str, object], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("devices.quanser_st3.hil_driver.quanser_hardware", lambda: None)
    with pytest.raises(InputError, match=words):
        device_for(options(**given), scene_with(tmp_path, ""))


def test_a_run_over_the_board_from_positioning_to_the_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_with(tmp_path, WIRED)
    board = MovingBoard(ManualClock(), friction=0.0)
    board.position = 0.02
    monkeypatch.setattr("devices.quanser_st3.hil_driver.quanser_hardware", lambda: module(board))
    entry = device_for(options(), scene)
    capacity = capacity_for(scene)
    rehearsal = rehearse(scene, capacity)
    kept = Kept()
    with connect(options(), scene, entry, capacity, clock=board.clock) as link, link.table as table:
        assert table.position == pytest.approx(0.02, abs=2e-6)
        table.reset_fault()
        assert bring_to(table, 0.0, 1.0, link.clock)
        table.enable(0.0)
        report = perform(table, rehearsal.motion, live_twin(scene), kept, link.faults.clock, after=rehearsal.after)
        assert report.tripped is None
        table.disable()
    assert (report.missed, board.output, board.closed) == (0, 0.0, True)
    # the loop's lag of 7.3 ms at 0.23 m/s
    assert max(abs(c.position - c.target_position) for c in kept.cycles) < 2.5e-3
    assert report.predicted_outcome == "rocked"
    assert "HIL board q8_usb 0" in link.frames()


OWN = '[emulator]\ndelay_ms = 3\npeak_current_a = 0.5\n[emulator.provenance]\ndelay_ms = "step test"\n'


def test_a_user_s_own_numbers_reach_the_emulated_table_and_the_reports(tmp_path: Path) -> None:
    scene = scene_with(tmp_path, OWN)
    numbers, capacity = emulator_numbers(scene), capacity_for(scene)
    lines = emulator_lines(numbers, scene, capacity)
    assert lines == [
        "emulator   delay_ms = 3 [step test]",
        "emulator   peak_current_a = 0.5 [user's own number, no source given]",
        "WARNING    with 2.569 kg on it the motor makes 8.64 m/s2; the capacity says 9.81 m/s2",
    ]
    data = emulator_data(numbers)
    assert data["delay_ms"] == "3.0 [step test]"
    assert "placeholder" in data["loop_frequency_hz"]
    given = argparse.Namespace(bus="virtual", channel="own numbers", bus_option=[])
    with connect(given, scene, find_device("quanser_st3"), capacity) as link, link.table as table:
        table.enable(0.0)
        still = [table.exchange(k, 1e-6 * k * k).position for k in range(5)]
    # sent in cycle k, to be reached at its end, and three cycles on the way
    assert still == [0.0] * 5


def test_the_block_s_mass_is_the_payload(tmp_path: Path) -> None:
    positions = []
    for mass in ("", "mass_kg = 90"):
        scene = scene_with(tmp_path, "", mass)
        given = argparse.Namespace(bus="virtual", channel=f"payload {mass}", bus_option=[])
        with connect(given, scene, find_device("quanser_st3"), capacity_for(scene)) as link, link.table as table:
            table.enable(0.0)
            positions.append([table.exchange(k, 1e-6 * k * k).position for k in range(30)][-1])
    # the slower loop is further behind
    assert positions[1] < 0.7 * positions[0]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        ("[emulator]\ndelay = 3\n", "emulator has an unknown key 'delay'; it takes loop_frequency_hz"),
        ("[emulator]\ndelay_ms = -3\n", "emulator has delay = -0.003"),
        ("emulator = 3\n", "capacity has emulator = 3"),
    ],
)
def test_own_numbers_that_cannot_be_are_one_sentence(tmp_path: Path, more: str, words: str) -> None:
    with pytest.raises(InputError, match=rf"ours\.toml: {words}") as error:
        emulator_numbers(scene_with(tmp_path, more))
    assert "\n" not in str(error.value)


def test_plan_says_them_too(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    scene_with(tmp_path, OWN)
    text = SHORT.format(block="mass_kg = 2.5692", excitation=SINE)
    (tmp_path / "scene.toml").write_text(
        text.replace("[twin]", 'capacity_file = "ours.toml"\n[twin]'), encoding="utf-8"
    )
    main(["plan", str(tmp_path / "scene.toml"), "--json"])
    assert len(json.loads(capsys.readouterr().out)["emulator"]) == 3
