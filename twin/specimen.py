"""The emulated block that stands on an emulated table: its own parameters, slightly off the twin's."""

from __future__ import annotations

import math

from excitation import Capacity
from twin.errors import InputError
from twin.rehearsal import clip_scene, make_motion
from twin.rocking.block import Block
from twin.rocking.track import TrackedBlock
from twin.scene import Scene


class Specimen:
    """A block on the emulated table; held at its initial tilt until it is let go.

    An instance is the callable that an emulated table wants: (duration s, base acceleration at the start and at the
    end, m/s2) -> rotation, rad.

    Parameters
    ----------
    block : Block
    restitution : float
    initial_rotation : float
        rad.
    held : bool
        Whether a tilted block waits for `release` each time it was set up; otherwise only the emulated table holds it.
    tilt, tilted_at : float
        `tilted_at` s after it was let go it leans by `tilt`, rad, at rest, whatever it did before; never unless told.
    """

    def __init__(
        self,
        block: Block,
        restitution: float,
        initial_rotation: float,
        *,
        held: bool = True,
        tilt: float = 0.0,
        tilted_at: float = math.inf,
    ) -> None:
        self._block = block
        self._restitution = restitution
        self._initial_rotation = initial_rotation
        self._tilt = tilt
        self._tilted_at = tilted_at
        self._holds = held and initial_rotation != 0.0
        self._push = 0.0
        self.set_up()

    def set_up(self) -> None:
        """Stand the block at its initial tilt again, at rest, as before the first run."""
        self._tracked = TrackedBlock(self._block, self._restitution, self._initial_rotation)
        self._held = self._holds
        self._left = self._tilted_at

    def __call__(self, duration: float, start_acceleration: float, end_acceleration: float) -> float:
        if not self._held:
            push = self._push / duration
            self._push = 0.0
            self._tracked.advance(duration, start_acceleration + push, end_acceleration + push)
            self._left -= duration
            if self._left <= 0.0:
                self._left = math.inf
                self._tracked = TrackedBlock(self._block, self._restitution, self._tilt)
        return self._tracked.rotation

    def push(self, change: float) -> None:
        """Let somebody push the block in its next step: a blow at its centre that changes its rate by `change`, rad/s.

        A blow J at the centre is what a base acceleration of integral -J / m does (in I theta'' the same lever arm), so
        that I dtheta' = J R cos(alpha): near rest, and less what its weight takes meanwhile.
        """
        block = self._block
        self._push = -change * block.gravity / (block.frequency_parameter**2 * math.cos(block.slenderness))

    @property
    def rotation(self) -> float:
        """Rotation now, rad."""
        return self._tracked.rotation

    @property
    def resting(self) -> bool:
        """Whether it stands still, or lies."""
        return self._tracked.resting

    @property
    def overturned(self) -> bool:
        """Whether it lies on its side."""
        return self._tracked.overturned

    def release(self) -> None:
        """Let the block go."""
        self._held = False


def specimen_of(scene: Scene, capacity: Capacity | None = None, *, held: bool = True) -> Specimen:
    """Return the scene's emulated block: the twin's, with the changes of `[table.specimen]`; `held` as for `Specimen`.

    The slenderness changes at the same diagonal; the restitution is the changed one of the twin, at most 1. The tilt at
    the pulse comes when the run of a table with `capacity` begins its pulse, a few cycles early or late: the block's
    clock starts with the table's power.

    Raises
    ------
    InputError
        A tilt at the pulse where nothing shakes.
    """
    block = scene.block.block()
    change = scene.table.specimen
    alpha = min(block.slenderness * (1.0 + 0.01 * change.slenderness_change_percent), 1.5)
    diagonal = 2.0 * block.half_diagonal
    other = Block(diagonal * math.sin(alpha), diagonal * math.cos(alpha), block.mass, block.gravity)
    eta = block.housner_restitution if scene.block.restitution is None else scene.block.restitution
    restitution = min(eta * (1.0 + 0.01 * change.restitution_change_percent), 1.0)
    tilt = math.radians(change.tilt_at_pulse_deg)
    tilted_at = _pulse_start(scene, capacity) if tilt else math.inf
    start = math.radians(scene.block.initial_rotation_deg)
    return Specimen(other, restitution, start, held=held, tilt=tilt, tilted_at=tilted_at)


def _pulse_start(scene: Scene, capacity: Capacity | None) -> float:
    pulse = scene.pulse()
    if pulse is None:
        raise InputError(f"scene {scene.name}: table.specimen.tilt_at_pulse_deg: there is no pulse")
    if capacity is not None and (given := clip_scene(scene, capacity, pulse).given) is not None:
        pulse = given
    return make_motion(scene, capacity, pulse).pulse_start
