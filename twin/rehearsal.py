"""A run before it is made: excitation clipped, the table's whole motion laid out, the block predicted."""

from __future__ import annotations

import math
from dataclasses import dataclass

from excitation import Capacity, Clipped, Motion, Pulse, clip
from twin.errors import InputError
from twin.rocking.block import Block
from twin.rocking.response import Response
from twin.scene import Scene
from twin.scene_parts import NoShaking
from twin.simulation import simulate
from twin.stopping import stop_deceleration

AFTERWARDS = 0.5
"""Time left after the block is predicted to rest or lie, s."""
LONGEST_WAIT = 60.0
"""A block that rocks longer than this after the pulse is not waited for before the table returns, s."""


class NotPossibleError(InputError):
    """The table can make no pulse of the kind asked for."""

    def __init__(self, scene: Scene, block: Block, restitution: float, clipped: Clipped) -> None:
        super().__init__(f"scene {scene.name}: {clipped.limits[0].sentence}")
        self.block = block
        self.restitution = restitution
        self.clipped = clipped


@dataclass(frozen=True, slots=True)
class Rehearsal:
    """What the table will be told and what the block is predicted to do of it.

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

    @property
    def given(self) -> Pulse | None:
        """The pulse the table makes; None where nothing shakes."""
        return None if self.clipped is None else self.clipped.given


def rehearse(scene: Scene, capacity: Capacity) -> Rehearsal:
    """Clip the scene's excitation, lay the whole motion out around it, and predict the block.

    Raises
    ------
    InputError
        Where the table can make no such pulse, or the scene's numbers cannot be used together.
    """
    block = scene.block.block()
    eta = block.housner_restitution if scene.block.restitution is None else scene.block.restitution
    tilt = initial_rotation(scene)
    pulse = scene.pulse()
    clipped = None if pulse is None else clip_scene(scene, capacity, pulse)
    if clipped is not None and clipped.given is None:
        raise NotPossibleError(scene, block, eta, clipped)
    motion = _motion_with_time_to_rest(scene, capacity, block, eta, tilt, None if clipped is None else clipped.given)
    response = simulate(block, motion, restitution=eta, initial_rotation=tilt)
    after = min(max([0.0, *(t + AFTERWARDS - motion.duration for t in _story(response))]), LONGEST_WAIT)
    return Rehearsal(scene, block, eta, capacity, clipped, motion, response, after)


def make_motion(scene: Scene, capacity: Capacity | None, pulse: Pulse | None, *, wait: float | None = None) -> Motion:
    """Return the whole run of the table around `pulse`; `wait` s are left for the block before the return."""
    if pulse is None:
        duration = scene.excitation.duration_s if isinstance(scene.excitation, NoShaking) else 1.0
        return Motion.standstill(duration)
    return Motion(
        pulse,
        stop_deceleration(scene, capacity),  # positioning is as gentle as a stop
        capacity=capacity,
        brake=brake_of(scene, capacity),
        coast=scene.table.coast_s,
        settle=scene.table.settle_s,
        wait=wait,
    )


def brake_of(scene: Scene, capacity: Capacity | None) -> float:
    """Return the deceleration that ends a pulse which ends moving, m/s2: the scene's, or `stop_deceleration`."""
    return scene.table.brake_m_s2 or stop_deceleration(scene, capacity)


def initial_rotation(scene: Scene) -> float:
    """Return the rotation at which the block is let go as the run begins, rad."""
    return math.radians(scene.block.initial_rotation_deg)


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


def _motion_with_time_to_rest(
    scene: Scene, capacity: Capacity, block: Block, eta: float, tilt: float, pulse: Pulse | None
) -> Motion:
    """Return the motion whose return begins when the block is predicted to be at rest, with time to spare."""
    motion = make_motion(scene, capacity, pulse)
    if pulse is None:
        return motion
    # How long the block rocks is asked of a run that waits long enough; where it never rests, the wait is the longest.
    end = max(phase.end for phase in motion.phases if phase.name in ("pulse", "coast", "brake"))
    patient = make_motion(scene, capacity, pulse, wait=LONGEST_WAIT)
    still = max(_story(simulate(block, patient, restitution=eta, initial_rotation=tilt)), default=end)
    wait = min(still - end + AFTERWARDS, LONGEST_WAIT)
    return make_motion(scene, capacity, pulse, wait=max(wait, scene.table.settle_s))


def _story(response: Response) -> list[float]:
    """Return when the block rests and when it lies, s, as far as it does."""
    return [t for t in (response.rest_time, response.overturning_time) if t is not None]
