"""The emulated ST-III as its drive sees it: set-points go in, an encoder, an accelerometer and switches answer."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from devices.cia402.machine import Switches
from devices.quanser_st3.capacity import CAPACITY
from devices.quanser_st3.mechanics import Mechanics
from devices.quanser_st3.parameters import St3Parameters
from devices.sensors.accelerometer import Accelerometer
from devices.sensors.encoder import Encoder
from devices.setpoints import checked_cycle_time

if TYPE_CHECKING:
    import numpy as np

    from devices.quanser_st3.loop import LinearStep
    from devices.sample import Specimen

# A knot of the set-point this close to a cycle's end, in cycles, is at its end.
_SAME = 1e-9
# What is shorter is an instant for a specimen, s.
_INSTANT = 1e-12


class _Part(NamedTuple):
    """A part of each cycle over which the delayed set-point is linear, and where on its line it ends."""

    step: LinearStep
    line: int
    share: float


class St3Plant:
    """The emulated table's moving part with its sensors and what stands on it; a `devices.cia402.machine.Machine`.

    Parameters
    ----------
    parameters : St3Parameters
    cycle_time : float
        s.
    rng : numpy.random.Generator
        Of the accelerometer's noise.
    specimen : callable, optional
        What stands on the table; see `devices.sample.Specimen`. It feels the true acceleration, also that of a bumper.
    position, rotation : float
        Where the table rests, m, and the specimen's rotation, rad, before the first cycle.
    payload : float
        Mass of what stands on the table, kg: it makes the loop slower and the motor weaker.
    half_stroke : float
        Of the capacity, m: switches and bumpers are counted from its end.

    Attributes
    ----------
    encoder, accelerometer : object
        `read(true) -> float`; a fault puts another one in their place.
    released : bool
        Whether the specimen moves; while False it is held at its rotation.
    stop : bool
        Whether the emergency stop is pressed.
    """

    def __init__(
        self,
        parameters: St3Parameters,
        cycle_time: float,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        position: float = 0.0,
        rotation: float = 0.0,
        *,
        payload: float = 0.0,
        half_stroke: float = 0.5 * CAPACITY.stroke,
    ) -> None:
        p = parameters
        self.parameters = p
        self.encoder = Encoder(p.encoder_step)
        self.accelerometer = Accelerometer(
            rng, noise=p.accelerometer_noise, bias=p.accelerometer_bias, largest=p.accelerometer_range
        )
        self.rotation = rotation
        self.released = True
        self.stop = False
        self._specimen = specimen
        self._mechanics = Mechanics(p, payload, half_stroke, position)
        self._half_stroke = half_stroke
        self.pace(cycle_time)

    def pace(self, cycle_time: float) -> None:
        """Let every later cycle take `cycle_time`, s; the table is at rest at its set-point."""
        cycles, self._parts = self._divided(checked_cycle_time(cycle_time))
        # From the knot the loop came from to the one it takes last.
        self._setpoints = [self._mechanics.setpoint] * (cycles + 3)

    def _divided(self, cycle_time: float) -> tuple[int, list[_Part]]:
        """Return the whole cycles of the delay, and each cycle's parts: between knots of the set-point and substeps."""
        p = self.parameters
        cycles = int(p.delay / cycle_time + _SAME)
        knot = p.delay / cycle_time - cycles
        knot = knot if knot > _SAME else 0.0
        ends: list[float] = sorted({i / p.substeps for i in range(p.substeps + 1)} | {knot})
        parts: list[_Part] = []
        steps: dict[float, LinearStep] = {}
        for start, end in pairwise(ends):
            # Equal parts are equal to the last bit.
            duration = cycle_time / p.substeps if not knot else (end - start) * cycle_time
            step = steps.setdefault(duration, self._mechanics.linear_step(duration))
            line = 0 if end <= knot else 1
            parts.append(_Part(step, line, end - knot + (1.0 if line == 0 else 0.0)))
        return cycles, parts

    @property
    def position(self) -> float:
        """True position, m."""
        return self._mechanics.position

    @property
    def velocity(self) -> float:
        """True velocity, m/s."""
        return self._mechanics.velocity

    @property
    def acceleration(self) -> float:
        """True acceleration, m/s2."""
        return self._mechanics.acceleration

    @property
    def switches(self) -> Switches:
        """Limit switches, home switch and emergency stop, as the drive sees them."""
        x, end = self.position, self._half_stroke + self.parameters.switch_distance
        home = abs(x) <= 0.5 * self.parameters.home_width
        return Switches(negative=x <= -end, positive=x >= end, home=home, stop=self.stop)

    @property
    def powered(self) -> bool:
        """Whether the drive pushes. Without power friction brakes the table, and the bumpers stop it.

        As the power comes on the loop's set-point is where the table stands.
        """
        return self._mechanics.powered

    @powered.setter
    def powered(self, powered: bool) -> None:
        if powered and not self._mechanics.powered:
            self._mechanics.setpoint = self.position
            self._setpoints = [self.position] * len(self._setpoints)
        self._mechanics.powered = powered

    def advance(self, setpoint: float) -> None:
        """Live through one cycle in which the drive's set-point goes linearly to `setpoint`, m."""
        known = self._setpoints
        known.append(setpoint)
        del known[0]
        for step, line, share in self._parts:
            start, end = known[line], known[line + 1]
            spans = self._mechanics.advance(step, end if share == 1.0 else start + share * (end - start))
            if self._specimen is None or not self.released:
                continue
            for span in spans:
                if span.duration > _INSTANT:
                    self.rotation = self._specimen(*span)

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        return self.encoder.read(self.position)

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2."""
        return self.accelerometer.read(self.acceleration)
