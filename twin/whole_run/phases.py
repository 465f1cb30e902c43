"""The parts of a run one by one: what is commanded, what the table makes of it, and what the block does meanwhile."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from excitation import Capacity
from excitation.released import ReleasedRun
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Response
from twin.whole_run.following import ACCELERATION, POSITION, VELOCITY
from twin.whole_run.performed import Followed

SAMPLES = 400
"""Least number of instants at which a phase is looked at."""


@dataclass(frozen=True, slots=True)
class Peaks:
    """Largest |position|, m, |velocity|, m/s, and |acceleration|, m/s2."""

    position: float
    velocity: float
    acceleration: float

    def share(self, capacity: Capacity, reach: float) -> float:
        """Return the largest share of a limit of the capacity; positions are within `reach`, m."""
        return max(
            self.position / reach,
            self.velocity / capacity.velocity,
            self.acceleration / capacity.acceleration,
        )


@dataclass(frozen=True, slots=True)
class PhaseCheck:
    """One part of a run.

    Attributes
    ----------
    name : str
    start, end : float
        As planned, s.
    commanded, performed : Peaks
        The table's own come later by its lag: they are looked for that much later.
    rotation : float
        Largest |rotation| of the block meanwhile, rad.
    lifts : bool
        Whether a block at rest would leave the base: the performed acceleration passes g tan(alpha).
    """

    name: str
    start: float
    end: float
    commanded: Peaks
    performed: Peaks
    rotation: float
    lifts: bool

    @property
    def overshoot(self) -> float:
        """Largest performed over largest commanded acceleration, less 1; 0 where nothing is commanded."""
        asked = self.commanded.acceleration
        return self.performed.acceleration / asked - 1.0 if asked > 0.0 else 0.0


def check_phases(followed: Followed, response: Response, uplift_acceleration: float) -> tuple[PhaseCheck, ...]:
    """Return every phase of the run with its peaks; `response` is the block's to what the table makes."""
    return tuple(
        _check(followed, response, uplift_acceleration, phase.name, phase.start, phase.end)
        for phase in followed.motion.phases
    )


def _check(followed: Followed, response: Response, lift: float, name: str, start: float, end: float) -> PhaseCheck:
    motion, lag = followed.motion, followed.mechanics.lag
    t = np.linspace(start, end, max(SAMPLES, int((end - start) / followed.cycle)))
    # Right-continuous: the last instant belongs to the next phase.
    t[-1] = np.nextafter(end, start)
    commanded = Peaks(_most(motion.displacement(t)), _most(motion.velocity(t)), _most(motion.acceleration(t)))
    performed = commanded
    if not followed.mechanics.follows_exactly:
        inside = (followed.times >= start + lag) & (followed.times <= end + lag)
        made = followed.made[:, inside]
        performed = Peaks(_most(made[POSITION]), _most(made[VELOCITY]), _most(made[ACCELERATION]))
    elif isinstance(motion, ReleasedRun):
        # A blow is shorter than the instants looked at.
        phase = next(phase for phase in motion.phases if phase.name == name and phase.start == start)
        strongest = max(commanded.acceleration, motion.peak_in(phase))
        commanded = performed = Peaks(commanded.position, commanded.velocity, strongest)
    known = t[t <= response.end_time]
    rotation = _most(np.asarray(response.rotation(known))) if known.size else 0.0
    return PhaseCheck(name, start, end, commanded, performed, rotation, performed.acceleration > lift)


def _most(values: FloatArray) -> float:
    return float(np.max(np.abs(values))) if values.size else 0.0
