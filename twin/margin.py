"""How much more, or less, amplitude changes whether the block overturns."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from excitation import Motion, Pulse, ReleasedRun
from excitation.demand import ends_moving
from excitation.pieces import assemble, steady
from excitation.speed_change import speed_change
from twin.rehearsal import Rehearsal, brake_of, initial_rotation, make_motion
from twin.rocking.compiled import FloatArray
from twin.rocking.run import parameters
from twin.simulation import overturns

MARGIN_RANGE = 0.5
MARGIN_STEP = 0.001
"""The margin is looked for over +-50 % of the amplitude, in steps of 0.1 % of it; a thinner window can be missed."""
CLOSE_ENOUGH = 1e-9
"""Relative amplitude to which the change of outcome is closed in on."""


@dataclass(frozen=True, slots=True)
class Margin:
    """Smallest relative changes of amplitude that change whether the block overturns; None where 50 % does not.

    `up` is positive, `down` negative: +0.08 means that 8 % more changes the outcome.
    """

    up: float | None
    down: float | None
    searched_up: float = MARGIN_RANGE
    """How far up was looked: less than `MARGIN_RANGE` where there is no larger pulse of the kind."""

    @property
    def smallest(self) -> float | None:
        """The nearer of the two."""
        known = [value for value in (self.up, self.down) if value is not None]
        return min(known, key=abs) if known else None


def find_margin(rehearsal: Rehearsal, pulse: Pulse) -> Margin:
    """Search both ways for the nearest amplitude of `pulse` with another outcome, then close in on it by bisection.

    The brake keeps its deceleration: a stronger pulse that ends moving is braked for longer. The table's limits are not
    asked: they are the clip's business.
    """
    body = parameters(rehearsal.block, rehearsal.restitution)
    pieces = shaking_of(rehearsal)
    tilt = initial_rotation(rehearsal.scene)

    def falls(change: float) -> bool | None:
        return overturns(body, pieces(pulse.scaled(1.0 + change)), rotation=tilt)

    now = falls(0.0)
    largest = _largest_change(pulse, pieces)

    def nearest(direction: float) -> float | None:
        inside = 0.0
        for k in range(1, round(MARGIN_RANGE / MARGIN_STEP) + 1):
            outside = direction * k * MARGIN_STEP
            if outside > largest:
                return None
            if falls(outside) != now:
                while abs(outside - inside) > CLOSE_ENOUGH:
                    middle = 0.5 * (inside + outside)
                    inside, outside = (inside, middle) if falls(middle) != now else (middle, outside)
                return outside
            inside = outside
        return None

    return Margin(nearest(1.0), nearest(-1.0), largest)


def shaking_of(rehearsal: Rehearsal) -> Callable[[Pulse], FloatArray]:
    """Return what makes the pieces of base motion that decide the outcome of a pulse, as `rehearsal.motion` has them.

    From rest that is the pulse with its coast and brake. A block let go with a tilt feels the way to the start as well.
    """
    scene, capacity, motion = rehearsal.scene, rehearsal.capacity, rehearsal.motion
    tilted = initial_rotation(scene) != 0.0
    if isinstance(motion, ReleasedRun):
        run = motion
        if tilted:
            return lambda pulse: replace(run, pulse=pulse).pieces
        return lambda pulse: replace(run, pulse=pulse).shaking.pieces
    if tilted:
        wait = motion.wait if isinstance(motion, Motion) else None
        return lambda pulse: make_motion(scene, None, pulse, wait=wait).pieces

    brake, coast, jerk = brake_of(scene, capacity), scene.table.coast_s, capacity.jerk

    def braked(pulse: Pulse) -> FloatArray:
        if not ends_moving(pulse):
            return pulse.pieces
        still = [steady(coast)] if coast > 0.0 else []
        tail = assemble([*still, *speed_change(-pulse.final_velocity, brake, jerk)])
        tail[:, :2] += pulse.duration
        tail[1:, 0] = tail[:-1, 1]
        return np.concatenate([pulse.pieces, tail])

    return braked


def _largest_change(pulse: Pulse, pieces: Callable[[Pulse], FloatArray]) -> float:
    """Return the largest relative change of amplitude up to `MARGIN_RANGE` at which there still is such a pulse.

    A double pulse reaches no more speed than its gap leaves room for.
    """
    for k in range(round(MARGIN_RANGE / MARGIN_STEP), 0, -1):
        try:
            pieces(pulse.scaled(1.0 + k * MARGIN_STEP))
        except ValueError:
            continue
        return k * MARGIN_STEP
    return 0.0
