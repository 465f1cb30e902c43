"""Topics, messages, fields, units and version of a recording: the one place that says what is in the file.

The protobuf descriptors, the bytes the writer packs and the arrays the reader returns are all derived from `TOPICS`.

Rules of the file
-----------------
* One message a sample and topic. The five messages of a cycle share their MCAP `sequence`: the cycle number, modulo
  2**32 (the whole number is in /cycle); the two messages of an event share theirs, counted from 0.
* `log_time` is the host's wall clock, ns since 1970 (UTC). `publish_time` is the table's clock, as ns after the
  origin in the metadata record `clock`: the host's wall clock where the table's clock read 0.
* A field's number is its place in the tuple: append, never reorder. A new field raises the minor version; a field that
  goes away or changes its meaning raises the major one, which older readers refuse.
* Every field has a fixed width and is always written, so a message has one length and one layout.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PACKAGE = "shake_table_twin"
VERSION = (1, 0)
"""Major and minor version of the schema."""

Kind = Literal["double", "fixed64", "fixed32"]

_WIRE_TYPE: dict[Kind, int] = {"double": 1, "fixed64": 1, "fixed32": 5}
_STRUCT_CODE: dict[Kind, str] = {"double": "d", "fixed64": "Q", "fixed32": "I"}
_NUMPY_CODE: dict[Kind, str] = {"double": "<f8", "fixed64": "<u8", "fixed32": "<u4"}


@dataclass(frozen=True, slots=True)
class Field:
    """One number of a message.

    Attributes
    ----------
    name : str
        Name in the file, with its unit.
    source : str
        Attribute of `CycleRecord`, `Missed` or `Event` it comes from.
    kind : {"double", "fixed64", "fixed32"}
        Protobuf type.
    unit : str
        SI unit, "1" for a count.
    text : str
        What it is, with its sign.
    """

    name: str
    source: str
    kind: Kind
    unit: str
    text: str


@dataclass(frozen=True, slots=True)
class Topic:
    """One signal group: the topic's name, the name of its message and the fields."""

    name: str
    message: str
    text: str
    fields: tuple[Field, ...]

    @property
    def schema_name(self) -> str:
        """Full protobuf name of the message."""
        return f"{PACKAGE}.{self.message}"

    @property
    def tags(self) -> bytes:
        """Protobuf key byte of each field, in order (field numbers stay below 16, so each is one byte)."""
        return bytes((number << 3) | _WIRE_TYPE[field.kind] for number, field in enumerate(self.fields, start=1))

    @property
    def struct_format(self) -> str:
        """`struct` format of the encoded message: a key byte, then the value, for each field."""
        return "<" + "".join("B" + _STRUCT_CODE[field.kind] for field in self.fields)

    @property
    def columns(self) -> list[tuple[str, str]]:
        """The same layout as a numpy structured type: columns `key1`, first field, `key2`, second field, ..."""
        layout: list[tuple[str, str]] = []
        for number, field in enumerate(self.fields, start=1):
            layout += [(f"key{number}", "u1"), (field.name, _NUMPY_CODE[field.kind])]
        return layout


TABLE_TARGET = Topic(
    "/table/target",
    "TableTarget",
    "Set-point sent to the table in this cycle.",
    (Field("position_m", "target_position", "double", "m", "commanded base position, 0 at the centre of the stroke"),),
)
TABLE_MEASURED = Topic(
    "/table/measured",
    "TableMeasured",
    "What the table reported in this cycle.",
    (
        Field("position_m", "position", "double", "m", "measured base position, positive towards +x"),
        Field("acceleration_m_s2", "acceleration", "double", "m/s2", "measured base acceleration, positive towards +x"),
        Field("statusword", "status", "fixed32", "1", "CiA 402 statusword, object 6041"),
    ),
)
BLOCK_MEASURED = Topic(
    "/block/measured",
    "BlockMeasured",
    "What the specimen's sensor reported in this cycle.",
    (Field("rotation_rad", "rotation", "double", "rad", "measured rotation, positive towards +x; NaN without sensor"),),
)
BLOCK_PREDICTED = Topic(
    "/block/predicted",
    "BlockPredicted",
    "The twin's state at the same instant, driven by the measured acceleration.",
    (
        Field("rotation_rad", "predicted_rotation", "double", "rad", "predicted rotation, positive towards +x"),
        Field("angular_velocity_rad_s", "predicted_angular_velocity", "double", "rad/s", "predicted angular velocity"),
    ),
)
CYCLE = Topic(
    "/cycle",
    "Cycle",
    "The control cycle itself.",
    (
        Field("cycle", "cycle", "fixed64", "1", "number of the cycle, from 0"),
        Field("time_s", "time", "double", "s", "table's clock, 0 at the first cycle"),
        Field("lateness_s", "lateness", "double", "s", "start of the cycle behind its schedule"),
    ),
)
MISSED = Topic(
    "/cycle/missed",
    "MissedCycles",
    "Cycles never executed because the host came too late, both ends included.",
    (
        Field("first", "first", "fixed64", "1", "first missed cycle number"),
        Field("last", "last", "fixed64", "1", "last missed cycle number"),
    ),
)
EVENT_TIME = Topic(
    "/events/time",
    "EventTime",
    "Exact time of the event of the same sequence number in /events, whose own time stamp is rounded to 1 ns.",
    (Field("time_s", "time", "double", "s", "table's clock"),),
)

CYCLE_TOPICS = (TABLE_TARGET, TABLE_MEASURED, BLOCK_MEASURED, BLOCK_PREDICTED, CYCLE)
"""One message each for every cycle; a recording without one of them cannot be read."""
TOPICS = (*CYCLE_TOPICS, MISSED, EVENT_TIME)
"""Every topic with a message of our own."""

EVENTS_TOPIC = "/events"
"""foxglove.Log: what happened, as text."""
TRANSFORMS_TOPIC = "/tf"
"""foxglove.FrameTransform at about 50 Hz: frames table, block_measured and block_predicted."""
SCENE_TOPIC = "/scene"
"""foxglove.SceneUpdate, once: the boxes that stand in those frames."""

SCHEMA_METADATA = "schema"
CLOCK_METADATA = "clock"
RECORDER_METADATA = "recorder"
"""What the recorder says of itself at the end: values received, dropped and refused, or a `failure`."""
FAILURE_KEY = "failure"
