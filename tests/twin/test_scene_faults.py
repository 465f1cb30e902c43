"""`[[fault]]` in a scene and `--fault`: what is taken, what is refused in one sentence, and where it may act."""

from __future__ import annotations

import argparse
from pathlib import Path

import pytest

from devices.faults.catalogue import FAULTS
from tests.twin.conftest import SHORT, SINE
from twin.cli import main
from twin.commands.connection import device_for
from twin.commands.injection import injector_for, with_asked_faults
from twin.errors import InputError
from twin.scene import Scene, parse_scene, parse_scene_json


def scene(faults: str = "") -> Scene:
    text = SHORT.format(block="", excitation=SINE) + faults
    return parse_scene(text, name="faulty", folder=Path())


def asked(*faults: str, **options: object) -> argparse.Namespace:
    return argparse.Namespace(
        **{"fault": list(faults), "device": "emulator", "bus": "virtual", "channel": None, "bus_option": []} | options
    )


def test_a_scene_has_no_faults_unless_told() -> None:
    assert scene().fault == ()
    assert injector_for(scene(), None, "host", "emulator") is None


def test_faults_of_a_scene() -> None:
    given = scene(
        '[[fault]]\nname = "bus_off"\nat_s = 1\nduration_s = 0.25\n'
        '[[fault]]\nname = "sync_lost"\nat_s = 2.5\nmagnitude = 3\n'
    )
    first, second = (part.fault() for part in given.fault)
    assert (first.name, first.at, first.duration) == ("bus_off", 1.0, 0.25)
    assert (second.name, second.at, second.magnitude) == ("sync_lost", 2.5, 3.0)
    # a recording holds it, and gives it back
    again = parse_scene_json(given.model_dump_json(), name="faulty", folder=Path())
    assert again == given


@pytest.mark.parametrize(
    ("fault", "words"),
    [
        ('name = "sync_lots"\nat_s = 1', "did you mean sync_lost?"),
        ('name = "sync_lost"', "fault.0.at_s is missing"),
        ('name = "sync_lost"\nat_s = -1', "fault.0.at_s: input should be greater than or equal to 0"),
        ('name = "sync_lost"\nat_s = 1\nmagnitude = 0.5', "must be 1 to 10000"),
        ('name = "operator_stop"\nat_s = 1\nduration_s = 1', "happens in an instant"),
        ('name = "bus_off"\nat_s = 1\nduration = 1', "is not a key here; did you mean duration_s?"),
    ],
)
def test_what_a_scene_cannot_ask_for(fault: str, words: str) -> None:
    with pytest.raises(InputError) as refused:
        scene(f"[[fault]]\n{fault}\n")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


def test_faults_of_the_command_line_come_after_the_scenes_own() -> None:
    own = scene('[[fault]]\nname = "bus_off"\nat_s = 1\n')
    both = with_asked_faults(own, asked("sync_lost@2.5:3", "operator_stop@3"), None)
    assert [part.name for part in both.fault] == ["bus_off", "sync_lost", "operator_stop"]
    assert (both.name, both.folder) == (own.name, own.folder)
    assert with_asked_faults(own, asked(), None) is own


@pytest.mark.parametrize("fault", ["sync_lost", "sync_lost@x", "nonsense@1", "sync_lost@1:0"])
def test_what_the_command_line_cannot_ask_for(fault: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "b6l_sine", "--fault", fault]) == 2
    said = capsys.readouterr()
    assert said.err.startswith("twin run: --fault: ")
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_a_real_device_refuses_them(capsys: pytest.CaptureFixture[str]) -> None:
    words = "fault sync_lost: a fault may be injected into emulators only; quanser_st3 is real"
    with_fault = scene('[[fault]]\nname = "sync_lost"\nat_s = 1\n')
    with pytest.raises(InputError, match=words):
        device_for(asked(device="quanser_st3", bus="socketcan"), with_fault)
    command = ["run", "b6l_sine", "--device", "quanser_st3", "--bus", "socketcan", "--fault", "sync_lost@1"]
    assert main(command) == 2
    assert words in capsys.readouterr().err


@pytest.mark.parametrize(
    ("side", "fault", "words"),
    [
        ("host", "encoder_frozen@1", "encoder_frozen acts in the emulator: give it to `twin emulate`"),
        ("emulator", "operator_stop@1", "operator_stop acts in the host: give it to `twin run`"),
    ],
)
def test_a_fault_of_the_other_process(side, fault: str, words: str) -> None:
    with pytest.raises(InputError, match=words):
        with_asked_faults(scene(), asked(fault), side)


def test_each_process_takes_its_own_of_a_scene() -> None:
    both = scene('[[fault]]\nname = "operator_stop"\nat_s = 1\n[[fault]]\nname = "encoder_frozen"\nat_s = 1\n')

    def names(*sides) -> list[str]:
        injector = injector_for(both, None, *sides)
        return [] if injector is None else [fault.name for fault in injector.schedule.faults]

    assert names("host") == ["operator_stop"]
    assert names("emulator") == ["encoder_frozen"]
    assert names("host", "emulator") == ["operator_stop", "encoder_frozen"]


def test_the_list(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main(["run", "--fault", "list"])
    assert ended.value.code == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(FAULTS)
