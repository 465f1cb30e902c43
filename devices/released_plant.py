"""Mechanics that emulated released machines share: legs of the motion, each exact, one after the other until rest.

A leg is a name and the spans of its acceleration (`excitation.pieces`: a = c0 + c1 s + A sin(omega s + psi)). The leg
after it begins from the position and velocity in which it ended: an intervention in mid run changes only what follows.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Final

from devices.sensors.accelerometer import Accelerometer
from devices.sensors.encoder import Encoder
from devices.setpoints import checked_cycle_time
from excitation.pieces import Span, steady

if TYPE_CHECKING:
    import numpy as np

    from devices.released_parameters import MeasuringParameters
    from devices.sample import Specimen

HELD: Final = "held"
REST: Final = "rest"
_ENDLESS: Final = 1e9
# The specimen's steps in a sine, of its half period: the trapezoidal rule then errs by 2e-4 of the change of speed.
_STEPS_IN_HALF_SINE: Final = 64


class ReleasedPlant(ABC):
    """The base of a released machine with its sensors and what stands on it, at 0 where it is held.

    A subclass says what comes after each leg in `_after`.

    Parameters
    ----------
    parameters : MeasuringParameters
    cycle_time : float
        s.
    rng : numpy.random.Generator
        Of the accelerometer's noise.
    specimen : callable, optional
        What stands on the base; see `devices.sample.Specimen`. It feels the true acceleration, jumps included.
    rotation : float
        Of the specimen, rad, before the first cycle.

    Attributes
    ----------
    position, velocity, acceleration : float
        True ones, m, m/s, m/s2.
    leg : str
        What the base is doing: "held", a leg's name, "rest".
    encoder, accelerometer : object
        `read(true) -> float`; a fault puts another one in their place. The accelerometer is handed the mean over the
        last cycle, as a converter that integrates does: no blow is too short for it, and speeds add up.
    released : bool
        Whether the specimen moves; while False it is held at its rotation.
    """

    def __init__(
        self,
        parameters: MeasuringParameters,
        cycle_time: float,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        rotation: float = 0.0,
    ) -> None:
        p = parameters
        self.parameters = p
        self.encoder = Encoder(p.encoder_step)
        self.accelerometer = Accelerometer(
            rng, noise=p.accelerometer_noise, bias=p.accelerometer_bias, largest=p.accelerometer_range
        )
        self.rotation = rotation
        self.released = True
        self._cycle_time = checked_cycle_time(cycle_time)
        self._specimen = specimen
        self.set_up()

    def set_up(self) -> None:
        """Put the base back to where it is held, as an operator does between two runs."""
        self.position = self.velocity = self.acceleration = 0.0
        self.leg = HELD
        self._spans: list[Span] = []
        self._begun = 0.0
        self._start = (0.0, 0.0)
        self._mean_acceleration = 0.0

    @property
    def air(self) -> bool:
        """Whether an air supply is on; there is none here."""
        return False

    @air.setter
    def air(self, on: bool) -> None:
        # A machine without an air supply has nothing to switch.
        del on

    @property
    def held(self) -> bool:
        """Whether the base stands in its latch and nothing will move it."""
        return self.leg == HELD and not self._spans

    @property
    def at_rest(self) -> bool:
        """Whether the base stands and nothing will move it."""
        return self.held or self.leg == REST

    def release(self) -> None:
        """Open the latch, or fire; does nothing to a base that is not held."""
        if self.held:
            self._enter(HELD, [steady(self.parameters.release_delay)])

    def advance(self) -> None:
        """Live through one cycle."""
        before, left = self.velocity, self._cycle_time
        while left > 0.0:
            while self._spans and self._begun >= self._spans[0][0]:
                self._next_span()
            span = self._spans[0] if self._spans else steady(_ENDLESS)
            duration = min(left, span[0] - self._begun)
            self._live(span, duration)
            left -= duration
        self._mean_acceleration = (self.velocity - before) / self._cycle_time

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        return self.encoder.read(self.position)

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2: of the mean over the last cycle."""
        return self.accelerometer.read(self._mean_acceleration)

    @abstractmethod
    def _after(self, leg: str) -> tuple[str, list[Span]] | None:
        """Return the leg after `leg`, which begins at `position` with `velocity`; None where the base stays at rest."""

    def _enter(self, leg: str, spans: list[Span]) -> None:
        """Begin a leg here and now."""
        self.leg, self._spans, self._begun = leg, spans, 0.0
        self._start = (self.position, self.velocity)

    def _next_span(self) -> None:
        del self._spans[0]
        self._begun = 0.0
        self._start = (self.position, self.velocity)
        while not self._spans and self.leg != REST:
            following = self._after(self.leg)
            if following is None:
                # What rounding left of the last leg's velocity is none.
                self.velocity = self.acceleration = 0.0
                self._enter(REST, [])
            else:
                self._enter(*following)

    def _live(self, span: Span, duration: float) -> None:
        """Live through a part of a span, the specimen with it."""
        _, _, c1, a, omega, _ = span
        steps = max(1, math.ceil(duration * omega / math.pi * _STEPS_IN_HALF_SINE)) if a else 1
        begun, acceleration = self._begun, _acceleration(span, self._begun)
        moves = bool(self._spans) and (self.leg != HELD)
        if self._specimen is not None and self.released:
            before = acceleration
            for k in range(1, steps + 1):
                after = _acceleration(span, begun + duration * k / steps) if a or c1 else acceleration
                self.rotation = self._specimen(duration / steps, before, after)
                before = after
        if not moves:
            self._begun += duration if self._spans else 0.0
            return
        self._begun = span[0] if duration == span[0] - begun else begun + duration
        self.acceleration = _acceleration(span, self._begun)
        self.position, self.velocity = _moved(span, self._begun, *self._start)


def _acceleration(span: Span, s: float) -> float:
    _, c0, c1, a, omega, psi = span
    return c0 + c1 * s + (a * math.sin(omega * s + psi) if a else 0.0)


def _moved(span: Span, s: float, position: float, velocity: float) -> tuple[float, float]:
    """Return position and velocity after `s` of a span begun at `position` with `velocity`; see `excitation.pieces`."""
    _, c0, c1, a, omega, psi = span
    x = position + s * (velocity + s * (0.5 * c0 + c1 * s / 6.0))
    v = velocity + s * (c0 + 0.5 * c1 * s)
    if a:
        q = omega * s
        v += 2.0 * a / omega * math.sin(0.5 * q + psi) * math.sin(0.5 * q)
        x += a / omega**2 * (math.cos(psi) * (q - math.sin(q)) + 2.0 * math.sin(psi) * math.sin(0.5 * q) ** 2)
    return x, v
