"""`twin devices`: what there is, and who answers."""

from __future__ import annotations

import argparse
import itertools
import json

import pytest

from devices.catalogue import CatalogueEntry, catalogue, find_device
from devices.cia301 import frames
from devices.cia301.buses import open_bus
from devices.errors import DeviceTimeout
from devices.faults.catalogue import FAULTS
from twin.cli import main
from twin.commands import device_check
from twin.errors import InputError

_channels = itertools.count()


def test_every_machine_is_listed_with_its_numbers_and_their_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices"]) == 0
    said = capsys.readouterr().out
    for name, entry in catalogue().items():
        assert f"device     {name}: {entry.description}" in said
        for source in entry.capacity.provenance.values():
            assert source in said
    assert "stroke 216 mm " in said
    assert "driver: The ST-III over CiA 402" in said
    assert "--bus virtual: inside one process" in said
    assert all(fault in said for fault in FAULTS)
    assert "PROBLEM" not in said


def test_as_data(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", "--json"]) == 0
    data = json.loads(capsys.readouterr().out)
    table = data["devices"]["quanser_st3"]
    assert table["capacity"]["stroke"] == pytest.approx(0.216)
    assert "placeholder" in table["capacity"]["provenance"]["stroke"]
    assert "driver" in table["drivers"]
    assert table["emulator"] is True
    assert data["buses"][0]["interface"] == "virtual"
    assert data["faults"].keys() == FAULTS.keys()
    assert data["problems"] == []


def test_a_device_that_cannot_be_used_is_said(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    broken = CatalogueEntry("broken", "not_a_package")
    monkeypatch.setattr("twin.commands.devices.unusable_devices", lambda: ["device broken: it is"])
    monkeypatch.setattr("twin.commands.devices.catalogue", lambda: {**catalogue(), "broken": broken})
    assert main(["devices"]) == 1
    said = capsys.readouterr().out
    assert "PROBLEM    device broken: it is" in said
    assert "device     quanser_st3" in said
    assert "device     broken" not in said


@pytest.mark.parametrize("command", [["devices"], ["devices", "check"], ["tune"]])
def test_help(command: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([*command, "--help"])
    assert ended.value.code == 0
    said = capsys.readouterr().out
    assert "--json" in said
    assert "exit codes" in said


@pytest.mark.parametrize("name", ["quanser_st3", "air_track", "roori1"])
def test_the_emulated_one_answers_and_is_labelled(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", "check", name]) == 0
    said = capsys.readouterr().out
    assert "asked      THE EMULATED ONE, in this process: no real device was asked" in said
    assert "hardware emulated, software" in said
    assert "nothing moved, nothing was enabled" in said


@pytest.mark.parametrize("arguments", [["check", "quanser_st3", "--json"], ["--json", "check", "quanser_st3"]])
def test_a_check_as_data(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", *arguments]) == 0
    data = json.loads(capsys.readouterr().out)
    assert data["emulated"] is True
    assert data["position_m"] == 0.0
    drive, sensor = data["nodes"]
    assert drive["state"] == "switch on disabled"
    assert drive["mode"] == "cyclic synchronous position"
    assert {"vendor", "product", "revision", "serial", "hardware", "software"} <= set(sensor)


def test_nothing_moves_and_nothing_is_enabled(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of everything the emulated drive hears, nothing is a set-point, and it never leaves switch on disabled."""
    entry = find_device("quanser_st3")
    heard: list[int] = []
    made = []

    class Listening(entry.emulator):  # type: ignore[misc]
        def __init__(self, *arguments, **options) -> None:
            super().__init__(*arguments, **options)
            take = self.drive.receive
            self.drive.receive = lambda identifier, data: (heard.append(identifier), take(identifier, data))
            made.append(self)

    monkeypatch.setattr(CatalogueEntry, "emulator", property(lambda _: Listening))
    assert main(["devices", "check", "quanser_st3", "--json"]) == 0
    assert frames.SYNC in heard
    assert not {identifier for identifier in heard if 0x200 <= identifier < 0x580 and identifier % 0x100 < 0x80}
    assert str(made[0].drive.state) == "switch on disabled"
    assert made[0].plant.position == 0.0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["check", "nix"], "no device is called 'nix'; there are "),
        (["check", "quanser_st3", "--bus", "no_such_bus"], "CAN bus no_such_bus cannot be opened here"),
        (["check", "quanser_st3", "--bus-option", "speed"], "--bus-option speed is not KEY=VALUE"),
    ],
)
def test_what_cannot_be_is_one_sentence(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["devices", *arguments]) == 2
    said = capsys.readouterr()
    assert words in said.err
    assert said.err.count("\n") == 1
    assert said.out == ""


def test_nobody_answers(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """The wait itself is the table's (tests/devices); here, what becomes of it."""

    def open_table(bus, **options):
        raise DeviceTimeout("bench does not answer: nothing came within 0.2 s")

    monkeypatch.setattr(CatalogueEntry, "open_table", property(lambda _: open_table))
    monkeypatch.setattr(device_check, "LISTENED", 0.0)
    monkeypatch.setattr(device_check, "bus_of", lambda *_: open_bus("virtual", f"nobody {next(_channels)}"))
    assert main(["devices", "check", "quanser_st3", "--bus", "socketcan", "--channel", "can0"]) == 2
    assert capsys.readouterr().err == "twin devices: bench does not answer: nothing came within 0.2 s\n"


def test_a_table_without_a_sensor_answers_too(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    entry = find_device("quanser_st3")
    emulator = entry.emulator

    def without(bus, *, rng, specimen):
        return emulator(bus, rng=rng)

    monkeypatch.setattr(CatalogueEntry, "emulator", property(lambda _: without))
    assert main(["devices", "check", "quanser_st3", "--json"]) == 0
    assert [node["what"] for node in json.loads(capsys.readouterr().out)["nodes"]] == ["servo drive"]


def test_a_running_host_is_not_disturbed(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its SYNC is heard before anything is sent."""
    channel = f"busy {next(_channels)}"
    with open_bus("virtual", channel) as host, open_bus("virtual", channel) as tap:
        own = open_bus("virtual", channel)
        monkeypatch.setattr(device_check, "bus_of", lambda *_: own)
        host.send(frames.SYNC, frames.pack_sync(1))
        tap.receive()
        options = argparse.Namespace(name="quanser_st3", bus="socketcan", channel="can0", bus_option=[], json=False)
        with pytest.raises(
            InputError, match=r"a host is running a table on .*: its SYNC is heard, and nothing was sent"
        ):
            device_check.check(options)
        assert tap.receive() is None
