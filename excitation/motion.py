"""The whole run a table makes around a pulse: to its start, the pulse, to a stop, and back to the centre."""

from __future__ import annotations

import math
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import Final

from excitation.capacity import Capacity
from excitation.demand import Terms, ends_moving
from excitation.limits import exceeded
from excitation.pieces import Array, Span, as_spans, assemble, steady
from excitation.pulse import Pulse
from excitation.quantity import LARGEST, checked
from excitation.search import GUARD
from excitation.speed_change import speed_change
from excitation.table_run import Course, Phase, TableRun

# Stands for no capacity: beyond every pulse.
_ANY_TABLE: Final = Capacity(name="any table", stroke=LARGEST, velocity=LARGEST, acceleration=LARGEST)

# A distance from the centre, m, that is not worth a move.
_AT_CENTRE: Final = 1e-13

# No positioning move is quicker: one that is a few control cycles long cannot be followed.
SHORTEST_MOVE: Final = 0.1


@dataclass(frozen=True)
class Motion(TableRun):
    """A run: settle, approach, settle, pulse, coast, brake, settle, return, settle; absent parts are left out.

    Displacement is the table's position, 0 at the centre of its stroke, where the run starts and ends at rest. The
    pulse starts where the range from its first to the last instant of the brake is centred on 0. Approach and return
    are single sines of acceleration, a(t) = (2 pi X / T^2) sin(2 pi t / T) over a distance X, with the shortest T that
    positioning acceleration and capacity allow. Rounding left by pulse and brake is taken out while the table settles.

    Parameters
    ----------
    pulse : Pulse or None
        What the run is for; None stands still, see `standstill`.
    positioning_acceleration : float
        Largest |a| of approach and return, m/s2, above 0: below g tan(alpha), with a margin, or it rocks the block.
    capacity : Capacity, optional
        The table's limits; the pulse must be within them (see `clip`). Payload, kinds and sense are not looked at.
    brake : float, optional
        Deceleration after a pulse that ends moving, m/s2; with a jerk limit a trapezoid of it.
    coast : float
        Time at constant velocity between such a pulse and the brake, s, at least 0.
    settle : float
        Length of each pause, s, at least 0.01.
    wait : float, optional
        Length of the pause before the return instead, s, at least 0.01: time for the block to come to rest.

    Raises
    ------
    ValueError
        One sentence: a value out of its bounds, a pulse that ends moving without a brake, a pulse beyond the capacity.

    Examples
    --------
    >>> from excitation import SineWave
    >>> run = Motion(SineWave(3.0, 2.0), positioning_acceleration=1.0)
    >>> [phase.name for phase in run.phases]
    ['settle', 'approach', 'settle', 'pulse', 'settle', 'return', 'settle']
    >>> round(run.displacement(run.pulse_start), 9), abs(run.displacement(run.duration)) < 1e-12
    (-0.059683104, True)
    """

    pulse: Pulse | None
    positioning_acceleration: float
    _: KW_ONLY
    capacity: Capacity | None = None
    brake: float | None = None
    coast: float = 0.0
    settle: float = 1.0
    wait: float | None = None

    def __post_init__(self) -> None:
        checked("positioning_acceleration", self.positioning_acceleration, "m/s2", above=0.0)
        checked("settle", self.settle, "s", at_least=0.01)
        if self.wait is not None:
            checked("wait", self.wait, "s", at_least=0.01)
        terms = self._terms
        beyond = exceeded(self.pulse, self.pulse, terms) if self.pulse is not None else []
        if beyond:
            raise ValueError(beyond[0].sentence)

    @classmethod
    def standstill(cls, duration: float) -> Motion:
        """Return the run in which the table stands at the centre for `duration` (s, at least 0.01): free rocking.

        Examples
        --------
        >>> Motion.standstill(8.0).phases
        (Phase(name='settle', start=0.0, end=8.0),)
        """
        checked("duration", duration, "s", at_least=0.01)
        # Nothing is positioned: the acceleration has no effect.
        return cls(None, 1.0, settle=duration)

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The parts of the run in order, from 0 to `duration`."""
        return tuple(self._course.phases)

    @property
    def shaking_end(self) -> float:
        """End of the pulse with its coast and brake, s; of all of it at a standstill."""
        ends = [phase.end for phase in self.phases if phase.name in ("pulse", "coast", "brake")]
        return max(ends, default=self.duration)

    def scaled(self, factor: float) -> Motion:
        """Return the run of the scaled pulse."""
        return Motion(
            None if self.pulse is None else self.pulse.scaled(factor),
            self.positioning_acceleration,
            capacity=self.capacity,
            brake=self.brake,
            coast=self.coast,
            settle=self.settle,
            wait=self.wait,
        )

    @property
    def _terms(self) -> Terms:
        return Terms(self.capacity or _ANY_TABLE, self.brake, self.coast)

    @cached_property
    def _course(self) -> Course:
        course = Course()
        course.pause("settle", self.settle)
        if self.pulse is None:
            return course
        lowest, highest = self._terms.reach(self.pulse)
        start = -0.5 * (lowest + highest)
        if abs(start) > _AT_CENTRE:
            course.add("approach", self._move(start))
            course.pause("settle", self.settle)
        course.add("pulse", *as_spans(self.pulse.pieces))
        if self.brake is not None and ends_moving(self.pulse):
            if self.coast > 0.0:
                course.add("coast", steady(self.coast))
            jerk = self._terms.capacity.jerk
            course.add("brake", *speed_change(-self.pulse.final_velocity, self.brake, jerk))
        course.pause("settle", self.wait or self.settle)
        if abs(course.position) > _AT_CENTRE:
            course.add("return", self._move(-course.position))
            course.pause("settle", self.settle)
        return course

    def _move(self, distance: float) -> Span:
        """Return one sine of acceleration over `distance`, m: x(t) = X (t/T - sin(2 pi t/T) / (2 pi))."""
        capacity, size = self._terms.capacity, abs(distance)
        acceleration = min(self.positioning_acceleration, capacity.acceleration)
        # Peaks: a = 2 pi X / T^2, v = 2 X / T, da/dt = 4 pi^2 X / T^3.
        duration = max(
            math.sqrt(2.0 * math.pi * size / acceleration),
            2.0 * size / capacity.velocity,
            0.0 if capacity.jerk is None else (4.0 * math.pi**2 * size / capacity.jerk) ** (1.0 / 3.0),
            0.0 if capacity.frequency is None else 1.0 / capacity.frequency,
            SHORTEST_MOVE,
        ) * (1.0 + GUARD)
        omega = 2.0 * math.pi / duration
        return (duration, 0.0, 0.0, distance * omega / duration, omega, 0.0)

    def _rows(self) -> Array:
        return assemble(self._course.spans)
