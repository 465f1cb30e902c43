"""The stretch of a run around its pulse in which a command is corrected, and the signals in it."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from excitation.table_run import TableRun
from twin.errors import InputError
from twin.rocking.compiled import FloatArray

BEFORE, AFTER = 0.3, 0.5
"""Longest stretch before the pulse and behind it that is looked at, s; a correction anticipates the table's lag."""
SHARE = 0.9
"""Of the pause before and behind the pulse that may be used: the rest lets the positioning die away."""
JUDGED_BEFORE, JUDGED_AFTER = 0.05, 0.1
"""What is judged beside the pulse itself, s: a table that moves early or rings afterwards is wrong too."""
RAMP = 0.05
"""Time over which a correction is faded in and out at the ends of the window, s."""


@dataclass(frozen=True, slots=True)
class Trace:
    """What one run measured, a value a cycle from cycle 0: position, m, and acceleration, m/s2."""

    position: FloatArray
    acceleration: FloatArray


@dataclass(frozen=True, slots=True)
class Window:
    """Samples `first` to `first` + `size` of a run; sample k is at k times the cycle time.

    Attributes
    ----------
    cycle_time : float
        s.
    first, size : int
        Of the samples.
    start : float
        Time of the first sample after the start of the pulse, s: negative.
    position : FloatArray, shape (size + 2,)
        Asked position, m, with one sample more at either end.
    acceleration : FloatArray, shape (size,)
        Asked acceleration, m/s2.
    judged : NDArray[bool], shape (size,)
        Whether the sample counts in the error.
    jump : float
        Largest step of the asked acceleration, m/s2.
    still : int
        The table stands still during the first `still` samples of the run: the accelerometer's bias is read there.
    """

    cycle_time: float
    first: int
    size: int
    start: float
    position: FloatArray
    acceleration: FloatArray
    judged: np.ndarray[tuple[int], np.dtype[np.bool_]]
    jump: float
    still: int

    @property
    def peak(self) -> float:
        """Largest asked |acceleration|, m/s2."""
        return float(np.max(np.abs(self.acceleration)))

    @property
    def fade(self) -> FloatArray:
        """1 inside, falling to 0 at the first and the last sample over `RAMP`."""
        count = min(round(RAMP / self.cycle_time), self.size // 2)
        slope = 0.5 - 0.5 * np.cos(np.pi * np.arange(count) / count)
        return np.concatenate([slope, np.ones(self.size - 2 * count), slope[::-1]])

    def cut(self, samples: FloatArray) -> FloatArray:
        """Return the window's samples of a whole run."""
        return samples[self.first : self.first + self.size]

    def curvature(self, positions: FloatArray) -> FloatArray:
        """Return the second difference of a whole run's positions over the step squared, m/s2, in the window."""
        first, end = self.first, self.first + self.size
        return (positions[first + 1 : end + 1] - 2.0 * positions[first:end] + positions[first - 1 : end - 1]) / (
            self.cycle_time**2
        )

    @property
    def asked_curvature(self) -> FloatArray:
        """The second difference of the asked position over the step squared, m/s2."""
        return np.diff(self.position, 2) / self.cycle_time**2

    def unbiased(self, acceleration: FloatArray) -> FloatArray:
        """Return a whole run's measured acceleration without the accelerometer's bias, in the window, m/s2."""
        return self.cut(acceleration) - np.mean(acceleration[: self.still])


def window_of(motion: TableRun, cycle_time: float, pause: float) -> Window:
    """Return the window around the pulse of `motion`, inside pauses of `pause`, s, before and behind it.

    Raises
    ------
    InputError
        Where the pauses are too short to correct anything.
    """
    last = motion.shaking_end
    before, after = min(BEFORE, SHARE * pause), min(AFTER, SHARE * pause)
    first = math.ceil((motion.pulse_start - before) / cycle_time)
    size = math.floor((last + after) / cycle_time) - first + 1
    if before < RAMP or first < 1:
        raise InputError(f"pauses of {pause:g} s beside the pulse are too short to correct a command in")
    times = np.arange(first - 1, first + size + 1, dtype=np.float64) * cycle_time
    inner = times[1:-1]
    judged = (inner >= motion.pulse_start - JUDGED_BEFORE) & (inner <= last + JUDGED_AFTER)
    still = motion.phases[0].end
    return Window(
        cycle_time,
        first,
        size,
        first * cycle_time - motion.pulse_start,
        motion.displacement(times),
        motion.acceleration(inner),
        judged,
        motion.shaking.largest_jump,
        max(1, math.floor(SHARE * still / cycle_time)),
    )
