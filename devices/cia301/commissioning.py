"""What is checked and set in every node before it is used: who it is, what its PDOs carry, the heartbeats."""

from __future__ import annotations

from typing import TYPE_CHECKING

from canopen.objectdictionary import ODVariable

from devices.cia301.dictionary import ObjectStore
from devices.cia301.host import HEARTBEAT_LIMIT, HEARTBEAT_PERIOD
from devices.errors import DeviceMismatch, EdsError
from devices.sample import Description

if TYPE_CHECKING:
    from devices.cia301.sdo_client import Sdo

_PDO_OBJECTS = (range(0x1400, 0x1404), range(0x1600, 0x1604), range(0x1800, 0x1804), range(0x1A00, 0x1A04))
_PARTS = {1: "vendor", 2: "product", 3: "revision"}


def check_identity(sdo: Sdo, eds: str) -> None:
    """Compare device type, vendor, product and major revision with the electronic data sheet.

    Raises
    ------
    DeviceMismatch
        Where they differ.
    """
    declared = ObjectStore(eds, sdo.node)
    wanted = declared.get(0x1000)
    if (found := sdo.read(0x1000)) != wanted:
        raise DeviceMismatch(f"node {sdo.node} of {sdo.name} is of device type {found:08X}; its EDS says {wanted:08X}")
    for sub, part in _PARTS.items():
        if declared.object_dictionary.get_variable(0x1018, sub) is None:
            continue  # all but the vendor may be left out (CiA 301)
        wanted, found = declared.get(0x1018, sub), sdo.read(0x1018, sub)
        # CiA 301: the minor revision, in the lower half, changes nothing that can be seen on the bus.
        same = wanted >> 16 == found >> 16 if part == "revision" else wanted == found
        if not same:
            raise DeviceMismatch(f"node {sdo.node} of {sdo.name} is {part} {found:08X}; its EDS says {wanted:08X}")


def check_objects(sdo: Sdo, eds: str, *objects: int) -> None:
    """Compare objects, with all their sub-indices, with what the electronic data sheet declares as their values.

    Raises
    ------
    DeviceMismatch
        Where one differs.
    EdsError
        Where the data sheet declares none.
    """
    declared = ObjectStore(eds, sdo.node)
    for index in objects:
        if index not in declared.object_dictionary:
            raise EdsError(f"EDS of node {sdo.node} of {sdo.name} declares no object {index:04X}, which is needed")
        entry = declared.object_dictionary[index]
        subs = [0] if isinstance(entry, ODVariable) else [int(sub) for sub in entry]
        for sub in subs:
            wanted, found = declared.get(index, sub), sdo.read(index, sub)
            if wanted != found:
                where = f"node {sdo.node} of {sdo.name} has {found:X} in object {index:04X}:{sub:02X}"
                raise DeviceMismatch(f"{where}; its EDS says {wanted:X}")


def check_pdos(sdo: Sdo, eds: str) -> None:
    """Compare what the device's PDOs carry, as read back from it, with its electronic data sheet; `DeviceMismatch`."""
    dictionary = ObjectStore(eds, sdo.node).object_dictionary
    check_objects(sdo, eds, *(index for group in _PDO_OBJECTS for index in group if index in dictionary))


def set_heartbeats(sdo: Sdo, host_node: int) -> None:
    """Let the device beat, and let it watch the host's heartbeat: where the host dies it comes to rest by itself."""
    sdo.write(0x1017, round(1e3 * HEARTBEAT_PERIOD))
    sdo.write(0x1016, host_node << 16 | round(1e3 * HEARTBEAT_LIMIT), 1)


def describe_node(sdo: Sdo, what: str, *, state: str, mode: str = "") -> Description:
    """Ask a node who it is."""
    name, hardware, software = (
        sdo.text(index) if index in sdo.dictionary else "" for index in (0x1008, 0x1009, 0x100A)
    )
    vendor, product, revision, serial = (
        sdo.read(0x1018, sub) if sdo.dictionary.get_variable(0x1018, sub) is not None else 0 for sub in (1, 2, 3, 4)
    )
    return Description(sdo.node, what, name, hardware, software, vendor, product, revision, serial, state, mode)
