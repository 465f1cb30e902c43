"""The ST-III's moving mass: driven by its position loop, held back by what every real drive cannot do.

    (M0 + m) x'' = F_drive + F_bumper
    F_drive = M0 (w0^2 (r - x) - 2 zeta0 w0 x'), as far as the peak current allows; nothing in a direction in which the
    table is at its top speed or in which the limit switch cut it; friction alone without power

Whatever holds, the equation is linear: x'' = A + B t - K x - C x'. While nothing saturates, a step is the matrix
exponential and exact. Otherwise it is made of sub-steps, each a Taylor series of order `ORDER` over no more than
`SUBSTEP` s, and the instant at which one regime ends is bisected to `WITHIN` s, on the far side of it.

Error, per step: the remainder of the series, below 1e-15 of the state; and at each change of regime the change of
acceleration times `WITHIN` in velocity, 1e-10 m/s for 1000 m/s2. A regime entered and left in one sub-step is passed
over; it was exceeded by no more than SUBSTEP^2 / 8 times the second derivative of what exceeded it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Final, NamedTuple

from devices.quanser_st3.loop import LinearStep

if TYPE_CHECKING:
    from devices.quanser_st3.parameters import St3Parameters

ORDER: Final = 12
SUBSTEP: Final = 125e-6
WITHIN: Final = 1e-13
# In one step; whatever happens, a step ends.
_MOST_SPANS: Final = 1000


class Span(NamedTuple):
    """A stretch of time, s, with the table's acceleration at its start and end, m/s2."""

    duration: float
    start: float
    end: float


class _Regime(NamedTuple):
    """Which force acts: the drive's and the bumper's."""

    drive: str
    bumper: int


class Mechanics:
    """Position and velocity of the table, advanced while its set-point goes linearly from one value to another.

    Parameters
    ----------
    parameters : St3Parameters
    payload : float
        kg.
    half_stroke : float
        Of the capacity, m: where switches and bumpers are counted from.
    position : float
        Where it rests, m.

    Attributes
    ----------
    position, velocity, acceleration : float
        m, m/s, m/s2; true, now.
    setpoint : float
        That the loop sees now, m.
    powered : bool
        Whether the drive pushes; without power friction alone brakes the table.
    """

    def __init__(self, parameters: St3Parameters, payload: float, half_stroke: float, position: float) -> None:
        mass = parameters.moving_mass + payload
        self._loop = loop = parameters.loop(payload)
        w, zeta = loop.angular_frequency, loop.damping
        self._k, self._c, self._w, self._lag = w * w, 2.0 * zeta * w, w, 2.0 * zeta / w
        self._most = parameters.largest_acceleration(payload)
        self._top_speed = parameters.top_speed
        self._switch = half_stroke + parameters.switch_distance
        self._bumper = half_stroke + parameters.bumper_distance
        self._bumper_k, self._bumper_c = parameters.bumper_stiffness / mass, parameters.bumper_damping / mass
        self._friction = parameters.friction / mass
        # |x''| <= s w sqrt(1 + 4 zeta^2) with s of `_stays_linear`.
        self._calm = self._most / (w * math.sqrt(1.0 + 4.0 * zeta * zeta))
        fastest = max(w, self._c, math.sqrt(self._k + self._bumper_k), self._c + self._bumper_c)
        self._substep = min(SUBSTEP, 0.25 / fastest)
        self.position = self.setpoint = position
        self.velocity = self.acceleration = 0.0
        self.powered = True

    def linear_step(self, duration: float) -> LinearStep:
        """Return the exact step of `duration`, s, to be given to `advance`."""
        return LinearStep(self._loop, duration)

    def advance(self, step: LinearStep, setpoint: float) -> list[Span]:
        """Live through `step` while the set-point goes to `setpoint`, m; return the accelerations on the way."""
        start, self.setpoint = self.setpoint, setpoint
        if not self._stays_linear(step.duration, start, setpoint):
            return self._advance_in_regimes(step.duration, start, (setpoint - start) / step.duration)
        before = self._asked(start, self.position, self.velocity)
        self.position, self.velocity = step.advance(self.position, self.velocity, start, setpoint)
        self.acceleration = self._asked(setpoint, self.position, self.velocity)
        return [Span(step.duration, before, self.acceleration)]

    def _asked(self, setpoint: float, position: float, velocity: float) -> float:
        return self._k * (setpoint - position) - self._c * velocity

    def _stays_linear(self, duration: float, start: float, end: float) -> bool:
        """Tell whether nothing can saturate before the set-point is at `end`.

        With y the distance from r - (2 zeta / w) r', the motion about a set-point of constant speed is
        y'' + 2 zeta w y' + w^2 y = 0, so that s^2 = w^2 y^2 + y'^2 never grows: |y| <= s / w, |y'| <= s and, by Cauchy
        and Schwarz, |x''| <= s w sqrt(1 + 4 zeta^2).
        """
        if not self.powered:
            return False
        rate = (end - start) / duration
        y = self.position - start + self._lag * rate
        s = math.hypot(self._w * y, self.velocity - rate)
        reach = max(abs(start), abs(end)) + self._lag * abs(rate) + s / self._w
        return s < self._calm and abs(rate) + s < self._top_speed and reach < self._switch

    def _advance_in_regimes(self, duration: float, setpoint: float, rate: float) -> list[Span]:
        if not self.powered and self.velocity == 0.0 and abs(self.position) < self._bumper:
            self.acceleration = 0.0
            return [Span(duration, 0.0, 0.0)]
        spans: list[Span] = []
        gone = 0.0
        while (left := duration - gone) > WITHIN:
            here = setpoint + rate * gone
            regime = self._regime(here, self.position, self.velocity)
            x = self._series(regime, here, rate)
            length = min(left, self._substep)
            if len(spans) < _MOST_SPANS:
                length = self._end_of(regime, x, here, rate, length)
            velocity = _derivative(x, length)
            self.position = _value(x, length)
            # Without power the table stays where it comes to rest, unless a bumper pushes it off.
            self.velocity = 0.0 if not self.powered and velocity * self.velocity < 0.0 else velocity
            spans.append(Span(length, 2.0 * x[2], _second_derivative(x, length)))
            gone += length
        regime = self._regime(self.setpoint, self.position, self.velocity)
        self.acceleration = 2.0 * self._series(regime, self.setpoint, rate)[2]
        return spans

    def _regime(self, setpoint: float, x: float, v: float) -> _Regime:
        side = 1 if x >= self._bumper else -1 if x <= -self._bumper else 0
        push = self._bumper_k * (abs(x) - self._bumper) + self._bumper_c * side * v
        bumper = side if side and push > 0.0 else 0
        if not self.powered:
            free = -bumper * push if bumper else 0.0
            moving = v if v != 0.0 else free if abs(free) > self._friction else 0.0
            return _Regime("rest" if moving == 0.0 else "slides +" if moving > 0.0 else "slides -", bumper)
        asked = self._asked(setpoint, x, v)
        way = 1.0 if asked > 0.0 else -1.0
        if way * v >= self._top_speed or way * x >= self._switch:
            return _Regime("cut", bumper)
        drive = "loop" if abs(asked) <= self._most else "most +" if asked > 0.0 else "most -"
        return _Regime(drive, bumper)

    def _series(self, regime: _Regime, setpoint: float, rate: float) -> list[float]:
        """Return the Taylor coefficients of the position from here on: x'' = a + b t - k x - c x'."""
        x, v = self.position, self.velocity
        if regime.drive == "rest":
            return [x, 0.0] + [0.0] * (ORDER - 1)
        k = c = b = 0.0
        a = {"most +": self._most, "most -": -self._most, "slides +": -self._friction, "slides -": self._friction}.get(
            regime.drive, 0.0
        )
        if regime.drive == "loop":
            k, c = self._k, self._c
            a, b = k * (setpoint - x), k * rate
        if regime.bumper:
            k, c = k + self._bumper_k, c + self._bumper_c
            a -= self._bumper_k * (x - regime.bumper * self._bumper)
        # About x, so that a table at rest stays there.
        series = [0.0, v]
        for n in range(ORDER - 1):
            force = (a if n == 0 else b if n == 1 else 0.0) - k * series[n] - c * (n + 1) * series[n + 1]
            series.append(force / ((n + 1) * (n + 2)))
        series[0] = x
        return series

    def _end_of(self, regime: _Regime, x: list[float], setpoint: float, rate: float, longest: float) -> float:
        """Return how long `regime` lasts, s: `longest`, or until just after it changed."""

        def holds(t: float) -> bool:
            v = _derivative(x, t)
            if not self.powered and v * self.velocity < 0.0:
                return False
            return self._regime(setpoint + rate * t, _value(x, t), v) == regime

        if holds(longest):
            return longest
        low, high = 0.0, longest
        while high - low > WITHIN:
            middle = 0.5 * (low + high)
            if holds(middle):
                low = middle
            else:
                high = middle
        return high


def _value(series: list[float], t: float) -> float:
    total = 0.0
    for coefficient in reversed(series):
        total = total * t + coefficient
    return total


def _derivative(series: list[float], t: float) -> float:
    total = 0.0
    for n in range(len(series) - 1, 0, -1):
        total = total * t + n * series[n]
    return total


def _second_derivative(series: list[float], t: float) -> float:
    total = 0.0
    for n in range(len(series) - 1, 1, -1):
        total = total * t + n * (n - 1) * series[n]
    return total
