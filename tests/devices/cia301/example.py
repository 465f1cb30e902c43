"""A small node for the tests: an EDS of its own, one RPDO, one TPDO, and everything a node hears written down."""

from __future__ import annotations

from devices.cia301 import frames
from devices.cia301.node import Device


def section(name: str, **entries: object) -> str:
    """One section of an EDS."""
    return "\n".join([f"[{name}]", *(f"{key}={value}" for key, value in entries.items()), ""])


def variable(index: str, name: str, kind: int, access: str, default: object, **more: object) -> str:
    """A variable; `kind` is CiA 301's number of its type."""
    what = {"ParameterName": name, "ObjectType": "0x7", "DataType": f"0x{kind:04X}", "AccessType": access}
    return section(index, **what, DefaultValue=default, PDOMapping=0, **more)


U8, U16, U32, I8, I32, TEXT = 0x05, 0x06, 0x07, 0x02, 0x04, 0x09

EDS = "\n".join(
    [
        section("DeviceInfo", VendorName="us", VendorNumber=7, ProductNumber=9, RevisionNumber=1),
        variable("1000", "Device type", U32, "ro", 0x191),
        variable("1001", "Error register", U8, "ro", 0),
        section("1003", ParameterName="Errors", ObjectType="0x8", SubNumber=9),
        variable("1003sub0", "Number", U8, "ro", 0),
        *(variable(f"1003sub{k}", f"Error {k}", U32, "ro", 0) for k in range(1, 9)),
        variable("1008", "Device name", TEXT, "const", "a name of more than seven bytes"),
        section("1016", ParameterName="Consumer heartbeat", ObjectType="0x8", SubNumber=2),
        variable("1016sub0", "Highest", U8, "const", 1),
        variable("1016sub1", "Time", U32, "rw", 0),
        variable("1017", "Producer heartbeat", U16, "rw", 250),
        section("1018", ParameterName="Identity", ObjectType="0x9", SubNumber=4),
        variable("1018sub0", "Highest", U8, "const", 3),
        variable("1018sub1", "Vendor", U32, "ro", 7),
        variable("1018sub2", "Product", U32, "ro", 9),
        variable("1018sub3", "Revision", U32, "ro", 0x00020005),
        section("1800", ParameterName="TPDO1", ObjectType="0x9", SubNumber=2),
        variable("1800sub0", "Highest", U8, "const", 1),
        variable("1800sub1", "COB-ID", U32, "ro", "$NODEID+0x180"),
        variable("2000", "Level", I32, "rw", -5, LowLimit=-1000, HighLimit=1000),
        variable("2001", "Secret", U8, "wo", 1),
        variable("2002", "Mode", I8, "rw", 8),
        variable("2003", "Nothing", U32, "ro", ""),
        variable("2004", "Note", TEXT, "rw", "x"),
    ]
)


class Example(Device):
    """Echoes the byte of its RPDO1 at each SYNC."""

    def __init__(self, identifier: int = 5, **arguments: object) -> None:
        self.sent: list[tuple[int, bytes]] = []
        super().__init__(identifier, lambda number, data: self.sent.append((number, data)), EDS, **arguments)
        self.heard: list[object] = []
        self.level = 0

    def sync(self, counter: int) -> None:
        """Answer."""
        self.heard.append(counter)
        if self.node.operational:
            self.node.send(frames.TPDO1 + self.node.identifier, bytes([self.level]))

    def take(self, pdo: int, data: bytes) -> None:
        """Take one byte."""
        if len(data) != 1:
            raise frames.FrameError("one byte")
        self.heard.append((pdo, data))
        self.level = data[0]

    def leave_operational(self) -> None:
        """Write it down."""
        self.heard.append("left")

    def lost(self, node: int) -> None:
        """Write it down."""
        self.heard.append(f"lost {node}")
