"""Pulses whose waveform a table's limits have changed: jumps made into ramps, peaks cut off."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from excitation.extremes import Points, jumps, turning_points, with_crossings
from excitation.pieces import Array, Indices, PieceTable, Span, as_spans, assemble, steady
from excitation.pulse import Pulse
from excitation.quantity import checked

# Gauss-Legendre nodes on [0, 1]: exact to rounding for the square of a quarter of a sine.
_NODES, _WEIGHTS = 0.5 * (np.polynomial.legendre.leggauss(12) + np.array([[1.0], [0.0]]))


@dataclass(frozen=True)
class Ramped(Pulse):
    """`pulse` with a linear ramp of slope `jerk` put in wherever its acceleration jumps, first and last included.

    Between the ramps the pulse is unchanged, only later; the ramps take extra time and leave extra velocity and
    displacement (a ramp from 0 up to a0 adds a0^2 / (2 jerk) of velocity), which this pulse reports as its own.

    Parameters
    ----------
    pulse : Pulse
        Any pulse; steps of rounding (`excitation.extremes.JUMP_TOLERANCE`) stay.
    jerk : float
        Slope of the ramps, m/s3, above 0.

    Raises
    ------
    ValueError
        A jerk that is not a finite number above 0.

    Examples
    --------
    >>> from excitation import ConstantPulse
    >>> ramped = Ramped(ConstantPulse(2.0, 0.5), jerk=20.0)
    >>> round(ramped.duration, 9), round(ramped.final_velocity, 9), ramped.largest_jump
    (0.7, 1.2, 0.0)
    """

    pulse: Pulse
    jerk: float

    def __post_init__(self) -> None:
        checked("jerk", self.jerk, "m/s3", above=0.0, at_most=1e9)

    @property
    def family(self) -> str:
        """The pulse's family."""
        return self.pulse.family

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return f"ramped {self.pulse.kind}"

    @property
    def fundamental(self) -> float | None:
        """The pulse's frequency, Hz."""
        return self.pulse.fundamental

    def scaled(self, factor: float) -> Ramped:
        """Return the scaled pulse with ramps of the same slope."""
        return Ramped(self.pulse.scaled(factor), self.jerk)

    def _rows(self) -> Array:
        table = self.pulse._table
        heights = jumps(table).tolist()
        after = np.append(table.rows[:, 2] + table.rows[:, 4] * np.sin(table.rows[:, 6]), 0.0)
        spans: list[Span] = []
        for i, span in enumerate([*as_spans(table.rows), None]):
            height = heights[i]
            if height:
                slope = self.jerk if height > 0.0 else -self.jerk
                spans.append(steady(height / slope, float(after[i]) - height, slope))
            if span is not None:
                spans.append(span)
        return assemble(spans)


@dataclass(frozen=True)
class Saturated(Pulse):
    """`pulse` with its acceleration held at `level` wherever it would pass it: max(-level, min(level, a)), exactly.

    What is cut off no longer cancels: the residual velocity (`final_velocity`) and displacement are this pulse's own.

    Parameters
    ----------
    pulse : Pulse
        Any pulse.
    level : float
        Largest |a|, m/s2, at least 0.

    Raises
    ------
    ValueError
        A level that is not a finite number of at least 0.

    Examples
    --------
    >>> from excitation import SineWave
    >>> cut = Saturated(SineWave(3.0, 2.0), level=1.5)
    >>> len(cut.pieces), round(cut.peak_acceleration, 9), round(cut.shape_error, 9)
    (5, 1.5, 0.415940689)
    """

    pulse: Pulse
    level: float

    def __post_init__(self) -> None:
        checked("level", self.level, "m/s2", at_least=0.0)

    @property
    def family(self) -> str:
        """The pulse's family."""
        return self.pulse.family

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return f"saturated {self.pulse.kind}"

    @property
    def fundamental(self) -> float | None:
        """The pulse's frequency, Hz."""
        return self.pulse.fundamental

    @property
    def shape_error(self) -> float:
        """Root mean square of what was cut off over that of the pulse's acceleration; 0 where nothing was."""
        table = self.pulse._table
        piece, start, end = _segments(self._points(table))
        s = start[:, None] + (end - start)[:, None] * _NODES
        a = table.acceleration_in(np.broadcast_to(piece[:, None], s.shape), s)
        weights = (end - start)[:, None] * _WEIGHTS
        whole = float((weights * a**2).sum())
        cut = float((weights * (a - np.clip(a, -self.level, self.level)) ** 2).sum())
        return (cut / whole) ** 0.5 if whole > 0.0 else 0.0

    def scaled(self, factor: float) -> Saturated:
        """Return the pulse with waveform and level times `factor`."""
        return Saturated(self.pulse.scaled(factor), self.level * abs(checked("factor", factor)))

    def _points(self, table: PieceTable) -> Points:
        points = with_crossings(table, turning_points(table), "acceleration", self.level)
        return with_crossings(table, points, "acceleration", -self.level)

    def _rows(self) -> Array:
        table = self.pulse._table
        piece, start, end = _segments(self._points(table))
        middle = table.acceleration_in(piece, 0.5 * (start + end))
        side = np.where(middle > self.level, 1, np.where(middle < -self.level, -1, 0))
        # One row for each run of segments on one side, or, where nothing is cut, of one piece.
        source = np.where(side == 0, piece, -1)
        first = np.append(True, (np.diff(side) != 0) | (np.diff(source) != 0))
        piece, start, side = piece[first], start[first], side[first]
        rows = table.rows[piece]
        _, _, c0, c1, _, omega, psi = table.rows[piece].T
        rows[:, 0] += start
        rows[:, 1] = np.append(rows[1:, 0], table.rows[-1, 1])
        rows[:, 2] = c0 + c1 * start
        rows[:, 6] = psi + omega * start
        held = side != 0
        rows[held, 2:] = 0.0
        rows[held, 2] = self.level * side[held]
        return rows[rows[:, 1] > rows[:, 0]]


def _segments(points: Points) -> tuple[Indices, Array, Array]:
    """Return the piece, start and end (local times, s) of every stretch between neighbouring points."""
    piece, s = points
    inside = (piece[1:] == piece[:-1]) & (s[1:] > s[:-1])
    return piece[:-1][inside], s[:-1][inside], s[1:][inside]
