"""What can be set on an air track, and what to set for an asked constant pulse: hanging mass, drop, start point.

While the mass mh falls it draws the cart M, block included, against its friction f (a deceleration):

    (M + mh) a0 = mh g - M f,    d = a0 ta^2 / 2

so that the mass gives a0 and the height d above its landing gives ta. The cart then coasts to the bumper, whose
distance from the start point gives the time in between.
"""

from __future__ import annotations

import itertools
import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, Self, cast

from pydantic import BeforeValidator, Field

from excitation import ConstantPulse, Limit
from excitation.demand import Terms
from excitation.pieces import Span, as_spans, steady
from excitation.quantity import quantity
from excitation.released import ReleasedMachine, ReleasedRun, Settings, longest_slide
from excitation.search import ROUNDING
from excitation.shaper import slide

if TYPE_CHECKING:
    from excitation import Capacity, Pulse

_MOST_WEIGHTS = 12
"""All their sums are looked through: 4095 of them."""


def _as_tuple(given: object) -> object:
    """Take a list as well: TOML has no tuples."""
    return tuple(cast("list[object]", given)) if isinstance(given, list) else given


@dataclass(frozen=True, slots=True)
class AirTrackSettings:
    """What the operator sets.

    Attributes
    ----------
    mass : float
        Hanging mass, kg.
    drop : float
        Height from which it falls until it lands, m.
    start : float
        Distance from the cart's start point to the bumper, m.
    pulse : ConstantPulse
        What the cart then makes.
    """

    mass: float
    drop: float
    start: float
    pulse: ConstantPulse

    @property
    def sentence(self) -> str:
        """What to set, in words and numbers."""
        return (
            f"hang {self.mass:.3f} kg, {self.drop * 1e3:.1f} mm above its landing; "
            f"hold the cart {self.start * 1e3:.1f} mm before the bumper"
        )

    @property
    def numbers(self) -> dict[str, float]:
        """The same by name, in SI units."""
        return {"hanging_mass_kg": self.mass, "drop_m": self.drop, "start_before_bumper_m": self.start}


class AirTrackMachine(ReleasedMachine):
    """An air track with its weights.

    Attributes
    ----------
    cart : float
        Mass of the cart without the block, kg. The block's reaction on it is neglected: it should be heavy beside it.
    weights : tuple of float
        kg; any of them hang together.
    largest_drop : float
        m.
    drop_step : float
        To which the drop can be set, m.
    braking_friction : float
        Deceleration of the cart with the air supply off, m/s2.
    gravity : float
        m/s2.
    """

    cart: Annotated[float, quantity("kg", above=0.0)] = Field(validation_alias="cart_kg")
    weights: Annotated[
        tuple[Annotated[float, quantity("kg", above=0.0)], ...],
        Field(min_length=1, max_length=_MOST_WEIGHTS, validation_alias="weights_kg"),
        BeforeValidator(_as_tuple),
    ]
    largest_drop: Annotated[float, quantity("m", above=0.0)] = Field(validation_alias="largest_drop_m")
    drop_step: Annotated[float, quantity("m", above=0.0)] = Field(validation_alias="drop_step_m")
    braking_friction: Annotated[float, quantity("m/s2", above=0.0)] = Field(validation_alias="braking_friction_m_s2")
    gravity: Annotated[float, quantity("m/s2", above=0.0)] = Field(9.81, validation_alias="gravity_m_s2")

    slide_name: ClassVar[str] = "coast"
    stop_name: ClassVar[str] = "bumper"
    coasts: ClassVar[bool] = True
    stoppable: ClassVar[bool] = True

    @property
    def stopping(self) -> str:
        """What a stop can do once the cart is released."""
        return f"the air supply is cut: friction brakes the cart with {self.braking_friction:.3g} m/s2"

    @cached_property
    def masses(self) -> tuple[float, ...]:
        """Every mass that can hang, kg, ascending."""
        sums = (
            math.fsum(chosen)
            for count in range(1, len(self.weights) + 1)
            for chosen in itertools.combinations(self.weights, count)
        )
        return tuple(sorted({round(total, 9) for total in sums}))

    def in_gravity(self, gravity: float) -> Self:
        """Return the track as it stands where gravity is `gravity`, m/s2."""
        return self.model_copy(update={"gravity": gravity})

    def moving_mass(self, payload: float | None) -> float | None:
        """Return cart and block, kg."""
        return self.cart + (payload or 0.0)

    def broken_off(
        self, settings: Settings, leg: str, position: float, velocity: float, *, payload: float
    ) -> list[Span] | None:
        """Return the cart's way to rest with the air supply off; in the bumper nothing changes.

        While the mass still falls it draws the cart on.
        """
        if not isinstance(settings, AirTrackSettings) or leg not in ("pulse", self.slide_name):
            return None
        spans: list[Span] = []
        x, v, f = position, velocity, self.braking_friction
        if leg == "pulse" and (fall := settings.drop - x) > 0.0:
            moved = self.cart + payload
            a = (settings.mass * self.gravity - moved * f) / (moved + settings.mass)
            after = math.sqrt(max(0.0, v * v + 2.0 * a * fall))
            # v^2 + 2 a x = 0 where it stops before the mass has landed.
            spans.append(steady(2.0 * fall / (v + after) if after > 0.0 else v / -a, a))
            x, v = x + fall if after > 0.0 else x + 0.5 * v * v / -a, after
        duration, after = slide(v, f, max(settings.start - x, 0.0))
        spans.append(steady(duration, -f))
        if after > 0.0:
            spans += self.end_stop.stop(after)
            back = self.end_stop.rebound * after
            spans.append(steady(back / f, f))
        return [span for span in spans if span[0] > 0.0]

    def longest_stop(self, velocity: float, stroke: float) -> float:
        """Return the time, s, in which a coasting cart comes to rest with the air supply off.

        While the mass still falls it is drawn on, and that is not in it.
        """
        return 2.0 * longest_slide(velocity, stroke, self.braking_friction) + self.end_stop.duration

    def acceleration(self, mass: float, payload: float) -> float:
        """Return a0, m/s2, that `mass` gives the cart with `payload` on it, kg; not above 0 where friction holds it."""
        moved = self.cart + payload
        return (mass * self.gravity - moved * self.friction) / (moved + mass)

    def refusals(self, pulse: Pulse, name: str, payload: float | None = None) -> list[Limit]:
        """Return what of `pulse` no mass or drop there is can give."""
        found: list[Limit] = []
        peak = pulse.peak_acceleration
        drop = pulse.travel
        if drop > self.largest_drop * (1.0 + ROUNDING):
            sentence = f"{pulse.kind} asks a drop of {drop:.4g} m; {name} has {self.largest_drop:.4g} m"
            found.append(Limit("drop", drop, self.largest_drop, "m", sentence))
        elif drop < 0.5 * self.drop_step:
            sentence = f"{pulse.kind} asks a drop of {drop:.2g} m; {name} sets it in steps of {self.drop_step:.2g} m"
            found.append(Limit("drop", drop, self.drop_step, "m", sentence))
        if payload is not None:
            lightest, heaviest = (self.acceleration(mass, payload) for mass in (self.masses[0], self.masses[-1]))
            moved = f"draw {self.cart + payload:.4g} kg of cart and block with"
            if peak > heaviest * (1.0 + ROUNDING):
                sentence = (
                    f"{pulse.kind} asks {peak:.4g} m/s2; {name}'s weights, {self.masses[-1]:.4g} kg in all, "
                    f"{moved} {heaviest:.4g} m/s2"
                )
                found.append(Limit("acceleration", peak, heaviest, "m/s2", sentence))
            elif peak < lightest * (1.0 - ROUNDING):
                sentence = (
                    f"{pulse.kind} asks {peak:.4g} m/s2; {name}'s lightest weight, {self.masses[0]:.4g} kg, would "
                    f"{moved} {lightest:.4g} m/s2"
                )
                found.append(Limit("acceleration", peak, lightest, "m/s2", sentence))
        return found

    def settings_for(
        self, pulse: Pulse, capacity: Capacity, *, payload: float | None, coast: float
    ) -> AirTrackSettings:
        """Return mass, drop and start point for `pulse`, the nearest there are that stay within the capacity.

        Parameters
        ----------
        pulse : ConstantPulse
            Asked a0 and ta.
        capacity : Capacity
            The track's.
        payload : float
            Mass of the block, kg.
        coast : float
            Time between the landing of the mass and the bumper, s.

        Raises
        ------
        ValueError
            Where the mass of the block is not known, or no mass or drop there is gives the pulse.
        """
        if payload is None:
            raise ValueError(f"{capacity.name} draws the block along: its mass must be given")
        if (refused := self.refusals(pulse, capacity.name, payload)) or not isinstance(pulse, ConstantPulse):
            raise ValueError(refused[0].sentence if refused else f"{capacity.name} cannot be set to a {pulse.kind}")
        terms = Terms(capacity, coast=coast, payload=payload)
        for mass in sorted(self.masses, key=lambda mass: abs(self.acceleration(mass, payload) - pulse.amplitude)):
            for drop in self._drops(self.acceleration(mass, payload), pulse.duration):
                made = ConstantPulse(self.acceleration(mass, payload), self._fall_time(drop, mass, payload))
                if max(terms.usage(made).values()) <= 1.0 + ROUNDING:
                    start = ReleasedRun(self, made, coast=coast).end_stop_position
                    return AirTrackSettings(mass, drop, start, made)
        raise ValueError(f"{capacity.name} has no mass and drop near {pulse.kind}'s that stay within its capacity")

    def push(self, pulse: Pulse) -> list[Span]:
        """Return the pulse itself: friction is in its acceleration already."""
        return as_spans(pulse.pieces)

    def slide_distance(self, pulse: Pulse, coast: float) -> float:
        """Return the distance coasted in `coast` s, m, or until friction has stopped the cart."""
        speed = abs(pulse.final_velocity)
        time = min(coast, speed / self.friction)
        return time * (speed - 0.5 * self.friction * time)

    def _drops(self, acceleration: float, duration: float) -> list[float]:
        """Return the settable drops nearest to a fall of `duration`, s, the nearest first; m."""
        if acceleration <= 0.0:
            return []
        steps = 0.5 * acceleration * duration**2 / self.drop_step
        most = math.floor(self.largest_drop / self.drop_step * (1.0 + ROUNDING))
        whole = {min(max(count, 1), most) for count in (round(steps), math.floor(steps))}
        return [count * self.drop_step for count in sorted(whole, key=lambda count: abs(count - steps)) if count > 0]

    def _fall_time(self, drop: float, mass: float, payload: float) -> float:
        return math.sqrt(2.0 * drop / self.acceleration(mass, payload))
