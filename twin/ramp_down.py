"""The emergency ramp-down from any moment of a run: how hard, how long, how far; known before anything is armed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from excitation import Capacity, TableRun
from twin.scene import Scene
from twin.stopping import stop_deceleration

LOOKED_AT = 1e-3
"""Time between two moments that are looked at, s."""


@dataclass(frozen=True, slots=True)
class RampDown:
    """A stop begun at `time`, s: constant `deceleration`, m/s2, for `duration`, s, over `distance`, m.

    The deceleration is the gentle one unless the stroke left asks for more: the least then that ends inside the stroke.
    It is infinite where none does.
    """

    time: float
    deceleration: float
    duration: float
    distance: float


@dataclass(frozen=True, slots=True)
class RampDowns:
    """What stopping would take, over a whole run.

    Attributes
    ----------
    gentle : float
        Deceleration as long as the stroke left allows it, m/s2: `twin.stopping.stop_deceleration`.
    longest : RampDown
        The one that takes most time.
    hardest : RampDown
        The one with the largest deceleration.
    rocking_from, rocking_until : float or None
        First and last moment at which a stop must be steeper than g tan(alpha), which lifts a block at rest, s; None
        where there is none.
    soft_limit : float
        Positions a stop stays within, m from the centre.
    """

    gentle: float
    longest: RampDown
    hardest: RampDown
    rocking_from: float | None
    rocking_until: float | None
    soft_limit: float


def ramp_down(time: float, position: float, velocity: float, gentle: float, soft_limit: float) -> RampDown:
    """Return the stop of a base at `position`, m, with `velocity`, m/s, begun at `time`, s.

    Examples
    --------
    >>> ramp_down(0.0, 0.0, 0.2, 1.0, 0.1)
    RampDown(time=0.0, deceleration=1.0, duration=0.2, distance=0.020000000000000004)
    >>> round(ramp_down(0.0, 0.09, 0.2, 1.0, 0.1).deceleration, 9)  # 10 mm are left
    2.0
    """
    if velocity == 0.0:
        return RampDown(time, gentle, 0.0, 0.0)
    room = soft_limit - math.copysign(1.0, velocity) * position
    least = math.inf if room <= 0.0 else velocity * velocity / (2.0 * room)
    deceleration = max(gentle, least)
    return RampDown(time, deceleration, abs(velocity) / deceleration, velocity * velocity / (2.0 * deceleration))


def ramp_downs(motion: TableRun, scene: Scene, capacity: Capacity) -> RampDowns:
    """Return what stopping takes at every moment of `motion` on a table of `capacity`.

    Moments are `LOOKED_AT` apart.
    """
    gentle, soft_limit = stop_deceleration(scene, capacity), 0.5 * capacity.stroke
    times = np.arange(0.0, motion.duration, LOOKED_AT)
    positions, velocities = motion.displacement(times), motion.velocity(times)
    # Most of a run stands still: nothing is to be stopped then.
    moving = np.flatnonzero(velocities)
    stops = [
        ramp_down(t, x, v, gentle, soft_limit)
        for t, x, v in zip(times[moving].tolist(), positions[moving].tolist(), velocities[moving].tolist(), strict=True)
    ] or [ramp_down(0.0, 0.0, 0.0, gentle, soft_limit)]
    lifting = scene.block.block().uplift_acceleration
    rocking = [stop.time for stop in stops if stop.duration > 0.0 and stop.deceleration > lifting]
    return RampDowns(
        gentle,
        max(stops, key=lambda stop: stop.duration),
        max(stops, key=lambda stop: stop.deceleration),
        rocking[0] if rocking else None,
        rocking[-1] if rocking else None,
        soft_limit,
    )


def ramp_down_lines(stops: RampDowns) -> list[str]:
    """Return what the operator reads before arming."""
    longest, hardest = stops.longest, stops.hardest
    lines = [
        f"limits     the base stays within +-{stops.soft_limit * 1e3:.1f} mm, in every stop too",
        f"stopping   {stops.gentle:.3g} m/s2 where the stroke left allows it; at most {longest.duration:.2f} s over "
        f"{longest.distance * 1e3:.0f} mm, at {longest.time:.2f} s",
    ]
    if hardest.deceleration > stops.gentle:
        lines.append(
            f"           at {hardest.time:.2f} s the stroke left asks for {hardest.deceleration:.3g} m/s2 over "
            f"{hardest.distance * 1e3:.0f} mm"
        )
    if stops.rocking_from is not None and stops.rocking_until is not None:
        lines.append(
            f"           between {stops.rocking_from:.2f} and {stops.rocking_until:.2f} s a stop may have to be steep "
            "enough to rock a block that stands still"
        )
    return lines
