"""What the emulated table is given by the scene, and what the command line cannot ask of a bus."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from devices.catalogue import find_device
from devices.cia301.buses import open_bus
from devices.cia402.master import Cia402Table
from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.emulator import EmulatedSt3
from devices.sample import Sample
from tests.twin.conftest import FREE, SINE, short_scene
from twin.commands.connection import bus_of, connect, device_for, emulate
from twin.commands.emulate import run as serve_emulator
from twin.errors import InputError
from twin.scene import Scene, parse_scene
from twin.specimen import specimen_of
from twin.stopping import longest_stop, stop_deceleration


def options(*bus_options: str, bus: str = "udp_multicast", device: str = "emulator") -> argparse.Namespace:
    return argparse.Namespace(device=device, bus=bus, channel=None, bus_option=list(bus_options))


def scene_of_width(width: float) -> Scene:
    text = '[block]\nwidth_mm = {}\nheight_mm = 270\n[excitation]\n{}\n[table]\ndevice = "quanser_st3"\n'
    return parse_scene(text.format(width, SINE), name="wide", folder=short_scene().folder)


@pytest.mark.parametrize(
    ("option", "words"),
    [
        ("interface=socketcan", "cannot set interface; give --bus"),
        ("bustype=socketcan", "cannot set bustype; give --bus"),
        ("channel=can0", "cannot set channel; give --channel"),
        ("ignore_config=0", "cannot set ignore_config"),
        ("bitrate", "is not KEY=VALUE"),
        ("a b=1", "is not KEY=VALUE"),
        ("bitrate=500000", "bitrate is no option of a bus that stays on this machine; port is"),
        ("port=99999", "port is 99999; it must be 1 to 65535"),
    ],
)
def test_bus_options_that_cannot_be_are_one_sentence(option: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as error:
        bus_of(options(option))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("hops", ["1", "255", "-1", "x"])
def test_the_emulator_is_not_looked_for_in_the_network(hops: str) -> None:
    with pytest.raises(InputError, match=r"hop_limit opens the bus to the network.*--device quanser_st3"):
        device_for(options(f"hop_limit={hops}"), short_scene())


def test_a_bus_on_this_machine_is_taken() -> None:
    assert device_for(options("hop_limit=0", "port=43999"), short_scene()).name == "quanser_st3"
    assert device_for(options(bus="virtual"), short_scene()).name == "quanser_st3"


def test_the_stop_is_half_of_what_lifts_the_block() -> None:
    scene = short_scene()
    assert stop_deceleration(scene, CAPACITY) == pytest.approx(0.5 * 9.81 * 60 / 270)
    wide = scene_of_width(2700)
    assert stop_deceleration(wide, CAPACITY) == CAPACITY.acceleration == 9.81
    assert longest_stop(scene, CAPACITY) == pytest.approx(math.sqrt(2 * 0.216 / 1.09))


@pytest.mark.parametrize("shared", [True, False])
def test_the_emulated_drive_is_set_up_from_the_scene(shared: bool) -> None:
    entry, scene = find_device("quanser_st3"), scene_of_width(30)
    with open_bus("virtual", f"set up {shared}") as bus:
        made = emulate(entry, bus, scene, entry.capacity, specimen_of(scene), shared_clock=shared)
        given = made.drive.options
    assert given.stop_deceleration == pytest.approx(0.5 * 9.81 * 30 / 270)
    assert given.patience == 20
    assert given.shared_clock is shared


def impatient(device: str = "quanser_st3", patience_ms: float = 50) -> Scene:
    scene = short_scene()
    table = scene.table.model_copy(update={"device": device, "patience_ms": patience_ms})
    return scene.model_copy(update={"table": table})


def test_host_and_drive_wait_as_long_as_the_scene_says() -> None:
    scene, entry = impatient(), find_device("quanser_st3")
    with connect(options(bus="virtual"), scene, entry, entry.capacity) as link, link.table as table:
        assert isinstance(table, Cia402Table)
        assert table.objects.read(0x2010) == 50


@pytest.mark.parametrize("device", ["air_track", "roori1"])
def test_nodes_that_cannot_be_told_to_wait_are_not(device: str) -> None:
    entry = find_device(device)
    wanted = f"patience_ms: the nodes of {device} cannot be told"
    with (
        pytest.raises(InputError, match=wanted),
        connect(options(bus="virtual"), impatient(device), entry, entry.capacity),
    ):
        pass


def test_a_stop_does_not_rock_the_block() -> None:
    """A slender block, a stop from cruising: 1 m/s2, the drive's own number, would lift it at 0.73 m/s2."""
    scene = scene_of_width(20)
    entry = find_device("quanser_st3")
    way: list[Sample] = []
    with connect(options(bus="virtual"), scene, entry, entry.capacity) as link, link.table as table:
        table.enable(0.0)
        x = v = 0.0
        for cycle in range(600):
            # half a second of speeding up under half of g tan(alpha), then cruising
            v = min(0.15, v + 0.35e-3)
            x += v * 1e-3
            table.exchange(cycle, x)
        table.quick_stop(way.append)
    # the sensor's noise is 0.2 mrad
    assert max(abs(sample.rotation) for sample in way) < 1.5e-3
    assert len(way) * 1e-3 == pytest.approx(0.15 / (0.5 * 9.81 * 20 / 270), abs=0.05)


def test_a_specimen_is_set_up_again() -> None:
    scene = short_scene(FREE, "initial_rotation_deg = 5")
    for held in (True, False):
        specimen = specimen_of(scene, held=held)
        tilt = specimen.rotation
        assert tilt == math.radians(5)
        for _ in range(2):
            assert (specimen(0.01, 0.0, 0.0) == tilt) is held
            specimen.release()
            for _ in range(50):
                specimen(0.01, 0.0, 0.0)
            assert specimen.rotation != tilt
            specimen.set_up()
            assert specimen.rotation == tilt


def test_two_runs_on_one_emulator_are_the_same_run() -> None:
    scene = short_scene(FREE, "initial_rotation_deg = 5")
    entry = find_device("quanser_st3")
    rotations = []
    with connect(options(bus="virtual"), scene, entry, entry.capacity) as link, link.table as table:
        for _ in range(2):
            table.enable(0.0)
            run = []
            for cycle in range(300):
                run.append(table.exchange(cycle, 0.0).rotation)
                if cycle == 0:
                    link.release()
            rotations.append(run)
            table.disable()
    assert rotations[0][0] == pytest.approx(math.radians(5), abs=1e-3)
    # but for the sensor's noise of 0.2 mrad
    assert rotations[1] == pytest.approx(rotations[0], abs=3e-3)
    assert min(rotations[0]) < 0.0


def test_the_emulator_serves_as_the_host_cycles(monkeypatch, capsys: pytest.CaptureFixture[str]) -> None:
    served: list[bool] = []
    inside: list[str] = []

    @contextmanager
    def real_time() -> Iterator[str]:
        inside.append("in")
        yield "as fast as it goes"
        inside.pop()

    monkeypatch.setattr("twin.commands.emulate.real_time", real_time)
    monkeypatch.setattr("twin.commands.emulate.bus_of", lambda _: open_bus("virtual", "served"))
    monkeypatch.setattr(EmulatedSt3, "serve", lambda *_: served.append(bool(inside)))
    monkeypatch.setattr("signal.signal", lambda *_: None)
    asked = argparse.Namespace(scene="b6l_free", record=None, scale=1.0, bus="udp_multicast", json=True, fault=[])
    assert serve_emulator(asked) == 0
    assert served == [True]
    assert json.loads(capsys.readouterr().out)["scheduling"] == "as fast as it goes"
