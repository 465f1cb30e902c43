"""Trips: what stops a run, judged every cycle, latched, each with its level and action from the scene.

Pure: no clock, no device. The live loop shows every cycle to `Trips.judge` and reports what the devices say with
`Trips.report`; it gets back what is to be done.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from twin.scene_trips import Action, TripsPart

if TYPE_CHECKING:
    from collections.abc import Iterator

    from excitation import Capacity

Name = Literal[
    "following_error",
    "prediction_error",
    "forecast",
    "rotation",
    "capacity",
    "overrun",
    "connection",
    "sensor",
    "operator",
    "drive",
    "recorder",
]
"""Causes. `drive` is a fault or stop of the drive's own, `recorder` a recording that came to an end."""

SEVERITY: dict[Action, int] = {"off": 0, "indicate": 1, "ramp_down": 2, "cut_power": 3}
ALWAYS: dict[Name, Action] = {"drive": "ramp_down", "recorder": "ramp_down"}
"""Causes no scene can switch off."""


@dataclass(frozen=True, slots=True)
class Trip:
    """A latched trip.

    Attributes
    ----------
    name : str
        Its cause.
    time : float
        Table's clock, s.
    action : str
        What it asks for.
    reason : str
        A sentence: what was seen, and the limit.
    """

    name: Name
    time: float
    action: Action
    reason: str

    @property
    def stops(self) -> bool:
        """Whether the table is to be stopped."""
        return SEVERITY[self.action] >= SEVERITY["ramp_down"]

    @property
    def cuts_power(self) -> bool:
        """Whether the power is to go off at once."""
        return self.action == "cut_power"


@dataclass(slots=True)
class Seen:
    """What the trips look at in one cycle; the loop keeps one and fills it anew.

    Attributes
    ----------
    cycle : int
    time : float
        Table's clock, s.
    command, position : float
        Set-point the feedback answers, and the feedback, m.
    rotation : float
        Measured, rad; NaN without a sensor.
    estimate : float
        Estimated rotation before this sample corrected it, rad; NaN without an observer.
    probability, probability_if_stopped : float
        Of overturning, forecast for going on and for ramping down now; NaN without a forecast.
    lying : bool
        Whether the specimen has overturned already.
    """

    cycle: int = 0
    time: float = 0.0
    command: float = 0.0
    position: float = 0.0
    rotation: float = math.nan
    estimate: float = math.nan
    probability: float = math.nan
    probability_if_stopped: float = math.nan
    lying: bool = False


class Trips:
    """All trips of one run.

    Contract: a trip latches once and stays; `judge` and `report` return it only in the cycle it latches; `off` never
    latches; nothing here raises or waits.

    Parameters
    ----------
    levels : TripsPart
        Of the scene.
    slenderness : float
        The block's alpha, rad.
    capacity : excitation.Capacity
        The table's.
    cycle_time : float
        s.
    """

    def __init__(self, levels: TripsPart, slenderness: float, capacity: Capacity, cycle_time: float) -> None:
        self.latched: list[Trip] = []
        self._levels = levels
        self._names: set[Name] = set()
        self._cycle_time = cycle_time
        self._rotation_limit = levels.rotation.limit_alpha * slenderness
        self._following_limit = levels.following_error.limit_mm / 1e3
        # A released machine's positions are counted from where its base is held, which may be one end of the stroke.
        self._stroke = (0.5 if capacity.machine is None else 1.0) * capacity.stroke
        self._origin = "the centre" if capacity.machine is None else "where it is held"
        self._velocity = capacity.velocity * (1.0 + levels.capacity.margin_percent / 100.0)
        self._capacity = capacity
        self._lasting: dict[Name, float] = {}
        # One second of cycles: first cycle and count of every gap in it.
        self._gaps: deque[tuple[int, int]] = deque()
        self._window = max(1, round(1.0 / cycle_time))
        # The encoder's steps are no velocity: the base is watched over this many cycles.
        self._span = max(1, round(VELOCITY_SPAN / cycle_time))
        self._track: deque[tuple[float, float]] = deque(maxlen=self._span + 1)

    @property
    def stopping(self) -> Trip | None:
        """The first latched trip that stops the table, the one that cuts the power before others; None to go on."""
        stops = [trip for trip in self.latched if trip.stops]
        return max(stops, key=lambda trip: SEVERITY[trip.action], default=None)

    def judge(self, seen: Seen) -> list[Trip]:
        """Return the trips that latch in this cycle."""
        fresh: list[Trip] = []
        for name, reason in self._reasons(seen):
            trip = self.report(name, seen.time, reason)
            if trip is not None:
                fresh.append(trip)
        return fresh

    def report(self, name: Name, time: float, reason: str) -> Trip | None:
        """Latch a trip somebody else found at `time`, s; None where it is off or latched already."""
        action: Action = ALWAYS[name] if name in ALWAYS else getattr(self._levels, name).action
        if action == "off" or name in self._names:
            return None
        self._names.add(name)
        trip = Trip(name, time, action, reason)
        self.latched.append(trip)
        return trip

    def missed(self, first: int, last: int, time: float) -> Trip | None:
        """Take a gap in the cycles, both ends included; return the overrun trip where it latches."""
        count = last - first + 1
        limits = self._levels.overrun
        self._gaps.append((first, count))
        while self._gaps[0][0] + self._gaps[0][1] < last - self._window:
            self._gaps.popleft()
        if count > limits.in_a_row:
            return self.report("overrun", time, f"{count} cycles in a row were missed; the limit is {limits.in_a_row}")
        share = 100.0 * sum(n for _, n in self._gaps) / self._window
        if share > limits.share_percent:
            what = f"{share:.0f} % of the last second's cycles were missed; the limit is {limits.share_percent:g} %"
            return self.report("overrun", time, what)
        return None

    def _reasons(self, seen: Seen) -> Iterator[tuple[Name, str]]:
        levels = self._levels
        error = abs(seen.command - seen.position)
        if error > self._following_limit:
            limit = levels.following_error.limit_mm
            yield "following_error", f"the table is {error * 1e3:.2f} mm from its command; the limit is {limit:g} mm"
        yield from self._beyond_capacity(seen)
        if abs(seen.rotation) > self._rotation_limit:
            what = f"the block is measured at {seen.rotation:+.4f} rad; the limit is {self._rotation_limit:.4f} rad"
            yield "rotation", what
        apart = abs(seen.estimate - seen.rotation)
        limit = levels.prediction_error
        if self._lasts("prediction_error", apart > limit.limit_rad, seen.time, limit.lasting_s):
            yield (
                "prediction_error",
                f"estimate and measurement are {apart:.4f} rad apart; the limit is {limit.limit_rad:g} rad",
            )
        forecast = levels.forecast
        falls = seen.probability >= forecast.probability and not seen.lying
        if forecast.action == "ramp_down":
            falls = falls and seen.probability_if_stopped < seen.probability
        if self._lasts("forecast", falls, seen.time, forecast.lasting_s):
            chance = f"the block overturns with a probability of {seen.probability:.2f}"
            yield "forecast", f"{chance} if the run goes on, {seen.probability_if_stopped:.2f} if it stops now"

    def _beyond_capacity(self, seen: Seen) -> Iterator[tuple[Name, str]]:
        name = self._capacity.name
        if abs(seen.position) > self._stroke + STROKE_SLACK:
            reach = f"the base is measured {abs(seen.position) * 1e3:.2f} mm from {self._origin}"
            yield "capacity", f"{reach}; {name} has {self._stroke * 1e3:.2f} mm"
        self._track.append((seen.time, seen.position))
        if len(self._track) == self._track.maxlen:
            (t0, x0), (t1, x1) = self._track[0], self._track[-1]
            if t1 > t0 and (speed := abs(x1 - x0) / (t1 - t0)) > self._velocity:
                yield "capacity", f"the base is measured at {speed:.3f} m/s; {name} has {self._capacity.velocity:g} m/s"

    def _lasts(self, name: Name, now: bool, time: float, needed: float) -> bool:
        """Return whether a condition has held without a break for `needed` s."""
        if not now:
            self._lasting.pop(name, None)
            return False
        return time - self._lasting.setdefault(name, time) >= needed


VELOCITY_SPAN = 0.005
"""Time over which the measured velocity is a mean, s: an encoder step of 1.55 um is then 0.3 mm/s."""
STROKE_SLACK = 1e-3
"""A base measured beyond its stroke by less is the loop's overshoot or the encoder's zero, m."""
