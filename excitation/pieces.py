"""A base motion as contiguous pieces: closed forms of acceleration, velocity and displacement.

A piece is a row (t0, t1, c0, c1, A, omega, psi); with s = t - t0 and q = omega s, on [t0, t1)

    a(s) = c0 + c1 s + A sin(q + psi)
    v(s) = v0 + c0 s + c1 s^2 / 2 + (2 A / omega) sin(q/2 + psi) sin(q/2)
    x(s) = x0 + v0 s + c0 s^2 / 2 + c1 s^3 / 6 + (A / omega^2) (cos(psi) (q - sin q) + 2 sin(psi) sin^2(q/2))

The products of sines stand for cos(psi) - cos(q + psi) and 1 - cos(q), which lose every digit as q tends to 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from collections.abc import Iterable

Array: TypeAlias = npt.NDArray[np.float64]
Indices: TypeAlias = npt.NDArray[np.intp]
# One piece before it has a place in time: (duration, c0, c1, A, omega, psi).
Span: TypeAlias = tuple[float, float, float, float, float, float]


def steady(duration: float, acceleration: float = 0.0, slope: float = 0.0) -> Span:
    """Return the span of `duration` (s) whose acceleration (m/s2) begins there and grows by `slope` (m/s3)."""
    return (duration, acceleration, slope, 0.0, 0.0, 0.0)


def assemble(spans: Iterable[Span]) -> Array:
    """Return the rows (n, 7) of `spans` laid end to end from time 0; a span too short to advance the clock is left out.

    Examples
    --------
    >>> assemble([steady(0.5, 2.0)])
    array([[0. , 0.5, 2. , 0. , 0. , 0. , 0. ]])
    """
    rows: list[tuple[float, ...]] = []
    time = 0.0
    for duration, *shape in spans:
        end = time + duration
        if end > time:
            rows.append((time, end, *shape))
            time = end
    return np.array(rows, dtype=np.float64).reshape(-1, 7)


def as_spans(rows: Array) -> list[Span]:
    """Return rows (n, 7) as spans: the inverse of `assemble`, to the rounding of the times."""
    return [(t1 - t0, c0, c1, a, omega, psi) for t0, t1, c0, c1, a, omega, psi in rows.tolist()]


class PieceTable:
    """Rows of pieces with the velocity and displacement at which each begins; at rest at 0 before the first.

    Parameters
    ----------
    rows : array_like, shape (n, 7)
        Contiguous pieces from time 0, n >= 1; omega in rad/s, above 0 where A is not 0.

    Attributes
    ----------
    rows : array, shape (n, 7)
        The pieces; read-only.
    boundaries : array, shape (n + 1,)
        Their times, s, from 0 to the duration; read-only.

    Raises
    ------
    ValueError
        Wrong shape, not finite, not contiguous from 0, or a sine without a frequency.
    """

    def __init__(self, rows: npt.ArrayLike) -> None:
        table = np.array(rows, dtype=np.float64)
        if table.ndim != 2 or table.shape[1] != 7 or not table.size:
            raise ValueError(f"pieces must have shape (n, 7) with n of at least 1, not {table.shape}")
        if not np.isfinite(table).all():
            raise ValueError("pieces must be finite")
        if table[0, 0] != 0.0 or (table[1:, 0] != table[:-1, 1]).any() or (table[:, 1] <= table[:, 0]).any():
            raise ValueError("pieces must follow each other without a gap from time 0")
        if (table[table[:, 4] != 0.0, 5] <= 0.0).any():
            raise ValueError("a sinusoidal piece must have an angular frequency above 0 rad/s")
        self.rows: Array = table
        self.boundaries: Array = np.append(table[:, 0], table[-1, 1])
        self.rows.flags.writeable = False
        self.boundaries.flags.writeable = False
        # A silent piece at either end answers for the times before and after.
        padded = np.zeros((len(table) + 2, 7))
        padded[1:-1] = table
        padded[-1, 0] = table[-1, 1]
        self._t0, _, self._c0, self._c1, self._a, omega, self._psi = padded.T
        sinusoidal = self._a != 0.0
        self._omega = np.where(sinusoidal, omega, 0.0)
        divisor = np.where(sinusoidal, omega, 1.0)
        self._a_v = 2.0 * self._a / divisor
        self._a_x = self._a / divisor / divisor
        self._v0 = np.zeros(len(padded))
        self._x0 = np.zeros(len(padded))
        every, tau = np.arange(1, len(padded) - 1), table[:, 1] - table[:, 0]
        self._v0[2:] = np.cumsum(self._velocity(every, tau))
        self._x0[2:] = np.cumsum(self._displacement(every, tau))

    def acceleration(self, time: npt.ArrayLike) -> Array:
        """Return a(t), m/s2, right-continuous and 0 outside the pieces; shape of `time` (s)."""
        return self._acceleration(*self._find(time))

    def velocity(self, time: npt.ArrayLike) -> Array:
        """Return v(t), m/s, constant after the last piece; shape of `time` (s)."""
        return self._velocity(*self._find(time))

    def displacement(self, time: npt.ArrayLike) -> Array:
        """Return x(t), m, linear after the last piece; shape of `time` (s)."""
        return self._displacement(*self._find(time))

    def acceleration_in(self, piece: Indices, s: Array) -> Array:
        """Return a, m/s2, in pieces counted from 0, at local times from 0 to both their ends (s)."""
        return self._acceleration(piece + 1, s)

    def velocity_in(self, piece: Indices, s: Array) -> Array:
        """Return v, m/s; see `acceleration_in`."""
        return self._velocity(piece + 1, s)

    def displacement_in(self, piece: Indices, s: Array) -> Array:
        """Return x, m; see `acceleration_in`."""
        return self._displacement(piece + 1, s)

    @property
    def end(self) -> tuple[float, float, float]:
        """Time (s), velocity (m/s) and displacement (m) at the end."""
        return float(self.boundaries[-1]), float(self._v0[-1]), float(self._x0[-1])

    def _find(self, time: npt.ArrayLike) -> tuple[Indices, Array]:
        t = np.asarray(time, dtype=np.float64)
        if not np.isfinite(t).all():
            raise ValueError("time must be finite, in s")
        i = np.asarray(np.searchsorted(self.boundaries, t, side="right"))
        return i, t - self._t0[i]

    def _acceleration(self, i: Indices, s: Array) -> Array:
        return self._c0[i] + self._c1[i] * s + self._a[i] * np.sin(self._omega[i] * s + self._psi[i])

    def _velocity(self, i: Indices, s: Array) -> Array:
        half = 0.5 * self._omega[i] * s
        polynomial = s * (self._c0[i] + 0.5 * self._c1[i] * s)
        return self._v0[i] + (polynomial + self._a_v[i] * np.sin(half + self._psi[i]) * np.sin(half))

    def _displacement(self, i: Indices, s: Array) -> Array:
        q, psi = self._omega[i] * s, self._psi[i]
        polynomial = s * (self._v0[i] + s * (0.5 * self._c0[i] + self._c1[i] * s / 6.0))
        sinusoid = np.cos(psi) * _arc_excess(q) + 2.0 * np.sin(psi) * np.sin(0.5 * q) ** 2
        return self._x0[i] + (polynomial + self._a_x[i] * sinusoid)


def _arc_excess(q: Array) -> Array:
    """Return q - sin(q) to full relative precision: by its Taylor series below 1, where the difference cancels."""
    square = np.minimum(q * q, 1.0)
    series = np.ones_like(square)
    for n in range(16, 2, -2):
        # q - sin q = q^3/6 (1 - q^2/(4 5) (1 - q^2/(6 7) (1 - ...)))
        series = 1.0 - square / (n * (n + 1.0)) * series
    return np.where(np.abs(q) < 1.0, q * square / 6.0 * series, q - np.sin(q))
