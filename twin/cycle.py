"""What one control cycle leaves behind, and who takes it.

The live loop produces these values; it does not know whether a recorder, a test or nobody listens.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal, Protocol

Level = Literal["info", "warning", "error"]
Outlook = Literal["unknown", "stayed", "rocked", "overturned", "undecided"]
"""How a forecast ends: "unknown", or a value of `twin.rocking.response.Outcome`."""
Advice = Literal["none", "continue", "stopping helps", "stopping would topple it", "too late", "undecided"]


@dataclass(frozen=True, slots=True)
class Forecasted:
    """What will happen next, as seen in one cycle: if the run goes on, and if the ramp-down began now.

    Attributes
    ----------
    continue_outcome, stop_outcome : Outlook
        How it ends for the block.
    continue_margin, stop_margin : float
        Energy missing to the barrier of overturning, over the barrier; negative beyond it.
    continue_probability, stop_probability : float
        Of overturning, 0 to 1, counted in `futures` futures.
    continue_overturning, stop_overturning : float
        Time from this cycle until the block lies on its side, s; NaN where it does not.
    advice : Advice
    age : float
        Time from the state the forecast starts at to this cycle, s.
    futures : int
    continue_earliest, continue_latest, stop_earliest, stop_latest : float
        As `continue_overturning`, of the first and the last of the futures that overturn.
    """

    continue_outcome: Outlook
    continue_margin: float
    continue_probability: float
    continue_overturning: float
    stop_outcome: Outlook
    stop_margin: float
    stop_probability: float
    stop_overturning: float
    advice: Advice
    age: float
    futures: int
    continue_earliest: float = math.nan
    continue_latest: float = math.nan
    stop_earliest: float = math.nan
    stop_latest: float = math.nan


@dataclass(frozen=True, slots=True)
class Estimated:
    """The observer's state in one cycle.

    Attributes
    ----------
    rotation, angular_velocity : float
        rad and rad/s; the prediction, corrected by the measured rotation.
    restitution, restitution_deviation : float
        Ratio of angular velocities over an impact as estimated so far, and its standard deviation.
    slenderness, slenderness_deviation : float
        The same of the slenderness angle, rad.
    innovation : float
        Measured rotation minus the one estimated before it was known, rad.
    """

    rotation: float
    angular_velocity: float
    restitution: float
    restitution_deviation: float
    slenderness: float = math.nan
    slenderness_deviation: float = math.nan
    innovation: float = math.nan


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
    forecast : Forecasted or None
        Where one was made in this cycle.
    estimate : Estimated or None
        Where an observer runs.
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
    forecast: Forecasted | None = None
    estimate: Estimated | None = None


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


@dataclass(frozen=True, slots=True)
class CanFrame:
    """A data frame that passed the host's CAN port: an 11-bit identifier and up to 8 bytes, sent or received."""

    host_time_ns: int
    identifier: int
    data: bytes
    sent: bool


class Sink(Protocol):
    """Takes what the loop leaves behind. No method may block the loop or raise into it."""

    def cycle(self, record: CycleRecord) -> None: ...

    def missed(self, missed: Missed) -> None: ...

    def event(self, event: Event) -> None: ...


class FrameSink(Protocol):
    """Takes CAN frames beside the cycles. It must neither block nor raise."""

    def frame(self, frame: CanFrame) -> None: ...


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
