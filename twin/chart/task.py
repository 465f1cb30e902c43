"""What the chart asks a solver to do, and what it looks at in the answer."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from excitation import Pulse, SineWave
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.restitution import Restitution

B6L = Block(0.06, 0.27, mass=2.5692)
"""The reference block: N. Ceh, doctoral thesis, Rijeka 2018."""

SAMPLES = 2001
HALF_TURN = 0.5 * math.pi


@dataclass(frozen=True, slots=True)
class Task:
    """One run of one block.

    Attributes
    ----------
    name : str
    pulse : Pulse or None
        Base motion; None: it stands still.
    rotation, rate : float
        At time 0, rad and rad/s.
    duration : float or None
        s; None: until the block rests or lies.
    restitution : float, Improved or None
        None: Housner's.
    block : Block
    """

    name: str
    pulse: Pulse | None = None
    rotation: float = 0.0
    rate: float = 0.0
    duration: float | None = None
    restitution: Restitution = None
    block: Block = B6L


@dataclass(frozen=True, slots=True)
class Answer:
    """What a solver said.

    Attributes
    ----------
    uplift, rest, overturning : float or None
        Times, s; None where there is none.
    impacts, rates : ndarray
        Times of the impacts, s, and signed rates before them, rad/s.
    overturned : bool or None
        None: undecided.
    peak : float
        Largest |rotation|, rad.
    stated : float
        Error of the rotation the solver states, rad.
    end : float
        Time the rotation is known until, s.
    rotation : callable
        Times (s, ndarray) -> rotation (rad, ndarray).
    """

    uplift: float | None
    impacts: FloatArray
    rates: FloatArray
    rest: float | None
    overturning: float | None
    overturned: bool | None
    peak: float
    stated: float
    end: float
    rotation: Callable[[FloatArray], FloatArray]

    @property
    def story_end(self) -> float:
        """When nothing happens any more, s: lying, at rest, or the end of the run."""
        return next((t for t in (self.overturning, self.rest) if t is not None), self.end)


@dataclass(frozen=True, slots=True)
class Difference:
    """How far an answer is from another: largest error of the rotation, rad, and of the impact times, s.

    `impacts` is infinite where their number differs while the block still moves at 1e-3 p or more.
    """

    rotation: float
    impacts: float


def sine(amplitude: float, frequency: float, cycles: float = 1.0) -> SineWave:
    """Return the sine of dimensionless amplitude A = a0 / (g tan alpha) and frequency W = omega / p on B6L."""
    return SineWave(amplitude * B6L.uplift_acceleration, frequency * B6L.frequency_parameter / (2.0 * math.pi), cycles)


def sample_times(answer: Answer) -> FloatArray:
    """Return times over the whole story of an answer, s, evenly spaced."""
    return np.linspace(0.0, math.nextafter(answer.story_end, 0.0), SAMPLES)


def difference(answer: Answer, reference: Answer, times: FloatArray) -> Difference:
    """Return how far `answer` is from `reference` at `times` (s) and at the impacts before the last of them."""
    known = times[times <= answer.end]
    if not known.size:
        return Difference(math.inf, math.inf)
    rotation = float(np.max(np.abs(answer.rotation(known) - reference.rotation(known))))
    if known.size < times.size:
        rotation = math.inf
    slowest = 1e-3 * B6L.frequency_parameter
    mine = answer.impacts[np.abs(answer.rates) > slowest]
    theirs = reference.impacts[np.abs(reference.rates) > slowest]
    # The last counted impact may be just above the limit in one and just below it in the other.
    count = min(mine.size, theirs.size)
    if abs(mine.size - theirs.size) > 1:
        return Difference(rotation, math.inf)
    worst = float(np.max(np.abs(mine[:count] - theirs[:count]))) if count else 0.0
    return Difference(rotation, worst)
