"""Every fault there is, by name."""

from __future__ import annotations

import difflib
import math

from devices.errors import FaultRefused
from devices.faults.fault import Fault, FaultKind, Size, fault_of

_NODE = Size("CANopen node, of which 1 moves the table", "1", 1, 1, 127, whole=True)
_SHARE = "share of frames"

_KINDS = (
    # Between the nodes and the bus.
    FaultKind(
        "sync_lost",
        "bus",
        "emulator",
        "SYNC frames do not reach the table",
        Size("frames in a row", "1", 1, 1, 10_000, whole=True),
    ),
    FaultKind("sync_late", "bus", "emulator", "one SYNC reaches the table late", Size("delay", "s", 2.5e-3, 0.0, 1.0)),
    FaultKind(
        "frames_dropped", "bus", "emulator", "frames are lost, both ways", Size(_SHARE, "1", 0.5, 0.0, 1.0), 0.02
    ),
    FaultKind(
        "frames_duplicated",
        "bus",
        "emulator",
        "every frame comes twice, both ways",
        Size("frames between it and its copy", "1", 0, 0, 16, whole=True),
        0.1,
    ),
    FaultKind("frames_reordered", "bus", "emulator", "neighbouring frames change places, both ways", None, 0.1),
    FaultKind(
        "frames_corrupted",
        "bus",
        "emulator",
        "a bit of a frame flips, both ways",
        Size(_SHARE, "1", 1.0, 0.0, 1.0),
        0.01,
    ),
    FaultKind("node_silent", "bus", "emulator", "a node neither hears nor is heard", _NODE, math.inf),
    FaultKind("heartbeat_lost", "bus", "emulator", "a node's heartbeat ends, its data go on", _NODE, math.inf),
    FaultKind(
        "host_heartbeat_lost", "bus", "emulator", "the host's heartbeat ends, its set-points go on", None, math.inf
    ),
    FaultKind("bus_off", "node", "emulator", "the drive's CAN controller is off the bus, and recovers", None, 0.5),
    FaultKind("host_bus_off", "host", "host", "the host's CAN controller is off the bus, and recovers", None, 0.5),
    FaultKind(
        "error_frames",
        "bus",
        "host",
        "error frames on the bus",
        Size("frames a cycle", "1", 1, 1, 100, whole=True),
        0.1,
    ),
    FaultKind(
        "receive_queue_full",
        "host",
        "host",
        "the host's receive queue is full of foreign frames, and loses the others",
        Size("foreign frames a cycle", "1", 256, 1, 100_000, whole=True),
        0.005,
    ),
    # What the table measures.
    FaultKind(
        "encoder_glitch", "sensor", "emulator", "the encoder jumps and comes back", Size("jump", "m", 5e-3, -1, 1), 1e-3
    ),
    FaultKind("encoder_frozen", "sensor", "emulator", "the encoder stays where it is", None, math.inf),
    FaultKind("accelerometer_stuck", "sensor", "emulator", "the accelerometer stays where it is", None, math.inf),
    FaultKind(
        "accelerometer_saturated",
        "sensor",
        "emulator",
        "the accelerometer is at the end of its range",
        Size("reading", "m/s2", 5.0 * 9.81, -2000.0, 2000.0),
        math.inf,
    ),
    FaultKind(
        "accelerometer_biased",
        "sensor",
        "emulator",
        "the accelerometer reads too much",
        Size("bias", "m/s2", 2.0, -1000.0, 1000.0),
        math.inf,
    ),
    # The drive, what it moves, and what stands on it.
    FaultKind(
        "following_error",
        "mechanics",
        "emulator",
        "the table loses part of its set-point's motion",
        Size("share lost", "1", 0.8, 0.01, 1.0),
        math.inf,
    ),
    FaultKind(
        "limit_switch",
        "mechanics",
        "emulator",
        "a limit switch is pressed",
        Size("which end, 1 or -1", "1", 1, -1, 1, whole=True),
        math.inf,
    ),
    FaultKind(
        "drive_fault",
        "drive",
        "emulator",
        "the drive's own monitoring finds a fault",
        Size("emergency error code", "1", 0x2310, 0x1000, 0xFFFF, whole=True),
    ),
    FaultKind("emergency_stop", "drive", "emulator", "the emergency stop is pressed"),
    FaultKind(
        "specimen_pushed",
        "mechanics",
        "emulator",
        "somebody pushes the specimen",
        Size("change of its angular velocity", "rad/s", 0.5, -20.0, 20.0),
    ),
    # The host, and others on its bus.
    FaultKind("host_killed", "process", "host", "the host's process is killed"),
    FaultKind("emulator_killed", "process", "emulator", "the emulator's process is killed"),
    FaultKind(
        "second_master",
        "bus",
        "host",
        "a second master sends SYNC and set-points",
        Size("its set-point", "m", 0.0, -2.0, 2.0),
        math.inf,
    ),
    FaultKind(
        "foreign_nmt",
        "bus",
        "host",
        "somebody else sends an NMT command to all nodes",
        Size("command", "1", 0x80, 1, 255, whole=True),
    ),
    FaultKind("host_number_taken", "bus", "host", "another node sends heartbeats of the host's number", None, math.inf),
    FaultKind("host_stall", "host", "host", "the host stands still", Size("how long", "s", 5e-3, 0.0, 10.0)),
    FaultKind(
        "setpoint_on_bus",
        "bus",
        "host",
        "a set-point of somebody else overrides the host's",
        Size("jump", "m", 1e-3, -2.0, 2.0),
    ),
    FaultKind(
        "setpoint_in_exchange",
        "host",
        "host",
        "the host is told a set-point the planner did not make",
        Size("jump", "m", 1e-3, -10.0, 10.0),
    ),
    FaultKind("operator_stop", "host", "host", "the operator stops the run"),
)

FAULTS: dict[str, FaultKind] = {kind.name: kind for kind in _KINDS}
"""Every fault by its name."""


def find_fault(name: str) -> FaultKind:
    """Return the fault of that name.

    Raises
    ------
    FaultRefused
        One sentence, with the name that was meant or all of them.
    """
    try:
        return FAULTS[name]
    except KeyError:
        close = difflib.get_close_matches(name, FAULTS, n=1)
        hint = f"did you mean {close[0]}?" if close else f"known are {', '.join(FAULTS)}"
        raise FaultRefused(f"no fault is called {name!r}; {hint}") from None


def parse_fault(text: str) -> Fault:
    """Return the fault that NAME@SECONDS or NAME@SECONDS:VALUE asks for; `FaultRefused` where it asks for none.

    Examples
    --------
    >>> fault = parse_fault("sync_lost@2.5:3")
    >>> fault.name, fault.at, fault.magnitude
    ('sync_lost', 2.5, 3.0)
    """
    name, at_sign, rest = text.partition("@")
    at, colon, value = rest.partition(":")
    if not (name and at_sign and at) or (colon and not value):
        raise FaultRefused(f"fault {text} is not NAME@SECONDS or NAME@SECONDS:VALUE")
    kind = find_fault(name)
    return fault_of(kind, _number(at, text), _number(value, text) if colon else None)


def _number(text: str, whole: str) -> float:
    try:
        return float(int(text, 0)) if text.lower().startswith("0x") else float(text)
    except ValueError:
        raise FaultRefused(f"fault {whole}: {text} is no number") from None
