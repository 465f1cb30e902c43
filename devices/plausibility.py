"""Whether what a table measures can be true: encoder and accelerometer judged every cycle, against each other too.

Pure arithmetic, a microsecond a cycle. The two sensors see one motion, so that over any time T, whatever moves it,

    (x(t) - 2 x(t - T) + x(t - 2 T)) / T^2  =  integral of a, weighted by a triangle over the last 2 T, its area 1

The accelerometer's side is the same second difference of its double integral, so that one ring of differences does.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final

if TYPE_CHECKING:
    from excitation import Capacity

SPAN: Final = 0.02
"""T, s. An encoder step of 1.55 um is then up to 0.016 m/s2, noise of 5 mg a sample about 0.01 m/s2."""
DISAGREEMENT: Final = 0.5
"""Difference of the two sides that is taken, m/s2, unless told: below a quarter of what lifts block B6L, 2.18 m/s2, and
ten times what noise, a bias of 2 mg and encoder steps come to."""
SHARE: Final = 0.1
"""Of the largest acceleration of late that is added to it: a wrong scale, or a lag of some milliseconds between the two
sensors, is calibration's affair."""
OF_LATE: Final = 0.2
"""s, in which a largest acceleration is forgotten (to 1/e)."""
FASTER: Final = 1.5
"""Times the table's top speed: no table moves faster than that from one cycle to the next."""
SLACK: Final = 1e-4
"""m, added to that for encoders with coarse steps."""
BEYOND: Final = 0.1
"""Of the stroke, to each side: further out no table gets, bumpers and all."""
UNMOVED: Final = 5e-4
"""m: a command that went so far moves every table, static friction or not."""
SUSPECT: Final = 5e-5
"""m: of two sensors that disagree, the encoder that stood still while the command went so far is named."""


class Plausibility:
    """Judges the sensors of one table, sample by sample.

    Parameters
    ----------
    capacity : excitation.Capacity
        The table's: stroke and top speed count.
    cycle_time : float
        s.
    disagreement : float
        Largest difference between what encoder and accelerometer say of the acceleration, m/s2; a tenth of the
        largest acceleration of late is added.

    Notes
    -----
    Judged are: a reading that is no number; a position no table gets to; a position that jumps; a position that stays
    the same to the last bit while the command goes on; encoder and accelerometer that disagree, with the one that
    stayed the same to the last bit named. Not judged: an error below the limit; an accelerometer that is stuck while
    the table hardly accelerates; the window of 2 T after a blow, a jump of acceleration that samples cannot follow, or
    after a missed cycle; the rotation sensor, which rightly stands still as long as the block does.

    Examples
    --------
    >>> from devices.quanser_st3.capacity import CAPACITY
    >>> sensors = Plausibility(CAPACITY, 1e-3)
    >>> sensors.judge(0, 0.0, 0.0, 0.0)
    >>> sensors.judge(1, 0.0, 0.005, 0.0)
    'encoder: the position jumps by 5.000 mm in one cycle; quanser_st3 moves 0.664 mm at most'
    """

    def __init__(self, capacity: Capacity, cycle_time: float, disagreement: float = DISAGREEMENT) -> None:
        self._name = capacity.name
        # A released machine's positions are counted from where its base is held, which may be one end of the stroke.
        self._origin, share = ("the centre", 0.5) if capacity.machine is None else ("where it is held", 1.0)
        self._farthest = (share + BEYOND) * capacity.stroke
        self._fastest = capacity.velocity
        self._h = cycle_time
        self._limit = disagreement
        self._half = max(4, round(SPAN / cycle_time))
        self._span = self._half * cycle_time
        # What a jump of acceleration between two samples can hide in the integral, told as the difference it makes.
        self._blow = 0.5 * disagreement * self._span / cycle_time
        self._differences = [0.0] * (2 * self._half + 1)
        self._forget = math.exp(-cycle_time / OF_LATE)
        self._largest = 0.0
        self._cycle: int | None = None
        self._restart(0.0, 0.0, 0.0)

    def judge(self, cycle: int, command: float, position: float, acceleration: float) -> str | None:
        """Take one sample; return what cannot be true of it, a sentence, or None.

        Parameters
        ----------
        cycle : int
            Its number; numbers left out are missed cycles.
        command : float
            The set-point it answers, m.
        position, acceleration : float
            Measured, m and m/s2.
        """
        if not (math.isfinite(position) and math.isfinite(acceleration)):
            return f"sensors: position {position} m and acceleration {acceleration} m/s2 are measured"
        if abs(position) > self._farthest:
            reach = f"encoder: {position * 1e3:.1f} mm from {self._origin} are measured"
            return f"{reach}; {self._name} cannot get beyond {self._farthest * 1e3:.1f} mm"
        last, self._cycle = self._cycle, cycle
        if last is not None and (words := self._jump(cycle - last, position)) is not None:
            return words
        if last is None or cycle - last > 1:
            self._restart(command, position, acceleration)
            return None
        if (words := self._frozen(command, position)) is not None:
            return words
        return self._disagreement(position, acceleration)

    def _restart(self, command: float, position: float, acceleration: float) -> None:
        self._position, self._acceleration = position, acceleration
        self._velocity_sum = self._position_sum = 0.0
        self._differences[0] = position
        self._index = self._known = 0
        self._unmoved, self._unmoved_from, self._commanded = 0, command, 0.0
        self._unchanged = 0

    def _jump(self, steps: int, position: float) -> str | None:
        change = abs(position - self._position)
        most = self._fastest * steps * self._h
        if change <= FASTER * most + SLACK:
            return None
        cycles = "one cycle" if steps == 1 else f"{steps} cycles"
        return (
            f"encoder: the position jumps by {change * 1e3:.3f} mm in {cycles}; "
            f"{self._name} moves {most * 1e3:.3f} mm at most"
        )

    def _frozen(self, command: float, position: float) -> str | None:
        if position != self._position:
            self._unmoved, self._unmoved_from, self._commanded = 0, command, 0.0
            return None
        self._unmoved += 1
        self._commanded = abs(command - self._unmoved_from)
        if self._unmoved < self._half or self._commanded < UNMOVED:
            return None
        return (
            f"encoder: the same for {self._unmoved} cycles, in which the command moved {self._commanded * 1e3:.2f} mm"
        )

    def _disagreement(self, position: float, acceleration: float) -> str | None:
        before, h, half = self._acceleration, self._h, self._half
        self._position, self._acceleration = position, acceleration
        self._unchanged = self._unchanged + 1 if acceleration == before else 0
        # Linear between samples: v += h (a0 + a1) / 2, x += h v + h^2 (2 a0 + a1) / 6.
        self._position_sum += h * (self._velocity_sum + h * (2.0 * before + acceleration) / 6.0)
        self._velocity_sum += 0.5 * h * (before + acceleration)
        ring = self._differences
        now = (self._index + 1) % len(ring)
        self._index = now
        ring[now] = position - self._position_sum
        # A blow between two samples is in the encoder's reading and not in the integral: both ends of it must leave.
        self._known = 0 if abs(acceleration - before) > self._blow else self._known + 1
        if self._known < 2 * half:
            return None
        self._largest = max(abs(acceleration), self._forget * self._largest)
        limit = self._limit + SHARE * self._largest
        apart = (ring[now] - 2.0 * ring[now - half] + ring[now - 2 * half]) / self._span**2
        if abs(apart) <= limit:
            return None
        return (
            f"sensors: encoder and accelerometer differ by {abs(apart):.2f} m/s2 over {2e3 * self._span:.0f} ms, "
            f"the limit is {limit:.2f} m/s2; {self._suspect(acceleration)}"
        )

    def _suspect(self, acceleration: float) -> str:
        """Return what speaks against one of two sensors that disagree."""
        if self._commanded > SUSPECT:
            return f"the encoder has been the same for {self._unmoved + 1} readings"
        reading = f"the accelerometer reads {acceleration:+.2f} m/s2"
        return f"{reading}, the same for {self._unchanged} cycles" if self._unchanged >= self._half else reading
