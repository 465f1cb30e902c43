"""What a simulation of a stack answers: what fell and in which order, every event, and the motion at any time."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import Enum
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from twin.rocking.compiled import FloatArray
from twin.rocking.response import Outcome
from twin.stack.configuration import Configuration
from twin.stack.stack import Stack

if TYPE_CHECKING:
    from excitation import Pulse


class Ending(Enum):
    """Why a run ended."""

    AT_REST = "at rest"
    SETTLED = "settled"
    DURATION = "duration"
    ALL_DOWN = "all down"
    CONTACT_LOST = "contact lost"
    NO_CANDIDATE = "no candidate"
    SEVERAL_CANDIDATES = "several candidates"
    UNFINISHED = "unfinished"


UNDECIDED_ENDINGS = (Ending.NO_CANDIDATE, Ending.SEVERAL_CANDIDATES, Ending.UNFINISHED)
COUNTED = ("none", "top only", "top two", "top three", "top four", "top five", "top six", "top seven")


@dataclass(frozen=True, slots=True)
class Impact:
    """An interface that closed.

    Attributes
    ----------
    time : float
        s.
    interface : int
        Which one struck: 0 is the base; the lowest where several struck together.
    rates_before, rates_after, rotations : ndarray, shape (N,)
        Absolute, of every block; rad/s and rad. Blocks that have left keep their rotation.
    before, after : Configuration
        Signs of the interfaces.
    energy_lost : float
        J (relative where the blocks tell no mass).
    candidates : int
        Of all the ways the interfaces could have gone on, how many the contacts allowed; not 1 only where a run ended.
    """

    time: float
    interface: int
    rates_before: FloatArray
    rates_after: FloatArray
    rotations: FloatArray
    before: Configuration
    after: Configuration
    energy_lost: float
    candidates: int


@dataclass(frozen=True, slots=True)
class Overturning:
    """Blocks that left the stack together: the lowest of them reached pi/2, the others lay on it.

    Attributes
    ----------
    time : float
        s.
    blocks : tuple of int
        From the lowest up; 0 stands on the base.
    rotations : ndarray
        Of these blocks then, rad.
    lost_contact : bool
        Whether they left, past their balance and before pi/2, as a pivot would have had to pull.
    """

    time: float
    blocks: tuple[int, ...]
    rotations: FloatArray
    lost_contact: bool


@dataclass(frozen=True, slots=True)
class LostContact:
    """A pivot that would have had to pull, where the run ended.

    Attributes
    ----------
    time : float
        s.
    interface : int
        Whose pivot it was; in an impact, which interface struck.
    in_impact : bool
        Whether an impact, elsewhere, would have had to pull at it.
    falling_from : int or None
        Lowest interface, not above that pivot, whose part (everything above it) was past its balance, its centre of
        mass outside the pivot, and turning outwards: falling for good. None where there was none.
    """

    time: float
    interface: int
    in_impact: bool
    falling_from: int | None


@dataclass(frozen=True, slots=True)
class StackResponse:
    """The stack's answer to a base motion.

    Attributes
    ----------
    stack : Stack
    pulse : Pulse or None
    impact_rule, pulling_pivot : str
        As asked for; see `twin.stack.simulation.simulate_stack`.
    ending : Ending
        Why the run ended. CONTACT_LOST: see `lost_contact`. NO_CANDIDATE, SEVERAL_CANDIDATES: an impact, or a jump of
        the base acceleration, allows no way on, or several; nothing is guessed. SETTLED: after 200 000 steps (chatters
        within chatters) something still moves, but the base is still and nothing can fall any more; UNFINISHED: without
        being able to say so.
    overturnings : tuple of Overturning
        What fell, in order of time.
    lost_contact : LostContact or None
        Where the run ended with it.
    impacts : tuple of Impact
    configurations : tuple of (float, Configuration)
        Every configuration with the time it began, the first at 0. Interfaces of blocks that have left count as closed.
    rest_time : float or None
        When the stack, or what is left of it, having moved, comes to rest for good, s.
    end_time : float
        Last time the motion is known for, s; infinite where all rest or lie.
    peak_rotations : ndarray, shape (N,)
        Largest |rotation| of each block, rad.
    """

    stack: Stack
    pulse: Pulse | None = field(repr=False)
    impact_rule: str
    pulling_pivot: str
    ending: Ending
    overturnings: tuple[Overturning, ...]
    lost_contact: LostContact | None
    impacts: tuple[Impact, ...] = field(repr=False)
    configurations: tuple[tuple[float, Configuration], ...] = field(repr=False)
    rest_time: float | None
    end_time: float
    peak_rotations: FloatArray = field(repr=False)
    lifted: bool = field(repr=False)
    _history: History = field(repr=False)

    @property
    def outcome(self) -> Outcome:
        """STAYED (nothing ever opened), ROCKED, OVERTURNED (some block left the stack) or UNDECIDED.

        As far as the run goes: a `duration` may end it before something falls. UNDECIDED: nothing has fallen, and the
        run ended where its rules give no one way on, or in a loss of contact short of the balance.
        """
        if self.overturnings or (self.lost_contact is not None and self.lost_contact.falling_from is not None):
            return Outcome.OVERTURNED
        if self.ending in UNDECIDED_ENDINGS or self.lost_contact is not None:
            return Outcome.UNDECIDED
        return Outcome.ROCKED if self.lifted else Outcome.STAYED

    @property
    def fallen(self) -> int:
        """How many blocks, from the top, have overturned; where contact was lost, what was falling for good counts."""
        standing = min((overturning.blocks[0] for overturning in self.overturnings), default=len(self.stack))
        lost = self.lost_contact
        if lost is not None and lost.falling_from is not None:
            standing = min(standing, lost.falling_from)
        return len(self.stack) - standing

    @property
    def mode(self) -> str:
        """ "none", "top only", "top two", ..., or "all": which blocks overturned."""
        return "all" if self.fallen == len(self.stack) else COUNTED[self.fallen]

    @property
    def overturning_times(self) -> FloatArray:
        """When each block left the stack, s; nan where it stands. Shape (N,)."""
        times = np.full(len(self.stack), math.nan)
        for overturning in self.overturnings:
            times[list(overturning.blocks)] = overturning.time
        return times

    def configuration(self, t: float) -> Configuration:
        """Return the configuration at time `t`, s: that after an event at that very time."""
        self._known(np.asarray(t))
        return [signs for begins, signs in self.configurations if begins <= t][-1]

    def rotations(self, t: ArrayLike) -> FloatArray:
        """Return theta(t) of every block, rad, for a time or an array of times in s; shape (..., N).

        Raises
        ------
        ValueError
            For a time before 0 or after `end_time`.
        """
        return self._evaluate(t, 0)

    def angular_velocities(self, t: ArrayLike) -> FloatArray:
        """Return d(theta)/dt of every block, rad/s, right-continuous at an impact; arguments as for `rotations`."""
        return self._evaluate(t, 1)

    def _known(self, times: FloatArray) -> None:
        if not bool(np.all((times >= 0.0) & (times <= self.end_time))):
            known = f"0 to {self.end_time:.6g} s"
            raise ValueError(
                f"the motion is known from {known}; asked for {np.min(times):.6g} to {np.max(times):.6g} s"
            )

    def _evaluate(self, t: ArrayLike, which: int) -> FloatArray:
        times = np.asarray(t, dtype=np.float64)
        self._known(times)
        result = self._history.evaluate(times.reshape(-1))[which]
        for overturning in self.overturnings:
            gone = times.reshape(-1) >= overturning.time
            for block, rotation in zip(overturning.blocks, overturning.rotations, strict=True):
                result[gone, block] = 0.0 if which else rotation
        return result.reshape(*times.shape, len(self.stack))


@dataclass(frozen=True, slots=True)
class History:
    """Recorded steps: starts s, lengths 1/p, coefficients of each rotation (steps, N, order + 1); then stillness."""

    starts: FloatArray
    lengths: FloatArray
    coefficients: FloatArray
    p: float
    still_from: float

    def evaluate(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return rotations and rates at `times`, shape (times, N); 0 where all that stands is still."""
        n = self.coefficients.shape[1]
        if not len(self.starts):
            return np.zeros((len(times), n)), np.zeros((len(times), n))
        rows = np.maximum(np.searchsorted(self.starts, times, side="right") - 1, 0)
        x = np.clip(self.p * (times - self.starts[rows]), 0.0, self.lengths[rows])[:, np.newaxis]
        c = self.coefficients[rows]
        order = c.shape[2] - 1
        y = c[:, :, order].copy()
        d = c[:, :, order] * order
        for k in range(order - 1, 0, -1):
            y = y * x + c[:, :, k]
            d = d * x + k * c[:, :, k]
        y = y * x + c[:, :, 0]
        moving = (times < self.still_from)[:, np.newaxis]
        return y * moving, d * moving * self.p
