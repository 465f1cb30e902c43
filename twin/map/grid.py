"""The cells of a map: which pulse stands in each, as rows of pieces for the compiled code or as a pulse for `simulate`.

Cells are numbered row by row. The pieces are, bit for bit, those of the pulse objects.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from excitation import ConstantPulse, CosineWave, DoublePulse, Pulse, SineWave
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray

SINE, COSINE, LASTING_SINE, CONSTANT, DOUBLE_PULSE = KINDS = (
    "sine",
    "cosine",
    "lasting sine",
    "constant",
    "double pulse",
)
MOST_CYCLES = 1e4


@dataclass(frozen=True, slots=True)
class Grid:
    """Rows and columns of a map of one block, and the kind of pulse in its cells.

    Parameters
    ----------
    block : Block
    kind : str
        One of `KINDS`.
    rows : ndarray, shape (n,)
        Amplitudes in g tan(alpha); of a double pulse the peak velocities, m/s.
    columns : ndarray, shape (m,)
        Frequencies omega / p; of a constant pulse its durations, s; of a double pulse its stop gaps, m.
    duration : float or None
        How long a lasting sine lasts, s.
    rebound, pulse_acceleration : float
        Of a double pulse, see `excitation.DoublePulse`.
    """

    block: Block
    kind: str
    rows: FloatArray
    columns: FloatArray
    duration: float | None = None
    rebound: float = 0.0
    pulse_acceleration: float = 100.0

    @property
    def shape(self) -> tuple[int, int]:
        """Numbers of rows and of columns."""
        return len(self.rows), len(self.columns)

    @property
    def size(self) -> int:
        """Number of cells."""
        return len(self.rows) * len(self.columns)

    def pulse(self, cell: int) -> Pulse | None:
        """Return the pulse of a cell; None where there is no such double pulse: its gap is shorter than its run-up."""
        first, second = float(self.rows[cell // len(self.columns)]), float(self.columns[cell % len(self.columns)])
        if self.kind == DOUBLE_PULSE:
            if not bool(self.possible(cell, cell + 1)[0]):
                return None
            return DoublePulse(first, second, self.rebound, self.pulse_acceleration)
        a = first * self.block.uplift_acceleration
        if self.kind == CONSTANT:
            return ConstantPulse(a, second)
        f = second * self.block.frequency_parameter / (2.0 * math.pi)
        if self.kind == LASTING_SINE:
            return SineWave(a, f, f * (self.duration or 0.0))
        return SineWave(a, f) if self.kind == SINE else CosineWave(a, f)

    def possible(self, start: int, stop: int) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
        """Return which cells from `start` to before `stop` have a pulse."""
        if self.kind != DOUBLE_PULSE:
            return np.ones(stop - start, dtype=np.bool_)
        v, gap = self._values(start, stop)
        return 0.5 * v * (v / self.pulse_acceleration) <= gap

    def pieces(self, start: int, stop: int) -> FloatArray:
        """Return the pieces of the cells from `start` to before `stop`, shape (stop - start, n, 7)."""
        first, second = self._values(start, stop)
        if self.kind == DOUBLE_PULSE:
            return self._double_pulses(first, second)
        table = np.zeros((stop - start, 1, 7))
        a = first * self.block.uplift_acceleration
        if self.kind == CONSTANT:
            table[:, 0, 1] = second
            table[:, 0, 2] = a
            return table
        f = second * self.block.frequency_parameter / (2.0 * math.pi)
        cycles = f * (self.duration or 0.0) if self.kind == LASTING_SINE else 1.0
        table[:, 0, 1] = cycles / f
        table[:, 0, 4] = a
        table[:, 0, 5] = 2.0 * math.pi * cycles / table[:, 0, 1]
        table[:, 0, 6] = 0.5 * math.pi if self.kind == COSINE else 0.0
        return table

    def _values(self, start: int, stop: int) -> tuple[FloatArray, FloatArray]:
        row, column = np.divmod(np.arange(start, stop), len(self.columns))
        return self.rows[row], self.columns[column]

    def _double_pulses(self, v: FloatArray, gap: FloatArray) -> FloatArray:
        """Return up to v, the coast, and back to -rebound v; an impossible cell gets no coast."""
        a = self.pulse_acceleration
        up = v / a
        table = np.zeros((len(v), 3, 7))
        table[:, 0, 1] = table[:, 1, 0] = up
        table[:, 1, 1] = table[:, 2, 0] = up + np.maximum((gap - 0.5 * v * up) / v, 0.0)
        table[:, 2, 1] = table[:, 2, 0] + (1.0 + self.rebound) * v / a
        table[:, 0, 2] = a
        table[:, 2, 2] = -a
        return table


def checked_axis(name: str, values: object, *, signed: bool = False) -> FloatArray:
    """Return an axis as a read-only array; raises `ValueError` where it is empty, not finite or not above 0."""
    axis = np.array(values, dtype=np.float64)
    if axis.ndim != 1 or axis.size == 0:
        raise ValueError(f"{name} must be a sequence of at least one number; it has the shape {axis.shape}")
    if not bool(np.isfinite(axis).all()):
        raise ValueError(f"{name} must be finite")
    if not signed and not bool((axis > 0.0).all()):
        raise ValueError(f"{name} must be above 0; the least is {float(axis.min()):g}")
    axis.flags.writeable = False
    return axis


def make_grid(
    block: Block,
    kind: str,
    *,
    amplitudes: object = None,
    frequencies: object = None,
    durations: object = None,
    peak_velocities: object = None,
    stop_gaps: object = None,
    duration: float | None = None,
    rebound: float = 0.0,
    pulse_acceleration: float = 100.0,
) -> Grid:
    """Return the grid of `kind` from exactly the axes it has; raises `ValueError` in one sentence."""
    if kind not in KINDS:
        raise ValueError(f"kind is {kind!r}; a map is of {', '.join(KINDS)}")
    given = {
        "amplitudes": amplitudes,
        "frequencies": frequencies,
        "durations": durations,
        "peak_velocities": peak_velocities,
        "stop_gaps": stop_gaps,
    }
    wanted = axes_of(kind)
    for name, values in given.items():
        if (values is None) is (name in wanted):
            what = "needs" if values is None else "has no"
            raise ValueError(f"a map of kind {kind!r} {what} {name}; its axes are {wanted[0]} and {wanted[1]}")
    rows = checked_axis(wanted[0], given[wanted[0]], signed=wanted[0] == "amplitudes")
    columns = checked_axis(wanted[1], given[wanted[1]])
    if (duration is None) is (kind == LASTING_SINE):
        raise ValueError(f"a map of kind {kind!r} {'needs' if duration is None else 'has no'} duration, in s")
    if duration is not None:
        if not 0.0 < duration < math.inf:
            raise ValueError(f"duration is {duration:g} s; it must be above 0 and finite")
        cycles = duration * block.frequency_parameter / (2.0 * math.pi) * float(columns.max())
        if cycles > MOST_CYCLES:
            raise ValueError(f"duration asks {cycles:.6g} cycles of the highest frequency; at most {MOST_CYCLES:g}")
    if not 0.0 <= rebound <= 1.0:
        raise ValueError(f"rebound is {rebound:g}; it is a ratio of velocities, from 0 to 1")
    if not 0.0 < pulse_acceleration < math.inf:
        raise ValueError(f"pulse_acceleration is {pulse_acceleration:g} m/s2; it must be above 0 and finite")
    return Grid(block, kind, rows, columns, duration, rebound, pulse_acceleration)


def axes_of(kind: str) -> tuple[str, str]:
    """Return the names of the rows' and the columns' values."""
    if kind == CONSTANT:
        return "amplitudes", "durations"
    return ("peak_velocities", "stop_gaps") if kind == DOUBLE_PULSE else ("amplitudes", "frequencies")
