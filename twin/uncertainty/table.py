"""How a table answers: the base motion that is really made where one is asked for, from rest.

A delay is left out: from rest it only shifts what happens. What saturates is left out too: a plan inside the table's
capacity does not come near it, and the emulated table's own warnings say where it does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from excitation.pieces import PieceTable
from twin.achieved import Achieved
from twin.errors import InputError
from twin.rocking.compiled import FloatArray
from twin.uncertainty.motion import pieces_through

STEP = 1e-3
"""Between the samples of a linear table's answer, s: a mean over as much changes 30 Hz by 0.15 %."""
RINGING = 0.6
"""Time a linear table is given to come to rest after the asked motion, s."""


class TableResponse(Protocol):
    """What makes the real base motion of the asked one."""

    @property
    def source(self) -> str:
        """Where it is known from, in words."""
        ...

    def made(self, rows: FloatArray) -> FloatArray:
        """Return the pieces, shape (m, 7), of what is made of the asked ones, shape (n, 7); both from time 0."""
        ...


@dataclass(frozen=True, slots=True)
class AsAsked:
    """A table that makes what it is asked for."""

    source: str = "as asked"

    def made(self, rows: FloatArray) -> FloatArray:
        """Return the same."""
        return rows


AS_ASKED = AsAsked()


@dataclass(frozen=True, slots=True)
class LinearResponse:
    """A table known by its frequency response.

    Parameters
    ----------
    response : callable
        Frequency, Hz -> made over asked acceleration.
    source : str
    """

    response: Callable[[float], complex]
    source: str
    _known: dict[int, NDArray[np.complex128]] = field(default_factory=dict, repr=False, compare=False)

    def made(self, rows: FloatArray) -> FloatArray:
        """Return straight pieces through the filtered acceleration."""
        table = PieceTable(rows)
        size = math.ceil((table.end[0] + RINGING) / STEP) + 1
        # Means over a step, from exact velocities: a jump between two samples keeps its place and its momentum.
        edges = (np.arange(size + 1) - 0.5) * STEP
        mean = np.diff(table.velocity(edges)) / STEP
        length = 1 << math.ceil(math.log2(2 * size))
        answer = np.fft.irfft(self._at(length) * np.fft.rfft(mean, length), length)[:size]
        return pieces_through(np.asarray(answer, dtype=np.float64), STEP)

    def _at(self, length: int) -> NDArray[np.complex128]:
        if length not in self._known:
            frequencies = np.fft.rfftfreq(length, STEP)
            self._known[length] = np.array([self.response(float(f)) for f in frequencies], dtype=np.complex128)
        return self._known[length]


@dataclass(frozen=True, slots=True)
class MeasuredResponse:
    """A table whose answer to the one asked motion was measured; it has none to another.

    Parameters
    ----------
    achieved : Achieved
    """

    achieved: Achieved

    @property
    def source(self) -> str:
        """As the measurement says."""
        return self.achieved.source

    def made(self, rows: FloatArray) -> FloatArray:  # noqa: ARG002 - it was measured for these
        """Return straight pieces through what was measured, from the pulse's start on."""
        achieved = self.achieved
        first = max(0, math.ceil(-achieved.start / achieved.cycle_time - 1e-9))
        return pieces_through(achieved.acceleration[first:], achieved.cycle_time)


def read_transfer(text: str, name: str) -> LinearResponse:
    """Return the table that a CSV with the columns frequency_hz, gain, phase_deg describes; linear in between.

    Below the first and above the last frequency its gain and phase stay what they are there.

    Raises
    ------
    InputError
        One sentence: no such columns, a value that is no number, frequencies that do not grow.

    Examples
    --------
    >>> table = read_transfer("frequency_hz,gain,phase_deg\\n0,1,0\\n10,0.8,-90\\n", "t.csv")
    >>> complex(round(table.response(5.0).real, 3), round(table.response(5.0).imag, 3))
    (0.636-0.636j)
    """
    columns = ("frequency_hz", "gain", "phase_deg")
    lines = [line for line in text.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    head = [word.strip() for word in lines[0].split(",")] if lines else []
    if sorted(head) != sorted(columns):
        raise InputError(f"transfer function {name}: its first line must name the columns {', '.join(columns)}")
    try:
        read = np.array([[float(word) for word in line.split(",")] for line in lines[1:]], dtype=np.float64)
    except ValueError:
        raise InputError(f"transfer function {name}: every line must be three numbers") from None
    if read.ndim != 2 or read.shape[1] != 3 or not bool(np.isfinite(read).all()):
        raise InputError(f"transfer function {name}: every line must be three finite numbers, and there must be one")
    f, gain, phase = (read[:, head.index(column)] for column in columns)
    if f[0] < 0.0 or not bool((np.diff(f) > 0.0).all()) or bool((gain < 0.0).any()):
        raise InputError(f"transfer function {name}: frequencies must grow from 0 or more, and gains be 0 or more")
    turns = np.unwrap(np.radians(phase))

    def response(frequency: float) -> complex:
        size, angle = float(np.interp(frequency, f, gain)), float(np.interp(frequency, f, turns))
        return complex(size * math.cos(angle), size * math.sin(angle))

    return LinearResponse(response, f"by the transfer function in {name}")
