"""What an EDS declares, what is set and written over it, and who is asked."""

from __future__ import annotations

import struct

import pytest
from canopen.sdo.exceptions import SdoAbortedError

from devices.cia301 import dictionary
from devices.cia301.dictionary import ObjectStore, Refused, load_eds
from devices.errors import DeviceError, EdsError
from tests.devices.cia301.example import EDS

INFO = "[DeviceInfo]\nVendorName=us\n"


def long(value: int) -> bytes:
    return struct.pack("<i", value)


def test_three_layers_and_a_reset() -> None:
    objects = ObjectStore(EDS, 5)
    assert objects.get(0x2000) == -5
    objects.set(0x2000, 3)
    assert objects.get(0x2000) == 3
    objects.set_data(0x2000, 0, long(4), check_writable=True)
    assert objects.get(0x2000) == 4
    objects.restore(0x1000, 0x1FFF)
    assert objects.get(0x2000) == 4
    objects.restore(0x2000, 0x2000)
    assert objects.get(0x2000) == 3


def test_node_number_is_part_of_what_is_declared() -> None:
    assert [ObjectStore(EDS, node).get(0x1800, 1) for node in (1, 5, 127)] == [0x181, 0x185, 0x1FF]


def test_text_and_numbers_are_told_apart() -> None:
    objects = ObjectStore(EDS, 5)
    assert objects.text(0x1008) == "a name of more than seven bytes"
    with pytest.raises(KeyError, match="1008:00 is no integer"):
        objects.get(0x1008)
    with pytest.raises(KeyError, match="1000:00 is no text"):
        objects.text(0x1000)
    with pytest.raises(KeyError, match="9999:00"):
        objects.get(0x9999)


@pytest.mark.parametrize(
    ("index", "sub", "data", "code"),
    [
        (0x9999, 0, b"\0", dictionary.NO_OBJECT),
        (0x1018, 9, b"\0", dictionary.NO_SUBINDEX),
        (0x2000, 1, long(0), dictionary.NO_SUBINDEX),
        (0x1000, 0, long(0), dictionary.READ_ONLY),
        (0x1008, 0, b"x", dictionary.READ_ONLY),
        (0x2000, 0, b"\0\0", dictionary.WRONG_LENGTH),
        (0x2000, 0, bytes(5), dictionary.WRONG_LENGTH),
        (0x2000, 0, long(1001), dictionary.TOO_HIGH),
        (0x2000, 0, long(-1001), dictionary.TOO_LOW),
    ],
)
def test_what_is_not_taken(index: int, sub: int, data: bytes, code: int) -> None:
    objects = ObjectStore(EDS, 5)
    with pytest.raises(SdoAbortedError) as refused:
        objects.set_data(index, sub, data, check_writable=True)
    assert refused.value.code == code
    assert objects.get(0x2000) == -5


@pytest.mark.parametrize("value", [-1000, 1000])
def test_at_the_limits_it_is_taken(value: int) -> None:
    objects = ObjectStore(EDS, 5)
    objects.set_data(0x2000, 0, long(value), check_writable=True)
    assert objects.get(0x2000) == value


def test_what_cannot_be_read() -> None:
    objects = ObjectStore(EDS, 5)
    for index, code in ((0x2001, dictionary.WRITE_ONLY), (0x2003, dictionary.NO_DATA)):
        with pytest.raises(SdoAbortedError) as refused:
            objects.get_data(index, 0, check_readable=True)
        assert refused.value.code == code


def test_hooks() -> None:
    objects = ObjectStore(EDS, 5)
    written: list[int] = []

    def writer(value: int) -> None:
        if value == 13:
            raise Refused(dictionary.WRONG_STATE)
        written.append(value)

    objects.on_write(0x2000, writer)
    objects.on_read(0x2002, lambda: -7)
    assert objects.get(0x2002) == -7
    objects.set_data(0x2000, 0, long(12))
    with pytest.raises(SdoAbortedError):
        objects.set_data(0x2000, 0, long(13))
    assert objects.get(0x2000) == 12
    objects.restore(0x2000, 0x2FFF)
    assert written == [12, -5]


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "has no section DeviceInfo"),
        (INFO, "declares no device type"),
        (INFO + "no section", "cannot be read"),
        (INFO + "[1000]\nParameterName=x\n", "cannot be read"),
        (INFO + "[1000sub1]\nParameterName=x\nDataType=7\nAccessType=ro\n", "cannot be read"),
        (EDS.replace("DataType=0x0007", "DataType=seven"), "cannot be read"),
    ],
)
def test_an_eds_that_is_none(text: str, why: str) -> None:
    with pytest.raises(EdsError, match=why) as error:
        load_eds(text, 3)
    assert isinstance(error.value, DeviceError)
    assert "\n" not in str(error.value)
