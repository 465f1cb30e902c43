"""Devices by name."""

from __future__ import annotations

import pytest

from devices.catalogue import DEVICES, find_device
from devices.errors import UnknownDevice
from devices.quanser_st3.driver import open_table
from devices.quanser_st3.emulator import EmulatedSt3


def test_each_device_answers_with_its_own_name() -> None:
    assert list(DEVICES) == ["quanser_st3", "air_track"]
    for name, entry in DEVICES.items():
        assert find_device(name) is entry
        assert entry.capacity.name == name
        assert entry.description


def test_factories() -> None:
    assert DEVICES["quanser_st3"].open_table is open_table
    assert DEVICES["quanser_st3"].emulator is EmulatedSt3


def test_what_is_not_there_is_one_sentence() -> None:
    with pytest.raises(UnknownDevice, match="no device is called 'st3'; there are quanser_st3, air_track"):
        find_device("st3")
    with pytest.raises(UnknownDevice, match="air_track has no driver yet"):
        _ = DEVICES["air_track"].open_table
    with pytest.raises(UnknownDevice, match="air_track has no emulator yet"):
        _ = DEVICES["air_track"].emulator
