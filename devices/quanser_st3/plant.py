"""The emulated ST-III's mechanics and measuring: a closed position loop, an encoder, an accelerometer.

    x'' + 2 zeta w x' + w^2 x = w^2 r

with r the set-point, linear over each step, so that the matrix exponential of the step is exact.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field
from scipy.linalg import expm  # pyright: ignore[reportUnknownVariableType]

from devices.setpoints import checked_cycle_time

if TYPE_CHECKING:
    from collections.abc import Iterator

    from devices.table import Specimen

_Positive = Annotated[float, Field(gt=0.0, allow_inf_nan=False)]
_NotNegative = Annotated[float, Field(ge=0.0, allow_inf_nan=False)]
_Finite = Annotated[float, Field(allow_inf_nan=False)]


class St3Parameters(BaseModel):
    """Parameters of the emulated table. Placeholders all, but for the encoder: replace them with measured ones.

    Attributes
    ----------
    loop_frequency : float
        Natural frequency of the closed position loop, Hz. 31.9: the Shake Table II's, from Quanser's set-up scripts.
    loop_damping : float
        Damping ratio. 0.78: the Shake Table II's.
    encoder_step : float
        m; 0 for none. 12.7 mm / 8192 counts: the Shake Table II's, read in Quanser's set-up scripts.
    accelerometer_noise : float
        Standard deviation of one sample, m/s2. 5 mg: a guess.
    accelerometer_bias : float
        m/s2. 2 mg: a guess.
    accelerometer_range : float
        Largest reading of either sign, m/s2. 5 g: a guess.
    substeps : int
        Steps of the specimen in one cycle.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    loop_frequency: _Positive = 31.9
    loop_damping: _Positive = 0.78
    encoder_step: _NotNegative = 12.7e-3 / 8192
    accelerometer_noise: _NotNegative = 5e-3 * 9.81
    accelerometer_bias: _Finite = 2e-3 * 9.81
    accelerometer_range: _Positive = 5.0 * 9.81
    substeps: Annotated[int, Field(ge=1, le=1000)] = 1


class ClosedLoop:
    """State of the loop, advanced exactly.

    Parameters
    ----------
    angular_frequency, damping : float
        w, rad/s, and zeta.
    step : float
        s.
    position : float
        Where it rests, m.
    """

    def __init__(self, angular_frequency: float, damping: float, step: float, position: float) -> None:
        self._stiffness = angular_frequency**2
        self._friction = 2.0 * damping * angular_frequency
        self.position = self.setpoint = position
        self.velocity = 0.0
        # z = (x, x', r, r'), r' constant over the step.
        generator = np.array(
            [[0, 1, 0, 0], [-self._stiffness, -self._friction, self._stiffness, 0], [0, 0, 0, 1], [0, 0, 0, 0]], float
        )
        z = _exponential(generator * step)
        self._xx, self._xv, _, slope_x = z[0]
        self._vx, self._vv, _, slope_v = z[1]
        self._xe, self._ve = slope_x / step, slope_v / step

    @property
    def acceleration(self) -> float:
        """m/s2, now; continuous even where the set-point's velocity jumps."""
        return self._stiffness * (self.setpoint - self.position) - self._friction * self.velocity

    def advance(self, setpoint: float) -> None:
        """Live through one step while the set-point goes linearly to `setpoint`, m."""
        # About the set-point at the start, so that a table at rest stays there to the last bit.
        x, v, change = self.position - self.setpoint, self.velocity, setpoint - self.setpoint
        self.position = self.setpoint + (self._xx * x + self._xv * v + self._xe * change)
        self.velocity = self._vx * x + self._vv * v + self._ve * change
        self.setpoint = setpoint


class St3Plant:
    """The emulated table's moving part with its sensors and what stands on it; a `devices.cia402.drive.Machine`.

    Parameters
    ----------
    parameters : St3Parameters
    cycle_time : float
        s.
    rng : numpy.random.Generator
        Of the accelerometer's noise.
    specimen : callable, optional
        What stands on the table; see `devices.table.Specimen`.
    position, rotation : float
        Where the table rests, m, and the specimen's rotation, rad, before the first cycle.

    Attributes
    ----------
    released : bool
        Whether the specimen moves; while False it is held at its rotation.
    """

    def __init__(
        self,
        parameters: St3Parameters,
        cycle_time: float,
        rng: np.random.Generator,
        specimen: Specimen | None = None,
        position: float = 0.0,
        rotation: float = 0.0,
    ) -> None:
        self.parameters = parameters
        self.rotation = rotation
        self.released = True
        self._step = checked_cycle_time(cycle_time) / parameters.substeps
        self._loop = ClosedLoop(math.tau * parameters.loop_frequency, parameters.loop_damping, self._step, position)
        self._specimen = specimen
        self._noise = _normals(rng, parameters.accelerometer_noise)

    @property
    def position(self) -> float:
        """True position, m."""
        return self._loop.position

    @property
    def velocity(self) -> float:
        """True velocity, m/s."""
        return self._loop.velocity

    @property
    def acceleration(self) -> float:
        """True acceleration, m/s2."""
        return self._loop.acceleration

    def advance(self, setpoint: float) -> None:
        """Live through one cycle while the set-point goes linearly to `setpoint`, m."""
        loop, substeps = self._loop, self.parameters.substeps
        start = loop.setpoint
        for i in range(1, substeps + 1):
            before = loop.acceleration
            loop.advance(setpoint if i == substeps else start + (setpoint - start) * (i / substeps))
            if self._specimen is not None and self.released:
                self.rotation = self._specimen(self._step, before, loop.acceleration)

    def measure_position(self) -> float:
        """Return the encoder's reading, m."""
        step = self.parameters.encoder_step
        return round(self.position / step) * step if step > 0.0 else self.position

    def measure_acceleration(self) -> float:
        """Return the accelerometer's reading, m/s2."""
        p = self.parameters
        reading = self.acceleration + p.accelerometer_bias + next(self._noise)
        return min(max(reading, -p.accelerometer_range), p.accelerometer_range)


def _normals(rng: np.random.Generator, scale: float) -> Iterator[float]:
    """Yield Gaussian numbers; drawn in blocks, since one draw costs as much as a whole frame."""
    while True:
        yield from (scale * rng.standard_normal(1024)).tolist()


def _exponential(matrix: np.ndarray) -> list[list[float]]:
    return np.asarray(expm(matrix), float).tolist()
