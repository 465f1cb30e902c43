"""The host's side of the bus: one SYNC out, the answers of that SYNC in, within a time limit."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from devices.cia402 import frames
from devices.cia402.frames import NmtCommand, NmtState
from devices.errors import DeviceTimeout, FrameError
from devices.sensors.rotation import decode_rotation

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia402.buses import CanBus
    from devices.clock import Clock

# With `idle` every node answers on this thread: what has not come after so many rounds never will.
_ROUNDS = 100
# However many frames of others arrive, a wait ends.
_FRAMES_AT_ONCE = 5000


class Feedback(NamedTuple):
    """What the nodes latched at one SYNC: position m, acceleration m/s2, rotation rad (NaN without a sensor).

    Where only the drive's statusword and position were asked for, acceleration too is NaN where it did not come.
    """

    statusword: int
    position: float
    acceleration: float
    rotation: float


@dataclass(slots=True)
class FrameCounts:
    """Frames that were not an answer to the last SYNC.

    Attributes
    ----------
    foreign : int
        Of nodes or services that are none of ours.
    stale : int
        Answers that came before the SYNC they should answer, or twice.
    echoes : int
        Our own, sent back by the bus (udp_multicast does).
    heartbeats : int
        Of our nodes.
    malformed : int
        Of our nodes, with bytes that make no sense.
    """

    foreign: int = 0
    stale: int = 0
    echoes: int = 0
    heartbeats: int = 0
    malformed: int = 0


def _decode_acceleration(data: bytes) -> float:
    return frames.unpack_long(data, "TPDO2") * frames.ACCELERATION_UNIT


_DECODERS = (_decode_acceleration, decode_rotation)
"""Of every answer but the first, in the order of `Link`."""


class Link:
    """One drive and perhaps one rotation sensor, seen from the host.

    Parameters
    ----------
    bus : CanBus
    drive_node : int
    sensor_node : int, optional
    clock : Clock
    idle : callable, optional
        Called while waiting; nodes that live on this thread are serviced in it. With it nothing blocks.
    time_limit : float
        For all answers to one SYNC, s.
    """

    def __init__(
        self,
        bus: CanBus,
        drive_node: int,
        sensor_node: int | None,
        clock: Clock,
        idle: Callable[[], None] | None,
        time_limit: float,
    ) -> None:
        self.counts = FrameCounts()
        self.emergency: frames.Emergency | None = None
        self.restarted: int | None = None
        self._bus = bus
        self._clock = clock
        self._idle = idle
        self._time_limit = time_limit
        self._nodes = [drive_node] if sensor_node is None else [drive_node, sensor_node]
        self._target = frames.RPDO1 + drive_node
        self._emergencies = frames.EMCY + drive_node
        self._heartbeats = {frames.HEARTBEAT + node: node for node in self._nodes}
        self._own = {frames.NMT, frames.SYNC, self._target}
        self._answers = {
            frames.TPDO1 + drive_node: "statusword and position",
            frames.TPDO2 + drive_node: "acceleration",
        }
        if sensor_node is not None:
            self._answers[frames.TPDO1 + sensor_node] = "rotation"
        self._order = list(self._answers)

    def start(self) -> None:
        """Tell our nodes, and only ours, to become operational."""
        for node in self._nodes:
            self._bus.send(frames.NMT, frames.pack_nmt(NmtCommand.START, node))

    def drain(self) -> None:
        """Take in what has arrived: emergencies and heartbeats count, answers are stale."""
        for _ in range(_FRAMES_AT_ONCE):
            if (frame := self._bus.receive()) is None:
                return
            if frame[0] in self._answers:
                self.counts.stale += 1
            else:
                self._sort(*frame)

    def cycle(self, counter: int, command: tuple[int, int] | None, spare: float | None = None) -> Feedback:
        """Send controlword and target, nm, if any, and SYNC; return the answers.

        With `spare` only the drive's statusword and position are required: everything else is waited for no longer than
        `spare` s, and is NaN where it does not come or makes no sense.

        Raises
        ------
        DeviceTimeout
            Where a required answer is missing; it says which.
        FrameError
            Where it makes no sense.
        """
        if command is not None:
            self._bus.send(self._target, frames.pack_target(*command))
        self._bus.send(frames.SYNC, frames.pack_sync(counter))
        answers = self._collect(spare)
        required = self._order if spare is None else self._order[:1]
        missing = [self._answers[identifier] for identifier in required if identifier not in answers]
        if missing:
            what = " and ".join(missing)
            raise DeviceTimeout(f"no {what} came within {self._time_limit:g} s of the SYNC on {self._bus}")
        statusword, position = frames.unpack_actual(answers[self._order[0]])
        values = [math.nan, math.nan]
        for i, (identifier, decode) in enumerate(zip(self._order[1:], _DECODERS, strict=False)):
            try:
                if identifier in answers:
                    values[i] = decode(answers[identifier])
            except FrameError:
                if spare is None:
                    raise
                self.counts.malformed += 1
        return Feedback(statusword, position * frames.POSITION_UNIT, *values)

    def _collect(self, spare: float | None) -> dict[int, bytes]:
        answers: dict[int, bytes] = {}
        sent = self._clock.now()
        deadline = sent + self._time_limit
        idle, wanted, fruitless = self._idle, len(self._answers), 0
        for _ in range(_FRAMES_AT_ONCE):
            if idle is None:
                left = deadline - self._clock.now()
                frame = self._bus.receive(left) if left > 0.0 else None
                if frame is None:
                    break
            else:
                if (frame := self._bus.receive()) is None:
                    fruitless += 1
                    if fruitless > _ROUNDS or self._clock.now() > deadline:
                        break
                    idle()
                    continue
            identifier, data = frame
            if identifier not in self._answers:
                self._sort(identifier, data)
            elif identifier in answers:
                self.counts.stale += 1
            else:
                answers[identifier] = data
                if len(answers) == wanted:
                    break
                if spare is not None and identifier == self._order[0]:
                    deadline = sent + spare
        return answers

    def _sort(self, identifier: int, data: bytes) -> None:
        counts = self.counts
        try:
            if identifier in self._own:
                counts.echoes += 1
            elif identifier == self._emergencies:
                emergency = frames.unpack_emergency(data)
                # Code 0 says that errors are over; the first cause is what counts until then.
                if emergency.code == 0:
                    self.emergency = None
                elif self.emergency is None:
                    self.emergency = emergency
            elif identifier in self._heartbeats:
                counts.heartbeats += 1
                if frames.unpack_heartbeat(data) is not NmtState.OPERATIONAL:
                    self.restarted = self._heartbeats[identifier]
            else:
                counts.foreign += 1
        except FrameError:
            counts.malformed += 1
