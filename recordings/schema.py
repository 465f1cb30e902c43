"""Topics, messages, fields, units and version of a recording: the one place that says what is in the file.

The protobuf descriptors, the bytes the writer packs, the arrays the reader returns and what `twin schema` prints are
all derived from `TOPICS`.

Rules of the file
-----------------
* One message a sample and topic. The messages of a cycle share their MCAP `sequence`: the cycle number, modulo 2**32
  (the whole number is in /cycle); the two messages of an event share theirs, counted from 0.
* `log_time` is the host's wall clock, ns since 1970 (UTC). `publish_time` is the table's clock, as ns after the
  origin in the metadata record `clock`: the host's wall clock where the table's clock read 0. Where an event has no
  time on the table's clock (a CAN frame), it is `log_time` again.
* A field's number is its place in the tuple: append, never reorder. A new field or topic raises the minor version; one
  that goes away or changes its meaning raises the major one, which older readers refuse.
* Only the topics of a cycle are required. A reader lists a topic it does not know, passes over a field it does not
  know, and gives NaN (0 for a count or choice) where an older file lacks a field.
* Every field has a fixed width and is always written, so a message has one length and one layout.
"""

from __future__ import annotations

from recordings.topic import Choices, Field, Topic

VERSION = (1, 1)
"""Major and minor version of the schema."""

OUTCOME = Choices("Outcome", ("unknown", "stayed", "rocked", "overturned", "undecided"))
ADVICE = Choices("Advice", ("none", "continue", "stopping helps", "stopping would topple it", "too late", "undecided"))
DIRECTION = Choices("Direction", ("unknown", "received", "sent"))

TABLE_TARGET = Topic(
    "/table/target",
    "TableTarget",
    "Set-point sent to the table in this cycle.",
    (Field("position_m", "target_position", "double", "m", "commanded base position, 0 at the centre of the stroke"),),
    required=True,
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
    required=True,
)
BLOCK_MEASURED = Topic(
    "/block/measured",
    "BlockMeasured",
    "What the specimen's sensor reported in this cycle.",
    (Field("rotation_rad", "rotation", "double", "rad", "measured rotation, positive towards +x; NaN without sensor"),),
    required=True,
)
BLOCK_PREDICTED = Topic(
    "/block/predicted",
    "BlockPredicted",
    "The twin's state at the same instant, driven by the measured acceleration.",
    (
        Field("rotation_rad", "predicted_rotation", "double", "rad", "predicted rotation, positive towards +x"),
        Field("angular_velocity_rad_s", "predicted_angular_velocity", "double", "rad/s", "predicted angular velocity"),
    ),
    required=True,
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
    required=True,
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
FORECAST = Topic(
    "/forecast",
    "Forecast",
    "What will happen next, as seen in this cycle: if the run goes on as planned, and if the ramp-down began now.",
    (
        Field("continue_outcome", "continue_outcome", "enum", "1", "outcome if the run goes on", OUTCOME),
        Field(
            "continue_margin",
            "continue_margin",
            "double",
            "1",
            "energy missing to the barrier of overturning, over the barrier; negative beyond it",
        ),
        Field("continue_probability", "continue_probability", "double", "1", "probability of overturning, 0 to 1"),
        Field(
            "continue_overturning_s",
            "continue_overturning",
            "double",
            "s",
            "time from this cycle until the block lies on its side; NaN where it does not",
        ),
        Field("stop_outcome", "stop_outcome", "enum", "1", "outcome if the ramp-down began now", OUTCOME),
        Field("stop_margin", "stop_margin", "double", "1", "as continue_margin, if the ramp-down began now"),
        Field("stop_probability", "stop_probability", "double", "1", "probability of overturning, 0 to 1"),
        Field("stop_overturning_s", "stop_overturning", "double", "s", "as continue_overturning_s, if stopped now"),
        Field("advice", "advice", "enum", "1", "what follows for the operator", ADVICE),
        Field("age_s", "age", "double", "s", "time from the state the forecast starts at to this cycle"),
        Field("futures", "futures", "fixed32", "1", "how many futures the probabilities are counted in"),
        Field(
            "continue_earliest_s", "continue_earliest", "double", "s", "as continue_overturning_s, of the first future"
        ),
        Field("continue_latest_s", "continue_latest", "double", "s", "as continue_overturning_s, of the last future"),
        Field("stop_earliest_s", "stop_earliest", "double", "s", "as stop_overturning_s, of the first future"),
        Field("stop_latest_s", "stop_latest", "double", "s", "as stop_overturning_s, of the last future"),
    ),
    since=(1, 1),
)
ESTIMATE = Topic(
    "/estimate",
    "Estimate",
    "The observer's state in this cycle: the prediction, corrected by the measured rotation.",
    (
        Field("rotation_rad", "rotation", "double", "rad", "estimated rotation, positive towards +x"),
        Field("angular_velocity_rad_s", "angular_velocity", "double", "rad/s", "estimated angular velocity"),
        Field("restitution", "restitution", "double", "1", "ratio of angular velocities over an impact, as estimated"),
        Field("restitution_deviation", "restitution_deviation", "double", "1", "its standard deviation"),
        Field("slenderness_rad", "slenderness", "double", "rad", "slenderness angle, as estimated"),
        Field("slenderness_deviation_rad", "slenderness_deviation", "double", "rad", "its standard deviation"),
        Field("innovation_rad", "innovation", "double", "rad", "measured rotation minus the one estimated before it"),
    ),
    since=(1, 1),
)
CAN_FRAME = Topic(
    "/can/frames",
    "CanFrame",
    "A CAN 2.0A data frame that passed the host's port; log_time is when it was sent or taken in.",
    (
        Field("identifier", "identifier", "fixed32", "1", "11-bit identifier"),
        Field("direction", "sent", "enum", "1", "which way it went, seen from the host", DIRECTION),
        Field("length", "data", "fixed32", "1", "bytes of data, 0 to 8"),
        Field("data", "data", "fixed64", "1", "the bytes, the first one lowest (little-endian), the rest 0"),
    ),
    since=(1, 1),
)

TOPICS = (
    TABLE_TARGET,
    TABLE_MEASURED,
    BLOCK_MEASURED,
    BLOCK_PREDICTED,
    CYCLE,
    MISSED,
    EVENT_TIME,
    FORECAST,
    ESTIMATE,
    CAN_FRAME,
)
"""Every topic with a message of our own."""
CYCLE_TOPICS = tuple(topic for topic in TOPICS if topic.required)
"""One message each for every cycle; a recording without one of them cannot be read."""
CYCLE_UNITS = {field.source: field.unit for topic in CYCLE_TOPICS for field in topic.fields} | {"host_time_ns": "ns"}
"""Unit of each column of `recordings.Cycles`."""

EVENTS_TOPIC = "/events"
"""foxglove.Log: what happened, as text."""
TRANSFORMS_TOPIC = "/tf"
"""foxglove.FrameTransform at about 50 Hz: frames table, block_measured and block_predicted."""
SCENE_TOPIC = "/scene"
"""foxglove.SceneUpdate, once: the boxes that stand in those frames."""
WELL_KNOWN = {
    EVENTS_TOPIC: "foxglove.Log",
    TRANSFORMS_TOPIC: "foxglove.FrameTransform",
    SCENE_TOPIC: "foxglove.SceneUpdate",
}
"""Topics whose messages are Foxglove's, with the name of the message."""

SCHEMA_METADATA = "schema"
CLOCK_METADATA = "clock"
"""The origin of `publish_time`, and at the end how the host's clock ran beside the table's."""
RECORDER_METADATA = "recorder"
"""What the recorder says of itself at the end: values received, dropped and refused, or a `failure`."""
FAILURE_KEY = "failure"
RECOVERY_METADATA = "recovery"
"""In a file made by `twin recover`: what it was made of and what was lost."""
