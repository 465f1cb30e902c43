"""A run before it is made: excitation clipped, the table's whole motion laid out, the block predicted."""

from __future__ import annotations

import math
from dataclasses import dataclass

from excitation import Capacity, Clipped, Motion, Pulse, ReleasedRun, TableRun, clip
from excitation.released import Settings
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

    `after` is how long the table is held still at the end for the block, s. `settings` are what an operator sets on a
    released machine; None for a table that follows set-points.
    """

    scene: Scene
    block: Block
    restitution: float
    capacity: Capacity
    clipped: Clipped | None
    motion: TableRun
    response: Response
    after: float
    settings: Settings | None = None

    @property
    def given(self) -> Pulse | None:
        """The pulse the table makes; None where nothing shakes.

        A released machine makes it from weights and gaps, near what the clip would give.
        """
        return self.motion.pulse


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
    given = None if clipped is None else clipped.given
    settings = None if given is None else settings_for(scene, capacity, given)
    made = given if settings is None else settings.pulse
    motion = _motion_with_time_to_rest(scene, capacity, block, eta, tilt, made)
    response = simulate(block, motion, restitution=eta, initial_rotation=tilt)
    after = min(max([0.0, *(t + AFTERWARDS - motion.duration for t in _story(response))]), LONGEST_WAIT)
    return Rehearsal(scene, block, eta, capacity, clipped, motion, response, after, settings)


def make_motion(scene: Scene, capacity: Capacity | None, pulse: Pulse | None, *, wait: float | None = None) -> TableRun:
    """Return the whole run of the table around `pulse`; `wait` s are left for the block before the return.

    A released machine makes its own run, and does not return.
    """
    if pulse is None:
        duration = scene.excitation.duration_s if isinstance(scene.excitation, NoShaking) else 1.0
        return Motion.standstill(duration)
    settle = scene.table.settle_s
    if capacity is not None and (machine := capacity.machine_for(pulse)) is not None:
        return ReleasedRun(machine, pulse, wait=settle, coast=scene.table.coast_s, rest=settle)
    return Motion(
        pulse,
        stop_deceleration(scene, capacity),  # positioning is as gentle as a stop
        capacity=capacity,
        brake=brake_of(scene, capacity),
        coast=scene.table.coast_s,
        settle=settle,
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
    _check_end(scene, capacity)
    try:
        return clip(
            pulse,
            capacity,
            brake=None if capacity.machine is not None else brake_of(scene, capacity),
            coast=scene.table.coast_s,
            payload=scene.block.mass_kg,
        )
    except ValueError as error:
        raise InputError(f"scene {scene.name}: {error}") from None


def settings_for(scene: Scene, capacity: Capacity, given: Pulse) -> Settings | None:
    """Return what is set on a released machine for the clipped pulse; None for a table that follows set-points.

    Raises
    ------
    InputError
        Where the machine cannot be set so; one sentence.
    """
    machine = capacity.machine_for(given)
    if machine is None:
        return None
    try:
        return machine.settings_for(given, capacity, payload=scene.block.mass_kg, coast=scene.table.coast_s)
    except ValueError as error:
        raise InputError(f"scene {scene.name}: {error}") from None


def planned_settings(scene: Scene, capacity: Capacity) -> Settings | None:
    """Return what `rehearse` has the operator set on a released machine; None where nothing is to be set.

    Raises
    ------
    InputError
        Where the machine cannot be set to what the scene asks.
    """
    pulse = None if capacity.machine is None else scene.pulse()
    if pulse is None:
        return None
    clipped = clip_scene(scene, capacity, pulse)
    if clipped.given is None:
        raise InputError(f"scene {scene.name}: {clipped.limits[0].sentence}")
    return settings_for(scene, capacity, clipped.given)


def _check_end(scene: Scene, capacity: Capacity) -> None:
    """Refuse to be told how a released machine ends its run, where it cannot be told."""
    machine, table = capacity.machine, scene.table
    if machine is None:
        return
    if table.brake_m_s2 is not None:
        raise InputError(
            f"scene {scene.name}: table.brake_m_s2: {capacity.name} is stopped by its {machine.stop_name}, not a brake"
        )
    if table.coast_s > 0.0 and not machine.coasts:
        raise InputError(f"scene {scene.name}: table.coast_s: the stop gap decides how long {capacity.name} slides")


def _motion_with_time_to_rest(
    scene: Scene, capacity: Capacity, block: Block, eta: float, tilt: float, pulse: Pulse | None
) -> TableRun:
    """Return the motion whose return begins when the block is predicted to be at rest, with time to spare."""
    motion = make_motion(scene, capacity, pulse)
    if pulse is None or isinstance(motion, ReleasedRun):
        return motion
    # How long the block rocks is asked of a run that waits long enough; where it never rests, the wait is the longest.
    end = motion.shaking_end
    patient = make_motion(scene, capacity, pulse, wait=LONGEST_WAIT)
    still = max(_story(simulate(block, patient, restitution=eta, initial_rotation=tilt)), default=end)
    wait = min(still - end + AFTERWARDS, LONGEST_WAIT)
    return make_motion(scene, capacity, pulse, wait=max(wait, scene.table.settle_s))


def _story(response: Response) -> list[float]:
    """Return when the block rests and when it lies, s, as far as it does."""
    return [t for t in (response.rest_time, response.overturning_time) if t is not None]
