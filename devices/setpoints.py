"""Which set-points a table may be sent: one rule, used by the host before sending and by the drive on receipt.

Frames carry positions only, so velocity and acceleration are divided differences of the positions sent. The first
difference is a mean of the true velocity, twice the second divided difference a weighted mean of the true acceleration,
whatever cycles were left out between them. A motion inside the capacity therefore always passes, and only the rounding
of positions to the resolution q of the frames needs an allowance: q / h in velocity and 2 q / h^2 in acceleration for
steps of h (1 nm at 1 kHz: 1e-6 m/s and 2e-3 m/s2).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Iterable

    from excitation import Capacity


def checked_cycle_time(cycle_time: float) -> float:
    """Return `cycle_time`, s; a ValueError where it is not finite and above 0."""
    if not (math.isfinite(cycle_time) and cycle_time > 0.0):
        raise ValueError(f"cycle time is {cycle_time} s; it must be finite and above 0 s")
    return cycle_time


class Refusal(NamedTuple):
    """Why a set-point is not taken: the limit's short name, and a sentence."""

    limit: str
    sentence: str


class SetpointLimits:
    """Judges position set-points against a capacity.

    Parameters
    ----------
    capacity : excitation.Capacity
        Stroke (total, m), velocity (m/s) and acceleration (m/s2) count. Jerk and frequency do not: they belong to the
        closed form of a motion and are settled by `excitation.clip`.
    cycle_time : float
        Time between two set-points of consecutive cycles, s.
    resolution : float
        Step of the positions a frame can carry, m.
    """

    def __init__(self, capacity: Capacity, cycle_time: float, resolution: float) -> None:
        checked_cycle_time(cycle_time)
        self.name = capacity.name
        self.lower, self.upper = -0.5 * capacity.stroke, 0.5 * capacity.stroke
        self.top_velocity = capacity.velocity
        self.top_acceleration = capacity.acceleration
        self.cycle_time = cycle_time
        self.resolution = resolution
        self.start(-1, 0.0)

    def start(self, cycle: int, position: float) -> None:
        """Begin at rest at `position`, m, as if it had been the set-point of `cycle` and of the one before."""
        self._cycle = cycle
        self.position = position
        self._step = 1
        self.velocity = 0.0
        self.acceleration = 0.0

    def narrow(self, lower: float, upper: float, velocity: float, acceleration: float) -> None:
        """Judge by these limits instead of the capacity's: positions m, m/s, m/s2."""
        self.lower, self.upper, self.top_velocity, self.top_acceleration = lower, upper, velocity, acceleration

    def outside(self, position: float) -> Refusal | None:
        """Judge `position`, m, against the stroke alone."""
        slack = 0.5 * self.resolution
        if self.lower - slack <= position <= self.upper + slack:
            return None
        end = self.upper if position > self.upper else self.lower
        sentence = f"set-point asks {position:.9f} m from the centre; {self.name} has {abs(end):.9g} m"
        return Refusal("stroke", sentence)

    def refusal(self, cycle: int, position: float) -> Refusal | None:
        """Judge `position`, m, as the set-point of `cycle`; None where it is inside the capacity."""
        if (beyond := self.outside(position)) is not None:
            return beyond
        velocity, acceleration = self._differences(cycle, position)
        step = (cycle - self._cycle) * self.cycle_time
        previous_step = self._step * self.cycle_time
        velocity_rounding = self.resolution / step
        acceleration_rounding = 2.0 * (velocity_rounding + self.resolution / previous_step) / (step + previous_step)
        if abs(velocity) > self.top_velocity + velocity_rounding:
            asked = f"set-point of cycle {cycle} asks {abs(velocity):.6f} m/s"
            return Refusal("velocity", f"{asked}; {self.name} has {self.top_velocity:.6g} m/s")
        if abs(acceleration) > self.top_acceleration + acceleration_rounding:
            asked = f"set-point of cycle {cycle} asks {abs(acceleration):.4f} m/s2"
            return Refusal("acceleration", f"{asked}; {self.name} has {self.top_acceleration:.6g} m/s2")
        # v <= mean v - A h / 2 at the end of a step that brakes with A; from there v^2 / (2 A) must fit.
        speed = max(0.0, abs(velocity) - velocity_rounding - 0.5 * self.top_acceleration * step)
        braking = speed * speed / (2.0 * self.top_acceleration)
        room = self.room(position, velocity)
        if braking > room + self.resolution:
            asked = f"set-point of cycle {cycle} needs {braking:.6f} m to stop"
            return Refusal("braking", f"{asked}; {self.name} has {max(room, 0.0):.6f} m left")
        return None

    def accept(self, cycle: int, position: float) -> None:
        """Take `position`, m, as the set-point of `cycle`; the next ones are judged from it."""
        self.velocity, self.acceleration = self._differences(cycle, position)
        self._step = cycle - self._cycle
        self._cycle = cycle
        self.position = position

    def room(self, position: float, velocity: float) -> float:
        """Stroke left ahead of `position`, m, in the direction of `velocity`."""
        return self.upper - position if velocity >= 0.0 else position - self.lower

    def _differences(self, cycle: int, position: float) -> tuple[float, float]:
        step = (cycle - self._cycle) * self.cycle_time
        velocity = (position - self.position) / step
        acceleration = 2.0 * (velocity - self.velocity) / (step + self._step * self.cycle_time)
        return velocity, acceleration


def first_refusal(
    capacity: Capacity, cycle_time: float, resolution: float, start: float, positions: Iterable[float]
) -> Refusal | None:
    """Judge a whole sampled command, a set-point a cycle from rest at `start`, m; None where none is refused.

    Where the capacity limits the jerk, the third difference is judged too: there is no closed form that was clipped.

    Examples
    --------
    >>> from excitation import Capacity
    >>> bench = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0)
    >>> first_refusal(bench, 1e-3, 1e-9, 0.0, [0.0, 1e-5, 3e-5]) is None
    True
    >>> first_refusal(bench, 1e-3, 1e-9, 0.0, [0.0, 1.1e-5]).limit
    'acceleration'
    """
    limits = SetpointLimits(capacity, cycle_time, resolution)
    position = round(start / resolution) * resolution
    limits.start(-1, position)
    top_jerk = math.inf if capacity.jerk is None else capacity.jerk + 4.0 * resolution / cycle_time**3
    for cycle, asked in enumerate(positions):
        position = round(asked / resolution) * resolution
        if (refusal := limits.refusal(cycle, position)) is not None:
            return refusal
        before = limits.acceleration
        limits.accept(cycle, position)
        if (jerk := abs(limits.acceleration - before) / cycle_time) > top_jerk:
            sentence = f"set-point of cycle {cycle} asks {jerk:.1f} m/s3; {capacity.name} has {capacity.jerk:.6g} m/s3"
            return Refusal("jerk", sentence)
    return None
