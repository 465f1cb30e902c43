"""What one control cycle leaves behind, and who takes it.

The live loop produces these values; it does not know whether a recorder, a test or nobody listens.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

Level = Literal["info", "warning", "error"]


@dataclass(frozen=True, slots=True)
class CycleRecord:
    """One executed cycle: what was asked, what was measured, what was predicted.

    Attributes
    ----------
    cycle : int
        Number of the cycle, from 0; `time` is `cycle` times the cycle time, on the table's clock.
    time : float
        Table's clock, s, 0 at the first cycle of the run.
    host_time_ns : int
        Host's wall clock when the sample arrived, ns since 1970 (UTC).
    lateness : float
        Start of the cycle behind its schedule, s.
    target_position : float
        Set-point sent in this cycle, m, 0 at the centre of the stroke.
    position, acceleration : float
        Measured base position, m, and base acceleration, m/s2, both positive towards +x.
    rotation : float
        Measured rotation of the block, rad, positive when the top leans to +x; NaN without a sensor.
    predicted_rotation, predicted_angular_velocity : float
        The twin's state at the same instant, rad and rad/s, driven by the measured acceleration.
    status : int
        The drive's CiA 402 statusword (object 6041).
    """

    cycle: int
    time: float
    host_time_ns: int
    lateness: float
    target_position: float
    position: float
    acceleration: float
    rotation: float
    predicted_rotation: float
    predicted_angular_velocity: float
    status: int


@dataclass(frozen=True, slots=True)
class Missed:
    """Cycle numbers that were never executed because the host came too late: `first` to `last`, both included."""

    first: int
    last: int
    host_time_ns: int


@dataclass(frozen=True, slots=True)
class Event:
    """Something that happened: a phase began, the block lifted, the table tripped.

    `time` is on the table's clock, s; `name` is short and stable ("uplift", "impact", "trip"), `message` is a sentence.
    """

    time: float
    host_time_ns: int
    level: Level
    name: str
    message: str


class Sink(Protocol):
    """Takes what the loop leaves behind. No method may block the loop or raise into it."""

    def cycle(self, record: CycleRecord) -> None: ...

    def missed(self, missed: Missed) -> None: ...

    def event(self, event: Event) -> None: ...


class Tee:
    """A sink that hands everything to several."""

    def __init__(self, *sinks: Sink) -> None:
        self._sinks = sinks

    def cycle(self, record: CycleRecord) -> None:
        """Hand on an executed cycle."""
        for sink in self._sinks:
            sink.cycle(record)

    def missed(self, missed: Missed) -> None:
        """Hand on a gap."""
        for sink in self._sinks:
            sink.missed(missed)

    def event(self, event: Event) -> None:
        """Hand on an event."""
        for sink in self._sinks:
            sink.event(event)
