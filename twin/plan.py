"""Plan a run without a device: what the table can do of it, what the block will do, how far from toppling that is."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from excitation import Capacity, Clipped, Motion, Pulse, clip
from excitation.demand import ends_moving
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Outcome, Response
from twin.rocking.run import parameters
from twin.scene import Scene
from twin.scene_parts import NoShaking
from twin.simulation import overturns, simulate

POSITIONING_SHARE = 0.5
"""Positioning stays under this share of g tan(alpha), so that it cannot rock the block."""
MARGIN_RANGE = 0.5
MARGIN_STEP = 0.001
"""The margin is looked for over +-50 % of the amplitude, in steps of 0.1 % of it; a thinner window can be missed."""
AFTERWARDS = 0.5
"""Time left after the block is predicted to rest or lie, s."""
LONGEST_WAIT = 60.0
"""A block that rocks longer than this after the pulse is not waited for before the table returns, s."""


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


@dataclass(frozen=True, slots=True)
class Futures:
    """What became of `count` runs with restitution, slenderness and initial tilt drawn from their spreads.

    `responses` are the first of them in full, for the picture.
    """

    count: int
    overturned: int
    undecided: int
    responses: tuple[Response, ...]


@dataclass(frozen=True, slots=True)
class Plan:
    """A planned run. `response`, `margin` and `futures` are None where the table cannot make any such pulse."""

    scene: Scene
    block: Block
    restitution: float
    capacity: Capacity
    clipped: Clipped | None
    motion: Motion | None
    response: Response | None
    margin: Margin | None
    futures: Futures | None

    @property
    def feasible(self) -> bool:
        """Whether the table can perform the excitation exactly as asked."""
        return self.motion is not None and (self.clipped is None or self.clipped.feasible)

    @property
    def stays_up(self) -> bool:
        """Whether the block is predicted not to overturn."""
        return self.response is not None and self.response.outcome in (Outcome.STAYED, Outcome.ROCKED)


def make_motion(scene: Scene, capacity: Capacity, pulse: Pulse | None, *, wait: float | None = None) -> Motion:
    """Return the whole run of the table around `pulse`; `wait` s are left for the block before the return."""
    if pulse is None:
        duration = scene.excitation.duration_s if isinstance(scene.excitation, NoShaking) else 1.0
        return Motion.standstill(duration)
    block = scene.block.block()
    return Motion(
        pulse,
        POSITIONING_SHARE * block.uplift_acceleration,
        capacity=capacity,
        brake=brake_of(scene, capacity),
        coast=scene.table.coast_s,
        settle=scene.table.settle_s,
        wait=wait,
    )


def brake_of(scene: Scene, capacity: Capacity) -> float:
    """Return the deceleration that ends a pulse which ends moving, m/s2: the scene's, or half of g tan(alpha)."""
    if scene.table.brake_m_s2 is not None:
        return scene.table.brake_m_s2
    return min(POSITIONING_SHARE * scene.block.block().uplift_acceleration, capacity.acceleration)


def clip_scene(scene: Scene, capacity: Capacity, pulse: Pulse) -> Clipped:
    """Return the scene's pulse clipped to the table; raises `InputError` where the question itself is wrong."""
    try:
        return clip(
            pulse,
            capacity,
            brake=brake_of(scene, capacity),
            coast=scene.table.coast_s,
            payload=scene.block.mass_kg,
        )
    except ValueError as error:
        raise InputError(f"scene {scene.name}: {error}") from None


class NotPossibleError(InputError):
    """The table can make no pulse of the kind asked for."""

    def __init__(self, scene: Scene, block: Block, restitution: float, clipped: Clipped) -> None:
        super().__init__(f"scene {scene.name}: {clipped.limits[0].sentence}")
        self.block = block
        self.restitution = restitution
        self.clipped = clipped


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """A run before it is made: what the table will be told and what the block is predicted to do of it.

    `after` is how long the table is held still at the end for the block, s.
    """

    scene: Scene
    block: Block
    restitution: float
    capacity: Capacity
    clipped: Clipped | None
    motion: Motion
    response: Response
    after: float


def rehearse(scene: Scene, capacity: Capacity) -> Rehearsal:
    """Clip the scene's excitation, lay the whole motion out around it, and predict the block.

    Raises
    ------
    InputError
        Where the table can make no such pulse, or the scene's numbers cannot be used together.
    """
    block = scene.block.block()
    eta = block.housner_restitution if scene.block.restitution is None else scene.block.restitution
    tilt = math.radians(scene.block.initial_rotation_deg)
    pulse = scene.pulse()
    clipped = None if pulse is None else clip_scene(scene, capacity, pulse)
    if clipped is not None and clipped.given is None:
        raise NotPossibleError(scene, block, eta, clipped)
    motion = _motion_with_time_to_rest(scene, capacity, block, eta, tilt, None if clipped is None else clipped.given)
    response = simulate(block, motion, restitution=eta, initial_rotation=tilt)
    story = [t for t in (response.rest_time, response.overturning_time) if t is not None]
    after = min(max([0.0, *(t + AFTERWARDS - motion.duration for t in story)]), LONGEST_WAIT)
    return Rehearsal(scene, block, eta, capacity, clipped, motion, response, after)


def _motion_with_time_to_rest(
    scene: Scene, capacity: Capacity, block: Block, eta: float, tilt: float, pulse: Pulse | None
) -> Motion:
    """Return the motion whose return begins when the block is predicted to be at rest, with time to spare."""
    motion = make_motion(scene, capacity, pulse)
    if pulse is None:
        return motion
    shaken = motion.shaking
    response = simulate(block, shaken, restitution=eta, initial_rotation=tilt)
    still = max((t for t in (response.rest_time, response.overturning_time) if t is not None), default=0.0)
    wait = min(still - shaken.duration + AFTERWARDS, LONGEST_WAIT)
    return make_motion(scene, capacity, pulse, wait=max(wait, scene.table.settle_s))


def plan_run(scene: Scene, capacity: Capacity) -> Plan:
    """Plan `scene` on a table of `capacity`: clip, predict, search the margin, draw the futures.

    Raises
    ------
    InputError
        Where the scene's numbers cannot be used together.
    """
    try:
        rehearsal = rehearse(scene, capacity)
    except NotPossibleError as refusal:
        return Plan(scene, refusal.block, refusal.restitution, capacity, refusal.clipped, None, None, None, None)
    block, eta, motion = rehearsal.block, rehearsal.restitution, rehearsal.motion
    given = None if rehearsal.clipped is None else rehearsal.clipped.given
    margin = None if given is None else _margin(scene, capacity, block, eta, given)
    futures = _futures(scene, block, eta, motion)
    return Plan(scene, block, eta, capacity, rehearsal.clipped, motion, rehearsal.response, margin, futures)


def _margin(scene: Scene, capacity: Capacity, block: Block, eta: float, pulse: Pulse) -> Margin:
    """Search both ways for the nearest amplitude with another outcome, then close in on it by bisection."""
    body = parameters(block, eta)
    tilt = math.radians(scene.block.initial_rotation_deg)

    def falls(change: float) -> bool | None:
        scaled = pulse.scaled(1.0 + change)
        return overturns(body, _braked(scaled, brake_of(scene, capacity), scene.table.coast_s), rotation=tilt)

    now = falls(0.0)
    largest = _largest_change(pulse)

    def nearest(direction: float) -> float | None:
        inside = 0.0
        for k in range(1, round(MARGIN_RANGE / MARGIN_STEP) + 1):
            outside = direction * k * MARGIN_STEP
            if outside > largest:
                return None
            if falls(outside) != now:
                while abs(outside - inside) > 1e-9:
                    middle = 0.5 * (inside + outside)
                    inside, outside = (inside, middle) if falls(middle) != now else (middle, outside)
                return outside
            inside = outside
        return None

    return Margin(nearest(1.0), nearest(-1.0), largest)


def _largest_change(pulse: Pulse) -> float:
    """Return the largest relative change of amplitude up to `MARGIN_RANGE` at which there still is such a pulse.

    A double pulse reaches no more speed than its gap leaves room for.
    """
    for k in range(round(MARGIN_RANGE / MARGIN_STEP), 0, -1):
        try:
            pulse.scaled(1.0 + k * MARGIN_STEP)
        except ValueError:
            continue
        return k * MARGIN_STEP
    return 0.0


def _braked(pulse: Pulse, brake: float, coast: float) -> FloatArray:
    """Return the pieces of a pulse with its coast and its constant brake behind it: what `Motion.shaking` has."""
    speed = pulse.final_velocity
    if not ends_moving(pulse):
        return pulse.pieces
    end = pulse.duration
    stop = end + coast + abs(speed) / brake
    rows = [[end, end + coast, 0.0, 0.0, 0.0, 0.0, 0.0]] if coast > 0.0 else []
    rows.append([end + coast, stop, -math.copysign(brake, speed), 0.0, 0.0, 0.0, 0.0])
    return np.concatenate([pulse.pieces, np.array(rows)])


def _futures(scene: Scene, block: Block, eta: float, motion: Motion, shown: int = 40) -> Futures:
    """Draw normal spreads of restitution, slenderness (at the same diagonal) and of the tilt at the pulse's start."""
    twin = scene.twin
    rng = np.random.default_rng(twin.seed)
    shaken = motion.shaking or Motion.standstill(motion.duration)
    tilt = math.radians(scene.block.initial_rotation_deg)
    fallen = undecided = 0
    responses: list[Response] = []
    for _ in range(twin.futures):
        z = rng.standard_normal(3)
        alpha = block.slenderness * (1.0 + 0.01 * twin.slenderness_spread_percent * z[1])
        alpha = min(max(alpha, 1e-3), 0.5 * math.pi - 1e-3)
        other = Block(
            2.0 * block.half_diagonal * math.sin(alpha),
            2.0 * block.half_diagonal * math.cos(alpha),
            block.mass,
            block.gravity,
        )
        restitution = min(max(eta + twin.restitution_spread * z[0], 0.0), 1.0)
        start = tilt + math.radians(twin.initial_tilt_spread_deg) * z[2]
        start = min(max(start, -1.5), 1.5)
        verdict = overturns(parameters(other, restitution), shaken.pieces, rotation=start)
        fallen += verdict is True
        undecided += verdict is None
        if len(responses) < shown:
            responses.append(simulate(other, shaken, restitution=restitution, initial_rotation=start))
    return Futures(twin.futures, fallen, undecided, tuple(responses))
