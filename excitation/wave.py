"""Sine and cosine waves of acceleration."""

from __future__ import annotations

import math
from abc import abstractmethod
from dataclasses import replace
from typing import Annotated

from pydantic.dataclasses import dataclass

from excitation.pieces import Array, assemble
from excitation.pulse import Pulse
from excitation.quantity import VALUE, checked, quantity


@dataclass(frozen=True, config=VALUE)
class Wave(Pulse):
    """A whole or fractional number of cycles of one frequency; the shared part of `SineWave` and `CosineWave`.

    Parameters
    ----------
    amplitude : float
        A, m/s2; its sign is the sense of the first half cycle.
    frequency : float
        f, Hz, above 0.
    cycles : float
        Number of cycles, above 0, at most 10000; the wave lasts cycles / f.
    """

    amplitude: Annotated[float, quantity("m/s2")]
    frequency: Annotated[float, quantity("Hz", above=0.0)]
    cycles: Annotated[float, quantity(above=0.0, at_most=1e4)] = 1.0

    @property
    def kind(self) -> str:
        """What sentences call it: "single sine" or, with other than one cycle, "sine of 3 cycles"."""
        return f"single {self.family}" if self.cycles == 1.0 else f"{self.family} of {self.cycles:g} cycles"

    @property
    def fundamental(self) -> float:
        """The frequency, Hz."""
        return self.frequency

    @property
    def angular_frequency(self) -> float:
        """Omega = 2 pi f, rad/s."""
        return 2.0 * math.pi * self.frequency

    def scaled(self, factor: float) -> Wave:
        """Return the wave with its amplitude times `factor`."""
        return replace(self, amplitude=self.amplitude * checked("factor", factor))

    @abstractmethod
    def _phase(self) -> float:
        """Phase at time 0, rad."""

    def _rows(self) -> Array:
        # At the end of the last cycle q is 2 pi cycles to the last digit, so that a whole number of them ends at rest.
        duration = self.cycles / self.frequency
        return assemble([(duration, 0.0, 0.0, self.amplitude, 2.0 * math.pi * self.cycles / duration, self._phase())])


@dataclass(frozen=True, config=VALUE)
class SineWave(Wave):
    """a(t) = A sin(2 pi f t) for `cycles` cycles: peak v = A / (pi f) and, for one cycle, net x = A / (2 pi f^2).

    One cycle ends at rest but displaced by that net travel. Parameters and errors as in `Wave`; see `ConstantPulse`.

    Examples
    --------
    >>> wave = SineWave(3.0, 2.0)
    >>> wave.kind, wave.duration, round(wave.peak_velocity, 9), round(wave.net_displacement, 9)
    ('single sine', 0.5, 0.477464829, 0.119366207)
    """

    @property
    def family(self) -> str:
        """What a capacity's `kinds` call it."""
        return "sine"

    def _phase(self) -> float:
        return 0.0


@dataclass(frozen=True, config=VALUE)
class CosineWave(Wave):
    """a(t) = A cos(2 pi f t) for `cycles` cycles: peak v = A / (2 pi f), peak x = A / (2 pi^2 f^2), net x = 0.

    The acceleration steps by A at the start and back at the end of a whole number of cycles, which no band-limited
    table can follow. Parameters and errors as in `Wave`; see `ConstantPulse`.

    Examples
    --------
    >>> wave = CosineWave(3.0, 2.0)
    >>> wave.acceleration(0.0), wave.acceleration(0.5), round(wave.peak_velocity, 9)
    (3.0, 0.0, 0.238732415)
    """

    @property
    def family(self) -> str:
        """What a capacity's `kinds` call it."""
        return "cosine"

    def _phase(self) -> float:
        return 0.5 * math.pi
