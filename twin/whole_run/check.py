"""`check_whole_run`: a rehearsed run from the first moment to the last, and broken off at every moment."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from excitation import Capacity, ReleasedRun
from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Response
from twin.rocking.run import local_tolerance, parameters
from twin.rocking.validity import Validity
from twin.simulation import simulate
from twin.stopping import stop_deceleration
from twin.whole_run.end_stops import Impact, released_impacts, servo_impacts
from twin.whole_run.mechanics import TableMechanics
from twin.whole_run.outcome import Checkpoints, StopStudy
from twin.whole_run.performed import Followed
from twin.whole_run.phases import PhaseCheck, check_phases
from twin.whole_run.released import broken_off
from twin.whole_run.stops import STRAIGHT, Drive, cuts, ramps

FINEST = 2e-3
COARSEST = 5e-3
"""Time between two moments at which the run is broken off, s: the fine one where that makes no more than"""
MOST_MOMENTS = 5000


@dataclass(frozen=True, slots=True)
class WholeRun:
    """What a run asks of table and block, from its first moment to its last.

    Attributes
    ----------
    mechanics : TableMechanics
        How the table is taken to follow its command.
    capacity : Capacity
    uplift_acceleration : float
        g tan(alpha), m/s2.
    phases : tuple of PhaseCheck
    response : Response
        The block under the whole motion as the table makes it.
    contact : Validity
        What that asks of the contact.
    soft_limit : float
        Positions the table stays within, m from the centre; of a released base, m from where it is held.
    ramp_down : StopStudy or None
        The run broken off at every moment; None on a machine that nothing stops.
    power_cut : StopStudy or None
        The power taken at every moment instead; None where nothing is known of the friction.
    impacts : tuple of Impact
        Ways into the end stops.
    released : bool
        Whether the machine is set by hand and released.
    """

    mechanics: TableMechanics
    capacity: Capacity
    uplift_acceleration: float
    phases: tuple[PhaseCheck, ...]
    response: Response
    contact: Validity
    soft_limit: float
    ramp_down: StopStudy | None
    power_cut: StopStudy | None
    impacts: tuple[Impact, ...]
    released: bool

    def phase_at(self, time: float) -> str:
        """Return the name of the phase a time, s, falls into."""
        names = [phase.name for phase in self.phases if phase.start <= time]
        return names[-1] if names else "start"

    @property
    def worst(self) -> PhaseCheck:
        """The phase that comes nearest to a limit of the capacity, as it is performed."""
        return max(self.phases, key=lambda phase: phase.performed.share(self.capacity, self.soft_limit))

    @property
    def positioning(self) -> PhaseCheck | None:
        """The stronger one of approach and return; None where the table does not move but in its pulse."""
        moves = [phase for phase in self.phases if phase.name in ("approach", "return")]
        return max(moves, key=lambda phase: phase.performed.acceleration, default=None)

    @property
    def stays_inside(self) -> bool:
        """Whether the run and every stop of it stay within the soft limit, to a tenth of a millimetre."""
        peak = max(phase.performed.position for phase in self.phases)
        stops = 0.0 if self.ramp_down is None else self.ramp_down.furthest[1].furthest
        return max(peak, stops) <= self.soft_limit + 1e-4


def check_whole_run(rehearsal: Rehearsal, mechanics: TableMechanics | None = None) -> WholeRun:
    """Return the checks of a rehearsed run on a table of these `mechanics`; one that follows exactly unless given.

    The run is broken off every `FINEST` s, up to every `COARSEST` s in long ones. What is looked at between two moments
    is nothing: an interval shorter than that can be missed.
    """
    scene, block, capacity = rehearsal.scene, rehearsal.block, rehearsal.capacity
    released = isinstance(rehearsal.motion, ReleasedRun)
    mechanics = TableMechanics() if mechanics is None or released else mechanics
    cycle = 1.0 / scene.twin.cycle_hz
    followed = Followed(rehearsal.motion, mechanics, cycle, rehearsal.after)
    tilt = initial_rotation(scene)
    exact = mechanics.follows_exactly
    response = (
        rehearsal.response
        if exact
        else simulate(block, followed.base, restitution=rehearsal.restitution, initial_rotation=tilt)
    )
    every, moments = moments_of(followed)
    body = parameters(block, rehearsal.restitution, local_tolerance(1e-10))
    times = np.asarray(moments, dtype=np.float64) * cycle
    visited = Checkpoints(body, tilt, followed.base.pieces, times)
    straight = STRAIGHT * block.uplift_acceleration
    cut: StopStudy | None = None
    if isinstance(rehearsal.motion, ReleasedRun):
        stops = broken_off(rehearsal, rehearsal.motion, times)
        stopped = None if stops is None else visited.study("run broken off", stops, every)
        mass = rehearsal.capacity.machine_for(rehearsal.motion.pulse)
        impacts = released_impacts(rehearsal.motion, None if mass is None else mass.moving_mass(scene.block.mass_kg))
    else:
        drive = Drive(stop_deceleration(scene, capacity), 0.5 * capacity.stroke, capacity.acceleration)
        stopped = visited.study("ramp-down", ramps(followed, drive, moments, straight), every)
        if mechanics.braking > 0.0:
            cut = visited.study("power cut", cuts(followed, moments), every)
        impacts = servo_impacts(mechanics, stopped, cut, _peak_velocity(followed))
    return WholeRun(
        mechanics=mechanics,
        capacity=capacity,
        uplift_acceleration=block.uplift_acceleration,
        phases=check_phases(followed, response, block.uplift_acceleration),
        response=response,
        contact=response.validity(friction=scene.block.friction),
        soft_limit=capacity.stroke if released else 0.5 * capacity.stroke,
        ramp_down=stopped,
        power_cut=cut,
        impacts=impacts,
        released=released,
    )


def moments_of(followed: Followed) -> tuple[float, list[int]]:
    """Return how far apart, s, and at which points of the run it is broken off: from the first to the last."""
    cycle = followed.cycle
    last = round(followed.motion.duration / cycle)
    finest, coarsest = max(1, round(FINEST / cycle)), max(1, round(COARSEST / cycle))
    stride = min(max(finest, -(-last // MOST_MOMENTS)), coarsest)
    return stride * cycle, list(range(0, last + 1, stride))


def _peak_velocity(followed: Followed) -> float:
    made: FloatArray = followed.made
    return float(np.max(np.abs(made[1])))
