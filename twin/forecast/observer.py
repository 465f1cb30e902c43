"""The state that follows the specimen: the twin's prediction, corrected by what is measured, and how sure it is."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from pydantic.dataclasses import dataclass

from excitation.quantity import VALUE, quantity
from twin.forecast.belief import ALPHA as B_ALPHA
from twin.forecast.belief import ETA as B_ETA
from twin.forecast.belief import PHI as B_PHI
from twin.forecast.belief import RATE as B_RATE
from twin.forecast.belief import SIZE
from twin.forecast.ensemble import KNOWN, KNOWN_ALPHA, KNOWN_PHI, KNOWN_RATE, KNOWN_RESTITUTION, KNOWN_SIDE
from twin.forecast.observation import (
    BELIEVED,
    INNOVATION,
    MEMORY,
    NORMALISED,
    READING,
    REJECTED,
    SQUARED,
    TAUGHT,
    begin_at,
    observe,
)
from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.march import HALF_TURN
from twin.rocking.run import NOTHING_STEPS, initial_state, local_tolerance, parameters, signed
from twin.rocking.series import scratch
from twin.rocking.state import ALPHA, EVENT_COLUMNS, PHI, RATE, RESTITUTION, SIDE

EVENTS_AT_ONCE = 32
# A mean of the squared normalised innovation above this is no chance: 1 is expected, its deviation 0.18.
INCONSISTENT = 4.0
# Readings not believed in a row before the estimate and the sensor are said to disagree.
MOST_REJECTED = 10
# A slenderness known this much better than before has been observed.
OBSERVED = 0.7


@dataclass(frozen=True, config=VALUE)
class Uncertainty:
    """What is not known exactly; each number is one standard deviation.

    Parameters
    ----------
    rotation_noise : float
        Of one reading of the rotation sensor, rad, above 0.
    rotation_step : float
        The sensor's step, rad: adds step^2 / 12 to the noise's variance.
    restitution : float
        Of eta, before anything is measured.
    restitution_scatter : float
        Of eta from one impact to the next.
    slenderness : float
        Of alpha, as a share of it.
    initial_tilt : float
        Of the rotation at which the block is let go, rad.
    acceleration_noise : float
        Of one sample of the base acceleration, m/s2.
    acceleration_drift : float
        Of what is wrong with it for longer, and of what the model leaves out, m/s2.
    acceleration_share : float
        Of what is wrong with it in proportion, as a share of it.
    """

    rotation_noise: Annotated[float, quantity("rad", above=0.0)] = 1e-3
    rotation_step: Annotated[float, quantity("rad", at_least=0.0)] = 1e-4
    restitution: Annotated[float, quantity(at_least=0.0, at_most=1.0)] = 0.01
    restitution_scatter: Annotated[float, quantity(at_least=0.0, at_most=1.0)] = 0.005
    slenderness: Annotated[float, quantity(at_least=0.0, at_most=0.5)] = 0.005
    initial_tilt: Annotated[float, quantity("rad", at_least=0.0, at_most=1.5)] = math.radians(0.1)
    acceleration_noise: Annotated[float, quantity("m/s2", at_least=0.0)] = 0.05
    acceleration_drift: Annotated[float, quantity("m/s2", at_least=0.0)] = 0.03
    acceleration_share: Annotated[float, quantity(at_least=0.0, at_most=1.0)] = 0.005


class Observer:
    """The estimated state of the block: the solver's, corrected at each sample by the measured rotation.

    Contract: `update` is the only way on, one call a sample; equal calls give equal bits; it makes no array. Without a
    reading (NaN) the state goes on as `twin.rocking.track.TrackedBlock`, to the last bit. The rotation is positive when
    the top leans to +x; the sensor's zero is the caller's.

    Parameters
    ----------
    block : Block
    restitution : float, optional
        None: Housner's.
    initial_rotation : float
        rad, signed; the block is let go at the first sample.
    uncertainty : Uncertainty, optional
    tolerance : float
        As in `simulate`.

    Examples
    --------
    >>> observer = Observer(Block(0.06, 0.27), initial_rotation=0.15)
    >>> for k in range(300):
    ...     rotation = observer.update(1e-3 * k, 0.0)
    >>> rotation < 0.0 < observer.restitution_deviation <= 0.01
    True
    """

    def __init__(
        self,
        block: Block,
        restitution: float | None = None,
        initial_rotation: float = 0.0,
        *,
        uncertainty: Uncertainty | None = None,
        tolerance: float = 1e-10,
    ) -> None:
        unsure = Uncertainty() if uncertainty is None else uncertainty
        eta = block.housner_restitution if restitution is None else restitution
        self.uncertainty = unsure
        self._body = parameters(block, eta, local_tolerance(tolerance))
        self._state = initial_state(self._body, initial_rotation)
        self._p = block.frequency_parameter
        alpha = block.slenderness
        self._prior = np.array([alpha, unsure.slenderness * alpha, eta, unsure.restitution])
        noise = math.hypot(unsure.rotation_noise, unsure.rotation_step / math.sqrt(12.0))
        # An impact teaches where the next flight rises above three deviations of the noise: v^2 = 2 sin(alpha) phi.
        slowest = math.sqrt(6.0 * noise * math.sin(alpha))
        self._settings = np.array(
            [
                noise,
                unsure.acceleration_noise / block.gravity,
                unsure.acceleration_drift / block.gravity,
                unsure.acceleration_share,
                unsure.restitution_scatter,
                unsure.initial_tilt,
                slowest,
            ]
        )
        self._covariance = np.zeros((SIZE, SIZE))
        begin_at(self._covariance, self._prior, self._settings)
        self._memory = np.zeros(MEMORY)
        self._memory[READING] = math.nan
        self._memory[INNOVATION] = self._memory[NORMALISED] = math.nan
        self._memory[SQUARED] = 1.0
        self._piece = np.zeros(7)
        self._events = np.zeros((EVENTS_AT_ONCE, EVENT_COLUMNS))
        self._used = np.zeros(3)
        self._scratch = scratch()
        self._known = np.zeros(KNOWN)
        self._sample = np.zeros(3)
        self._time = math.nan
        self._acceleration = 0.0

    def update(self, time: float, acceleration: float, rotation: float = math.nan) -> float:
        """Take the base acceleration (m/s2) and the rotation (rad) measured at `time` (s); return the estimate, rad.

        The acceleration is taken as linear between samples, across missed ones too. The first sample sets the clock:
        the block is let go at that instant. A sample that is not later than the last is left out.
        """
        sample = self._sample
        sample[0] = 0.0
        if not time <= self._time:
            if not math.isnan(self._time):
                sample[0] = time - self._time
                sample[1] = self._acceleration
                sample[2] = acceleration
                self._observe(rotation)
            self._time = time
            self._acceleration = acceleration
        return float(self._state[SIDE] * self._state[PHI])

    def _observe(self, rotation: float) -> None:
        observe(
            self._body,
            self._state,
            self._piece,
            self._sample,
            rotation,
            self._covariance,
            self._prior,
            self._settings,
            self._memory,
            NOTHING_STEPS,
            self._events,
            self._used,
            *self._scratch,
        )

    @property
    def rotation(self) -> float:
        """Estimated rotation, rad; +-pi/2 once overturned."""
        return signed(self._body, self._state)[0]

    @property
    def angular_velocity(self) -> float:
        """Estimated angular velocity, rad/s; 0 once overturned."""
        return 0.0 if self.overturned else signed(self._body, self._state)[1]

    @property
    def rotation_deviation(self) -> float:
        """Standard deviation of the rotation, rad."""
        return math.sqrt(float(self._covariance[B_PHI, B_PHI]))

    @property
    def angular_velocity_deviation(self) -> float:
        """Standard deviation of the angular velocity, rad/s."""
        return self._p * math.sqrt(float(self._covariance[B_RATE, B_RATE]))

    @property
    def restitution(self) -> float:
        """Ratio of angular velocities over an impact, estimated from the impacts so far."""
        return float(self._body[RESTITUTION])

    @property
    def restitution_deviation(self) -> float:
        """Standard deviation of `restitution`; the stated one until an impact was fast enough to tell."""
        return math.sqrt(float(self._covariance[B_ETA, B_ETA]))

    @property
    def impacts(self) -> int:
        """Impacts so far that were fast enough for the restitution to be told from the sensor's noise."""
        return int(self._memory[TAUGHT])

    @property
    def slenderness(self) -> float:
        """Slenderness angle alpha, rad, estimated from how the block is pulled back between impacts."""
        return float(self._body[ALPHA])

    @property
    def slenderness_deviation(self) -> float:
        """Standard deviation of `slenderness`, rad."""
        return math.sqrt(float(self._covariance[B_ALPHA, B_ALPHA]))

    @property
    def slenderness_observed(self) -> bool:
        """Whether the run so far has said anything of the slenderness: a deviation under 0.7 of the stated one."""
        return self.slenderness_deviation < OBSERVED * float(self._prior[1])

    @property
    def innovation(self) -> float:
        """Last reading less what was predicted for it, rad; NaN without a reading."""
        return float(self._memory[INNOVATION])

    @property
    def normalised_innovation(self) -> float:
        """The same in its own standard deviations (at rest, from the mean of the readings): beyond 5, not believed."""
        return float(self._memory[NORMALISED])

    @property
    def consistent(self) -> bool:
        """Whether the readings of late are such as the estimate and its uncertainty let one expect."""
        return float(self._memory[SQUARED]) < INCONSISTENT and float(self._memory[REJECTED]) < MOST_REJECTED

    @property
    def corrected(self) -> bool:
        """Whether the last sample had a reading that was believed."""
        return bool(self._memory[BELIEVED] != 0.0)

    @property
    def time(self) -> float:
        """Time of the last sample, s; NaN before the first."""
        return self._time

    @property
    def resting(self) -> bool:
        """Whether the block is estimated to stand still, or lies."""
        return bool(self._state[SIDE] == 0.0) or self.overturned

    @property
    def overturned(self) -> bool:
        """Whether the estimate has reached pi/2."""
        return bool(self._state[PHI] >= HALF_TURN)

    def estimate(self) -> FloatArray:
        """Return what a forecast starts from, shape (KNOWN,), filled anew; see `twin.forecast.ensemble`."""
        known = self._known
        known[KNOWN_SIDE] = self._state[SIDE]
        known[KNOWN_PHI] = self._state[PHI]
        known[KNOWN_RATE] = self._state[RATE]
        known[KNOWN_ALPHA] = self._body[ALPHA]
        known[KNOWN_RESTITUTION] = self._body[RESTITUTION]
        return known

    @property
    def sample(self) -> FloatArray:
        """Length of the last sample, s (0 where it was left out), and the accelerations at its ends; the own array."""
        return self._sample

    @property
    def covariance(self) -> FloatArray:
        """Covariance of |theta| (rad), d|theta|/d(p t), alpha (rad) and eta, shape (4, 4); the observer's own array."""
        return self._covariance
