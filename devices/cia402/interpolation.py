"""The set-point a drive in cyclic synchronous position mode really follows, cycle by cycle.

Between two set-points it is linear. Where a set-point does not come the drive goes on with the last velocity and
acceleration (a held position would be a jump of velocity) for a stated number of cycles, as long as that stays inside
the capacity; then it stops on a ramp. Where one comes again, after a gap, it may be further away than the capacity
lets a cycle reach: the drive then catches up as fast as the capacity allows, and never jumps.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.setpoints import SetpointLimits

if TYPE_CHECKING:
    from devices.setpoints import Refusal
    from excitation import Capacity


# Set-points get this far beyond the limits, m, in homing alone: it is not bounded by them.
_OUTSIDE = 1e-6


class Interpolator:
    """Holds, follows or stops; one call of `step` is one cycle.

    Parameters
    ----------
    capacity, cycle_time, resolution
        As for `SetpointLimits`.
    stop_deceleration : float
        Of the ramp, m/s2 (object 6085). Where the stroke left is too short for it the ramp is as much steeper as it has
        to be, which is never more than the capacity's acceleration: the limits keep that much room.
    patience : int
        Cycles without a set-point that are bridged.
    """

    def __init__(
        self, capacity: Capacity, cycle_time: float, resolution: float, stop_deceleration: float, patience: int
    ) -> None:
        self.limits = SetpointLimits(capacity, cycle_time, resolution)
        self.stop_deceleration = min(stop_deceleration, capacity.acceleration)
        self.patience = patience
        self.position = 0.0
        self.velocity = 0.0
        self.missing = 0
        self._acceleration = 0.0
        self._target: float | None = None
        self._following = False

    @property
    def at_rest(self) -> bool:
        """Whether the set-point stands still and no new one is awaited."""
        return not self._following and self.velocity == 0.0

    @property
    def following(self) -> bool:
        """Whether set-points are taken."""
        return self._following

    def hold(self, position: float) -> None:
        """Stand at `position`, m."""
        self.position, self.velocity, self._following = position, 0.0, False

    def begin(self, cycle: int, position: float) -> None:
        """Begin to follow set-points in `cycle`, at rest, the first of them being `position`, m."""
        self.limits.start(cycle, position)
        self.velocity = self._acceleration = 0.0
        self._target = position
        self._following = True
        self.missing = 0

    def offer(self, cycle: int, position: float) -> Refusal | None:
        """Take `position`, m, as where to be at the end of `cycle`, or say why not."""
        if (refusal := self.limits.refusal(cycle, position)) is not None:
            return refusal
        self.limits.accept(cycle, position)
        self._acceleration = self.limits.acceleration
        self._target = position
        return None

    def bridge(self, cycles: int, position: float) -> list[float]:
        """Return the set-points of the `cycles` that were left out before `position`, m, is to be reached.

        One cubic with the last target, its velocity and acceleration at the start and `position` at the end; empty
        where it would leave the stroke, or nothing is followed. For a drive whose clock stood still with its host's.
        """
        if self._target is None:
            return []
        limits, h = self.limits, self.limits.cycle_time
        start, curvature = self._target, limits.acceleration
        # The mean velocity of the last step, brought to its end.
        velocity = limits.velocity + 0.5 * curvature * h
        end = (cycles + 1) * h
        rest = (position - start - velocity * end - 0.5 * curvature * end * end) / end**3
        times = (h * k for k in range(1, cycles + 1))
        positions = [start + t * (velocity + t * (0.5 * curvature + t * rest)) for t in times]
        return [] if any(limits.outside(x) for x in positions) else positions

    def go(self, position: float) -> None:
        """Be at `position`, m, at the end of the next cycle: a point of `bridge`."""
        if self._following:
            self._target = position

    def lead(self, position: float, velocity: float) -> None:
        """Be at `position`, m, with `velocity`, m/s, as something else (homing) wants it; `stop` ramps down from it."""
        self.position, self.velocity, self._following = position, velocity, False

    def stop(self, deceleration: float | None = None) -> None:
        """Take no more set-points; ramp down from here, with `deceleration`, m/s2, where it is given."""
        if deceleration is not None:
            self.stop_deceleration = min(deceleration, self.limits.top_acceleration)
        self._following = False
        self._target = None

    def step(self) -> float:
        """Return where the set-point is at the end of this cycle, m."""
        if not self._following:
            return self._ramp()
        if self._target is not None:
            target, self._target = self._target, None
            self.missing = 0
            return self._approach(target)
        self.missing += 1
        if self.missing > self.patience or not self._extrapolate():
            self.stop()
            return self._ramp()
        return self.position

    def _approach(self, target: float) -> float:
        limits, h = self.limits, self.limits.cycle_time
        top, grain = limits.top_acceleration, limits.resolution / h
        velocity = (target - self.position) / h
        reached = abs(velocity) <= limits.top_velocity + grain
        reached = reached and abs(velocity - self.velocity) <= top * h + 4.0 * grain
        # v after the step, less what the next one takes off it, must be braked within the room left: see `_ramp`.
        excess = abs(velocity) - 0.5 * top * h
        if reached and (excess <= 0.0 or excess**2 <= 2.0 * top * (limits.room(target, velocity) + limits.resolution)):
            self.position, self.velocity = target, velocity
            return target
        # With half of the acceleration left for it, what is behind by e closes in with sqrt(2 (A / 2) e).
        behind = target - self.position - limits.velocity * h
        closing = min(math.sqrt(top * abs(behind)), abs(behind) / h)
        velocity = limits.velocity + math.copysign(closing, behind)
        velocity = min(max(velocity, self.velocity - top * h), self.velocity + top * h)
        room = max(0.0, limits.room(self.position, velocity))
        fastest = min(limits.top_velocity, max(0.0, math.sqrt(2.0 * top * room) - 0.5 * top * h))
        self.velocity = math.copysign(min(abs(velocity), fastest), velocity)
        self.position += self.velocity * h
        return self.position

    def _extrapolate(self) -> bool:
        limits, h = self.limits, self.limits.cycle_time
        velocity = self.velocity + self._acceleration * h
        position = self.position + velocity * h
        speed = max(0.0, abs(velocity) - 0.5 * limits.top_acceleration * h)
        room = limits.room(position, velocity)
        if abs(velocity) > limits.top_velocity or speed * speed > 2.0 * limits.top_acceleration * room:
            return False
        self.position, self.velocity = position, velocity
        return True

    def _ramp(self) -> float:
        if self.velocity == 0.0:
            return self.position
        h = self.limits.cycle_time
        speed = abs(self.velocity)
        room = self.limits.room(self.position, self.velocity)
        if room < -_OUTSIDE:
            return self._slower(self.stop_deceleration)
        room = max(0.0, room)
        # Steps that lose d h of velocity each stop within (v - d h / 2)^2 / (2 d); the least d for the room left.
        s = speed * h + 2.0 * room
        least = 2.0 * speed * speed / (s + math.sqrt(max(0.0, s * s - speed * speed * h * h)))
        # While homing it may come here faster than set-points are let: the table's own limit comes first then.
        return self._slower(max(self.stop_deceleration, min(least, self.limits.top_acceleration)))

    def _slower(self, deceleration: float) -> float:
        h = self.limits.cycle_time
        slower = max(0.0, abs(self.velocity) - deceleration * h)
        self.velocity = math.copysign(slower, self.velocity) if slower > 0.0 else 0.0
        self.position += self.velocity * h
        return self.position
