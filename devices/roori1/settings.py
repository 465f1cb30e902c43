"""What can be set on ROORI1, and what to set for an asked double pulse: the launch and the stop gap.

A projectile strikes the base through a pulse shaper: the base gains its peak velocity v in the shaper's time T1, in
which it moves v T1 / 2. It slides on with friction f to the stopper, which it meets at x = gap with

    v1^2 = v^2 - 2 f (gap - v T1 / 2)

and leaves, through a second shaper, with -e v1. Pulse shapes, their times, e and f are not published: assumptions.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, ClassVar

from pydantic import Field

from excitation import DoublePulse, Limit, Ramped, Saturated
from excitation.quantity import quantity
from excitation.released import ReleasedMachine
from excitation.search import ROUNDING
from excitation.shaper import PulseShaper, slide

if TYPE_CHECKING:
    from excitation import Capacity, Pulse
    from excitation.pieces import Span


@dataclass(frozen=True, slots=True)
class Roori1Settings:
    """What the operator sets.

    Attributes
    ----------
    velocity : float
        Peak velocity of the base the launcher is set for, m/s.
    gap : float
        Stop gap, m.
    pulse : DoublePulse
        The same as a pulse; its shape is the machine's (`Roori1Machine`).
    """

    velocity: float
    gap: float
    pulse: DoublePulse

    @property
    def sentence(self) -> str:
        """What to set, in words and numbers."""
        return f"launch for {self.velocity:.4g} m/s of the base; stop gap {self.gap * 1e3:.4g} mm"

    @property
    def numbers(self) -> dict[str, float]:
        """The same by name, in SI units."""
        return {"peak_velocity_m_s": self.velocity, "stop_gap_m": self.gap}


class Roori1Machine(ReleasedMachine):
    """ROORI-1 of Oxford.

    Attributes
    ----------
    striker : PulseShaper
        Between projectile and base.
    least_velocity : float
        m/s; the greatest is the capacity's.
    least_gap, largest_gap : float
        m.
    """

    striker: PulseShaper
    least_velocity: Annotated[float, quantity("m/s", above=0.0)] = Field(validation_alias="least_velocity_m_s")
    least_gap: Annotated[float, quantity("m", above=0.0)] = Field(validation_alias="least_gap_m")
    largest_gap: Annotated[float, quantity("m", above=0.0)] = Field(validation_alias="largest_gap_m")

    can_stop: ClassVar[bool] = False
    stop_name: ClassVar[str] = "stopper"

    @property
    def stopping(self) -> str:
        """What a stop can do once the machine has fired."""
        return "nothing can stop the base once it is fired: it runs into its stopper, and standstill is waited for"

    def refusals(self, pulse: Pulse, name: str, payload: float | None = None) -> list[Limit]:  # noqa: ARG002
        """Return what of `pulse` is outside the ranges of velocity and gap, or does not get to the stopper."""
        if not isinstance(pulse, DoublePulse):
            return [Limit("kind", None, None, "", f"{name} has two settings, which make no {pulse.kind}")]
        found: list[Limit] = []
        velocity, gap = pulse.peak_velocity, pulse.stop_gap
        if velocity < self.least_velocity * (1.0 - ROUNDING):
            sentence = f"{pulse.kind} asks {velocity:.4g} m/s; {name} makes {self.least_velocity:.4g} m/s at least"
            found.append(Limit("velocity", velocity, self.least_velocity, "m/s", sentence))
        for limit, beyond, bound in (
            (self.least_gap, gap < self.least_gap * (1.0 - ROUNDING), "at least"),
            (self.largest_gap, gap > self.largest_gap * (1.0 + ROUNDING), "at most"),
        ):
            if beyond:
                sentence = f"{pulse.kind} asks a stop gap of {gap:.4g} m; {name} has {limit:.4g} m {bound}"
                found.append(Limit("gap", gap, limit, "m", sentence))
        if not found and (reason := self.impossible(pulse)) is not None:
            found.append(Limit("gap", gap, None, "m", f"{name}: {reason}"))
        return found

    def impossible(self, pulse: Pulse) -> str | None:
        """Return why the base does not meet its stopper as a double pulse wants it to."""
        velocity, gap = _numbers(pulse)
        run_up = self.striker.travel(0.0, velocity)
        if run_up > gap:
            return f"the base travels {run_up:.4g} m while it is struck; the stop gap is {gap:.4g} m"
        duration, after = slide(velocity, self.friction, gap - run_up)
        if after == 0.0:
            way = run_up + 0.5 * velocity * duration
            return f"friction stops the base after {way:.4g} m; the stop gap is {gap:.4g} m"
        return None

    def settings_for(
        self,
        pulse: Pulse,
        capacity: Capacity,
        *,
        payload: float | None,  # noqa: ARG002 - the launcher is set for the base as it is loaded
        coast: float,  # noqa: ARG002 - the gap decides
    ) -> Roori1Settings:
        """Return velocity and gap for `pulse`.

        Raises
        ------
        ValueError
            Where the pulse is outside the machine's ranges.
        """
        if (refused := self.refusals(pulse, capacity.name)) or not isinstance(pulse, DoublePulse):
            raise ValueError(refused[0].sentence)
        return Roori1Settings(pulse.peak_velocity, pulse.stop_gap, pulse)

    def push(self, pulse: Pulse) -> list[Span]:
        """Return the blow of the projectile."""
        return self.striker.change(_numbers(pulse)[0])

    def slide_distance(self, pulse: Pulse, coast: float) -> float:  # noqa: ARG002 - the gap decides
        """Return what is left of the stop gap after the blow, m."""
        velocity, gap = _numbers(pulse)
        return max(gap - self.striker.travel(0.0, velocity), 0.0)


def _numbers(pulse: Pulse) -> tuple[float, float]:
    """Return peak velocity, m/s, and stop gap, m, of a double pulse, whatever was done to its waveform."""
    while isinstance(pulse, (Ramped, Saturated)):
        pulse = pulse.pulse
    return pulse.peak_velocity, pulse.stop_gap if isinstance(pulse, DoublePulse) else pulse.travel
