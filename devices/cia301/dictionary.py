"""A node's object dictionary: what its EDS declares, the values it holds, and who is asked when they are used."""

from __future__ import annotations

import configparser
import io
from functools import lru_cache
from typing import TYPE_CHECKING, Any, cast

from canopen.objectdictionary import ObjectDictionary, ODVariable
from canopen.objectdictionary import eds as eds_format
from canopen.sdo.exceptions import SdoAbortedError

from devices.errors import EdsError

if TYPE_CHECKING:
    from collections.abc import Callable

NO_OBJECT, NO_SUBINDEX, READ_ONLY, WRITE_ONLY = 0x06020000, 0x06090011, 0x06010002, 0x06010001
WRONG_LENGTH, WRONG_VALUE, TOO_HIGH, TOO_LOW = 0x06070010, 0x06090030, 0x06090031, 0x06090032
WRONG_STATE, WRONG_COMMAND, OUT_OF_MEMORY, NO_DATA = 0x08000022, 0x05040001, 0x05040005, 0x060A0023
"""SDO abort codes (CiA 301, 7.2.4.3.17)."""


class Refused(SdoAbortedError):  # noqa: N818 - a name says what happened, as in devices.errors
    """A write hook does not take a value; canopen's SDO server answers with the abort code it carries."""


@lru_cache(maxsize=64)
def load_eds(text: str, node: int) -> ObjectDictionary:
    """Return the object dictionary an EDS declares for a node of this number. It is shared: do not change it.

    Raises
    ------
    EdsError
        Where the text is no EDS; one sentence.
    """
    if "[DeviceInfo]" not in text:
        # canopen takes it, with a warning that Python warns of.
        raise EdsError(f"EDS of node {node} has no section DeviceInfo, which is mandatory (CiA 306)")
    try:
        dictionary = cast("ObjectDictionary", cast("Any", eds_format).import_eds(io.StringIO(text), node))
    except (configparser.Error, ValueError, KeyError, AttributeError, TypeError) as error:
        raise EdsError(f"EDS of node {node} cannot be read: {' '.join(str(error).split())}") from error
    if 0x1000 not in dictionary or 0x1018 not in dictionary:
        raise EdsError(f"EDS of node {node} declares no device type (1000) or no identity (1018)")
    return dictionary


def variable_of(dictionary: ObjectDictionary, index: int, sub: int = 0) -> ODVariable:
    """Return one variable of an object dictionary; `Refused` where there is none."""
    if index not in dictionary:
        raise Refused(NO_OBJECT)
    entry = dictionary[index]
    if isinstance(entry, ODVariable):
        if sub != 0:
            raise Refused(NO_SUBINDEX)
        return entry
    if sub not in entry:
        raise Refused(NO_SUBINDEX)
    return entry[sub]


class ObjectStore:
    """The values of one node, as the node itself and its SDO server see them.

    Three layers, the upper ones first: what was written by SDO, what the device was set up with (`set`), what the EDS
    declares as default. `object_dictionary`, `get_data` and `set_data` are what canopen's `SdoServer` asks for.

    Parameters
    ----------
    eds : str
        Text of the electronic data sheet.
    node : int
        1 to 127; for entries that are declared relative to it.

    Attributes
    ----------
    object_dictionary : canopen.ObjectDictionary
    """

    def __init__(self, eds: str, node: int) -> None:
        self.object_dictionary = load_eds(eds, node)
        self._written: dict[tuple[int, int], bytes] = {}
        self._own: dict[tuple[int, int], bytes] = {}
        self._readers: dict[tuple[int, int], Callable[[], int]] = {}
        self._writers: dict[tuple[int, int], Callable[[int], None]] = {}

    def get(self, index: int, sub: int = 0) -> int:
        """Return an integer object; KeyError where the EDS declares none."""
        value = self._decoded(index, sub)
        if not isinstance(value, int):
            raise KeyError(f"object {index:04X}:{sub:02X} is no integer")
        return value

    def text(self, index: int, sub: int = 0) -> str:
        """Return a string object; KeyError where the EDS declares none."""
        value = self._decoded(index, sub)
        if not isinstance(value, str):
            raise KeyError(f"object {index:04X}:{sub:02X} is no text")
        return value

    def set(self, index: int, value: int, sub: int = 0) -> None:
        """Set an integer object up by the device itself: whatever its access type, without hooks, kept by a reset."""
        self._own[index, sub] = bytes(variable_of(self.object_dictionary, index, sub).encode_raw(value))

    def on_read(self, index: int, reader: Callable[[], int], sub: int = 0) -> None:
        """Let `reader` answer for an object, now and whenever it is read."""
        self._readers[index, sub] = reader

    def on_write(self, index: int, writer: Callable[[int], None], sub: int = 0) -> None:
        """Let `writer` know each value written by SDO before it is stored; it may refuse it by raising `Refused`."""
        self._writers[index, sub] = writer

    def restore(self, first: int, last: int) -> None:
        """Forget what was written by SDO into the objects `first` to `last`; their write hooks hear what holds now."""
        for index, sub in [key for key in self._written if first <= key[0] <= last]:
            del self._written[index, sub]
            if (writer := self._writers.get((index, sub))) is not None:
                writer(self.get(index, sub))

    def get_data(self, index: int, subindex: int, check_readable: bool = False) -> bytes:
        """Return an object's bytes; raises `SdoAbortedError`. As canopen's SDO server asks for them."""
        variable = variable_of(self.object_dictionary, index, subindex)
        if check_readable and not variable.readable:
            raise Refused(WRITE_ONLY)
        if (reader := self._readers.get((index, subindex))) is not None:
            return bytes(variable.encode_raw(reader()))
        for layer in (self._written, self._own):
            if (index, subindex) in layer:
                return layer[index, subindex]
        if variable.default is None:
            raise Refused(NO_DATA)
        return bytes(variable.encode_raw(variable.default))

    def set_data(self, index: int, subindex: int, data: bytes, check_writable: bool = False) -> None:
        """Take an object's bytes; raises `SdoAbortedError`. As canopen's SDO server hands them over."""
        variable = variable_of(self.object_dictionary, index, subindex)
        if check_writable and not variable.writable:
            raise Refused(READ_ONLY)
        data = bytes(data)
        if variable.fixed_size:
            if 8 * len(data) != len(variable):
                raise Refused(WRONG_LENGTH)
            value = variable.decode_raw(data)
            if isinstance(value, int):
                if variable.max is not None and value > variable.max:
                    raise Refused(TOO_HIGH)
                if variable.min is not None and value < variable.min:
                    raise Refused(TOO_LOW)
                if (writer := self._writers.get((index, subindex))) is not None:
                    writer(value)
        self._written[index, subindex] = data

    def _decoded(self, index: int, sub: int) -> object:
        try:
            data = self.get_data(index, sub)
        except SdoAbortedError as error:
            raise KeyError(f"object {index:04X}:{sub:02X}: {error}") from None
        return variable_of(self.object_dictionary, index, sub).decode_raw(data)
