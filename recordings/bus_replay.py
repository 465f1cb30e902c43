"""A recorded run as the CAN frames of its cycles, so that other CAN tools can listen to it.

The frames are those of a live cycle (`devices.cia402.frames`), in its order: target, SYNC, what the drive answered,
what the specimen's sensor answered. One thing differs, on purpose: the recording does not hold the controlwords, and
the one sent with every target is "disable voltage" (0). A drive that should hear it does not move; it loses its power.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from devices.cia301 import frames
from devices.cia402.frames import pack_actual, pack_target
from devices.cia402.units import SERVO_DRIVE, units_of
from devices.quanser_st3.driver import DRIVE_NODE, SENSOR_NODE
from devices.sensors.rotation import ROTATION_UNIT
from recordings.pacing import Unpaced
from recordings.replay import check_replayable

if TYPE_CHECKING:
    from collections.abc import Callable

    from recordings.pacing import Pace
    from recordings.run import Run
    from twin.cycle import CycleRecord

DISABLE_VOLTAGE = 0x0000
"""Controlword (object 6040) of every target sent."""
_UNITS = units_of(SERVO_DRIVE)


class Frame(NamedTuple):
    """An 11-bit identifier and its bytes."""

    identifier: int
    data: bytes


@dataclass(frozen=True, slots=True)
class BusReplay:
    """What was sent: cycles, and frames in all."""

    cycles: int
    frames: int


def frames_of(record: CycleRecord) -> list[Frame]:
    """Return the frames of one cycle; a value that was not there (NaN) has none.

    Raises
    ------
    FrameError
        A value does not fit its frame.
    """
    found: list[Frame] = []
    if math.isfinite(record.target_position):
        target = frames.counts(record.target_position, _UNITS.position, "target position")
        found.append(Frame(frames.RPDO1 + DRIVE_NODE, pack_target(DISABLE_VOLTAGE, target)))
    found.append(Frame(frames.SYNC, frames.pack_sync(frames.sync_counter(record.cycle))))
    if math.isfinite(record.position):
        position = frames.counts(record.position, _UNITS.position, "position")
        found.append(Frame(frames.TPDO1 + DRIVE_NODE, pack_actual(record.status & 0xFFFF, position)))
    if math.isfinite(record.acceleration):
        acceleration = frames.counts(record.acceleration, _UNITS.acceleration, "acceleration")
        found.append(Frame(frames.TPDO2 + DRIVE_NODE, frames.pack_long(acceleration)))
    if math.isfinite(record.rotation):
        rotation = frames.counts(record.rotation, ROTATION_UNIT, "rotation")
        found.append(Frame(frames.TPDO1 + SENSOR_NODE, frames.pack_long(rotation)))
    return found


def play_on_bus(
    run: Run,
    send: Callable[[int, bytes], None],
    *,
    pace: Pace | None = None,
    each: Callable[[float, float, float], None] | None = None,
) -> BusReplay:
    """Send every cycle of `run`.

    Parameters
    ----------
    run : Run
    send : callable
        Takes identifier and bytes of one frame: `CanBus.send`.
    pace, each
        As of `recordings.replay.replay`.

    Raises
    ------
    RecordingError
        The run cannot be replayed.
    FrameError, BusFailure
        A value does not fit its frame; the bus does not take it.
    """
    check_replayable(run)
    wait = (pace or Unpaced()).wait
    cycles = count = 0
    for record in run.cycles:
        if not wait(record.time):
            break
        for frame in frames_of(record):
            send(*frame)
            count += 1
        cycles += 1
        if each is not None:
            each(record.time, record.predicted_rotation, record.rotation)
    return BusReplay(cycles, count)
