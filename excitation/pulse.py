"""What every excitation answers: a(t), v(t), x(t), where they break, and their extremes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import TYPE_CHECKING, overload

from excitation.extremes import Extremes, extremes
from excitation.pieces import Array, PieceTable

if TYPE_CHECKING:
    import numpy.typing as npt


class Pulse(ABC):
    """A base motion that starts at rest at 0 and whose acceleration is given in closed form.

    A concrete pulse is an immutable value that names its `kind` and `family`, lays out its pieces in `_rows` and knows
    its own smaller version, `scaled`; everything else follows here.

    1. The acceleration is right-continuous at break points, and 0 before 0 and from `duration` on.
    2. Velocity and displacement are the exact integrals of the acceleration, 0 before 0; after `duration` the velocity
       stays constant and the displacement goes on linearly (braking is a motion of its own, see `Motion`).
    3. A time is a finite float or array in s; the answer is a float or an array of the same shape.
    4. Extremes come from the roots of the pieces, not from samples.

    `duration` and `peak_velocity` are cached, not plain, properties so that a pulse which has one of them for a
    parameter may declare it as a field (a plain property would hide the field's value).
    """

    @property
    @abstractmethod
    def family(self) -> str:
        """What a capacity's `kinds` call this sort of pulse: "constant", "sine", "cosine", "double pulse", "record"."""

    @property
    @abstractmethod
    def kind(self) -> str:
        """What sentences call this pulse, for example "single sine"."""

    @abstractmethod
    def scaled(self, factor: float) -> Pulse:
        """Return this pulse with its acceleration times `factor`, as far as its own parameters can say it."""

    @abstractmethod
    def _rows(self) -> npt.ArrayLike:
        """Return the pieces, shape (n, 7)."""

    @cached_property
    def _table(self) -> PieceTable:
        return PieceTable(self._rows())

    @cached_property
    def _extremes(self) -> Extremes:
        return extremes(self._table)

    def __getstate__(self) -> dict[str, object]:
        """Leave out what is derived: a copy in another process computes it again, read-only arrays included."""
        return {name: value for name, value in vars(self).items() if not name.startswith("_")}

    @cached_property
    def duration(self) -> float:
        """Time from the first to the last acceleration, s."""
        return self._table.end[0]

    @property
    def pieces(self) -> Array:
        """Rows (t0, t1, c0, c1, A, omega, psi), shape (n, 7), contiguous from 0 to `duration`; read-only.

        With s = t - t0, a(t) = c0 + c1 s + A sin(omega s + psi) on [t0, t1), in s, m/s2, m/s3, rad/s and rad.
        """
        return self._table.rows

    @property
    def breakpoints(self) -> Array:
        """Times at which the acceleration or a derivative of it may jump, s, 0 and `duration` included; read-only."""
        return self._table.boundaries

    @overload
    def acceleration(self, t: float) -> float: ...
    @overload
    def acceleration(self, t: Array) -> Array: ...
    def acceleration(self, t: float | Array) -> float | Array:
        """Return a(t), m/s2, at `t` (s)."""
        return _plain(self._table.acceleration(t))

    @overload
    def velocity(self, t: float) -> float: ...
    @overload
    def velocity(self, t: Array) -> Array: ...
    def velocity(self, t: float | Array) -> float | Array:
        """Return v(t), m/s, at `t` (s)."""
        return _plain(self._table.velocity(t))

    @overload
    def displacement(self, t: float) -> float: ...
    @overload
    def displacement(self, t: Array) -> Array: ...
    def displacement(self, t: float | Array) -> float | Array:
        """Return x(t), m, at `t` (s)."""
        return _plain(self._table.displacement(t))

    @property
    def peak_acceleration(self) -> float:
        """Largest |a|, m/s2."""
        return max(map(abs, self._extremes.acceleration))

    @property
    def acceleration_range(self) -> tuple[float, float]:
        """Least and greatest a, m/s2."""
        return self._extremes.acceleration

    @property
    def fundamental(self) -> float | None:
        """The one frequency of a wave, Hz; None where there is none to speak of."""
        return None

    @cached_property
    def peak_velocity(self) -> float:
        """Largest |v| within [0, duration], m/s."""
        return self._extremes.velocity

    @property
    def peak_jerk(self) -> float:
        """Largest |da/dt| inside the pieces, m/s3; steps between pieces are not counted, see `largest_jump`."""
        return self._extremes.jerk

    @property
    def largest_jump(self) -> float:
        """Largest step of the acceleration, first and last included, m/s2; 0 where it is continuous."""
        return self._extremes.jump

    @property
    def displacement_range(self) -> tuple[float, float]:
        """Least and greatest x within [0, duration], m."""
        return self._extremes.displacement

    @property
    def travel(self) -> float:
        """Length of `displacement_range`, m: the stroke the pulse takes before any braking."""
        lowest, highest = self._extremes.displacement
        return highest - lowest

    @property
    def final_velocity(self) -> float:
        """Velocity at `duration`, m/s."""
        return self._table.end[1]

    @property
    def net_displacement(self) -> float:
        """Displacement at `duration`, m."""
        return self._table.end[2]


def _plain(answer: Array) -> float | Array:
    return answer if answer.ndim else float(answer)
