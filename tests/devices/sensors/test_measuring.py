"""Sensor nodes: what they send, in which unit, and what their data sheets say."""

from __future__ import annotations

import math
from importlib.resources import files

import canopen
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.cia401.release import RELEASE_OUTPUT
from devices.errors import EdsError, FrameError
from devices.sensors.accelerometer import Accelerometer
from devices.sensors.encoder import Encoder
from devices.sensors.inclinometer import apparent_tilt, inclinometer_on
from devices.sensors.measuring import (
    ACCELERATION_INPUT,
    DISPLACEMENT_INPUTS,
    INCLINOMETER,
    POSITION_ENCODER,
    acceleration_input,
    decode,
    position_encoder,
)
from devices.sensors.reading import base_acceleration, base_position, rotation_by_encoder
from devices.sensors.scale import METRE, METRE_PER_SECOND_SQUARED, counts_per_unit


class Wire:
    """Takes what one node sends."""

    def __init__(self) -> None:
        self.sent: list[tuple[int, bytes]] = []

    def __call__(self, identifier: int, data: bytes) -> None:
        self.sent.append((identifier, data))

    def answer(self, device, node: int) -> bytes:
        device.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, node))
        self.sent.clear()
        device.receive(frames.SYNC, frames.pack_sync(1))
        ((identifier, data),) = self.sent
        assert identifier == 0x180 + node
        return data


@given(st.floats(-2.0, 2.0))
def test_positions_go_in_nanometres(position: float) -> None:
    wire = Wire()
    data = wire.answer(position_encoder(2, wire, lambda: position), 2)
    assert base_position(2).value(data) == pytest.approx(position, abs=0.51e-9)
    assert int.from_bytes(data, "little", signed=True) == round(position * 1e9)


@given(st.floats(-2000.0, 2000.0))
def test_accelerations_go_in_micrometres_per_second_squared(acceleration: float) -> None:
    wire = Wire()
    data = wire.answer(acceleration_input(3, wire, lambda: acceleration), 3)
    assert base_acceleration(3).value(data) == pytest.approx(acceleration, abs=0.51e-6)


def test_what_does_not_fit_is_the_last_that_does_and_none_is_none() -> None:
    wire, reading = Wire(), [3e9]
    device = acceleration_input(3, wire, lambda: reading[0])
    assert wire.answer(device, 3) == (2**31 - 1).to_bytes(4, "little")
    reading[0] = -3e9
    assert wire.answer(device, 3) == (-(2**31) + 1).to_bytes(4, "little", signed=True)
    reading[0] = math.nan
    assert math.isnan(base_acceleration(3).value(wire.answer(device, 3)))


def test_the_same_value_by_sdo() -> None:
    wire = Wire()
    device = position_encoder(2, wire, lambda: -0.25)
    assert device.node.objects.get(0x6004) == -250_000_000
    assert acceleration_input(3, wire, lambda: 9.81).node.objects.get(0x9130, 1) == 9_810_000


def test_frames_of_another_length_are_none() -> None:
    with pytest.raises(FrameError, match="sensor TPDO1 has 3 bytes; it must have 4"):
        base_position(2).value(b"\0\0\0")
    assert decode(bytes(8), 1.0, channels=2) == (0.0, 0.0)


def test_an_inclinometer_is_asked_by_sdo_and_sends_nothing() -> None:
    wire = Wire()
    device = inclinometer_on(5, wire, lambda: 0.01, lambda: 0.0)
    device.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 5))
    device.receive(frames.SYNC, frames.pack_sync(1))
    assert wire.sent == []
    # In thousandths of a degree.
    assert device.node.objects.get(0x6110) == 573


@given(st.floats(-1.5, 1.5), st.floats(-50.0, 50.0))
def test_what_an_inclinometer_feels_is_specific_force(theta: float, a: float) -> None:
    # Specific force (a, g) seen from axes that lean with the block; at rest its direction is the tilt.
    across = a * math.cos(theta) - 9.81 * math.sin(theta)
    along = a * math.sin(theta) + 9.81 * math.cos(theta)
    felt = math.atan2(-across, along)
    assert math.remainder(apparent_tilt(theta, a) - felt, math.tau) == pytest.approx(0.0, abs=1e-12)
    assert apparent_tilt(theta, 0.0) == theta


def test_an_inclinometer_is_useless_on_a_base_that_accelerates() -> None:
    assert abs(apparent_tilt(0.0, 0.26 * 9.81)) > 0.2187


@pytest.mark.parametrize("name", ["position", "acceleration", "displacements", "inclinometer", "rotation"])
def test_canopen_loads_every_data_sheet(name: str) -> None:
    path = files("devices.sensors").joinpath(f"{name}.eds")
    node = canopen.LocalNode(9, str(path))
    assert node.object_dictionary[0x1018][1].default == 0x7FFFFFFF
    assert 0x1017 in node.object_dictionary
    mapped = int(node.object_dictionary[0x1A00][1].default)
    index, sub, bits = mapped >> 16, mapped >> 8 & 0xFF, mapped & 0xFF
    entry = node.object_dictionary[index]
    variable = entry[sub] if sub else entry
    assert len(variable) == bits == 32
    assert variable.pdo_mappable


def test_canopen_loads_the_release_devices_data_sheet() -> None:
    node = canopen.LocalNode(1, str(files("devices.cia401").joinpath("release.eds")))
    assert node.object_dictionary[0x6200][1].writable
    assert not node.object_dictionary[0x6000][1].writable


@pytest.mark.parametrize(
    ("sheet", "profile"),
    [
        (RELEASE_OUTPUT, 401),
        (ACCELERATION_INPUT, 404),
        (DISPLACEMENT_INPUTS, 404),
        (POSITION_ENCODER, 406),
        (INCLINOMETER, 410),
    ],
)
def test_device_types_tell_the_profile(sheet: str, profile: int) -> None:
    line = next(part for part in sheet.split("[1000]")[1].splitlines() if part.startswith("DefaultValue"))
    assert int(line.split("=")[1], 16) & 0xFFFF == profile


def test_scales_come_from_the_data_sheet() -> None:
    assert counts_per_unit(POSITION_ENCODER) == pytest.approx(1e9)
    assert counts_per_unit(DISPLACEMENT_INPUTS) == 1e9
    assert counts_per_unit(ACCELERATION_INPUT, METRE_PER_SECOND_SQUARED) == 1e6
    assert counts_per_unit(INCLINOMETER) == pytest.approx(180e3 / math.pi)
    coarse = POSITION_ENCODER.split("[6005sub1]")
    coarse[1] = coarse[1].replace("DefaultValue=1", "DefaultValue=5000", 1)
    assert counts_per_unit("[6005sub1]".join(coarse)) == pytest.approx(200e3)


@pytest.mark.parametrize(
    ("sheet", "unit", "words"),
    [
        (ACCELERATION_INPUT, METRE, r"EDS tells 00015700 as unit of its inputs \(object 6131\); it must be 00010000"),
        (RELEASE_OUTPUT, METRE, "EDS of profile 401 tells no position, acceleration or tilt"),
        (ACCELERATION_INPUT.replace("6132", "6232"), METRE_PER_SECOND_SQUARED, "EDS does not tell what one count is"),
    ],
)
def test_a_data_sheet_that_does_not_tell_is_one_sentence(sheet: str, unit: int, words: str) -> None:
    with pytest.raises(EdsError, match=words):
        counts_per_unit(sheet, unit)


def test_the_rotation_encoder_is_read_as_on_the_servo_table() -> None:
    assert rotation_by_encoder(4).value(bytes.fromhex("40e20100")) == 0.123456


@given(st.floats(-1.0, 1.0), st.floats(1e-6, 0.1))
def test_an_encoder_reads_whole_steps(true: float, step: float) -> None:
    reading = Encoder(step).read(true)
    assert abs(reading - true) <= 0.5 * step * (1.0 + 1e-9)
    assert reading / step == pytest.approx(round(reading / step), abs=1e-6)
    assert Encoder(0.0).read(true) == true


def test_an_accelerometer_has_noise_bias_and_range() -> None:
    sensor = Accelerometer(np.random.default_rng(5), noise=0.05, bias=0.02, largest=20.0)
    readings = np.array([sensor.read(1.0) for _ in range(20_000)])
    assert readings.mean() == pytest.approx(1.02, abs=2e-3)
    assert readings.std() == pytest.approx(0.05, rel=0.03)
    assert (sensor.read(1e3), sensor.read(-1e3)) == (20.0, -20.0)
    same = Accelerometer(np.random.default_rng(5), noise=0.05, bias=0.02, largest=20.0)
    assert [same.read(1.0) for _ in range(5)] == readings[:5].tolist()


@pytest.mark.parametrize("wrong", [-1.0, math.nan, math.inf])
def test_sensors_are_bounded(wrong: float) -> None:
    with pytest.raises(ValueError, match="encoder step"):
        Encoder(wrong)
    with pytest.raises(ValueError, match="accelerometer has noise"):
        Accelerometer(np.random.default_rng(1), noise=wrong, bias=0.0, largest=1.0)
