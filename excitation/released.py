"""Machines that are set by hand and released: they make their own run, and cannot be told a position."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from dataclasses import KW_ONLY, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, ClassVar, Protocol, Self, cast

from pydantic import BaseModel, Field, model_validator

from excitation.extremes import extremes
from excitation.pieces import Array, PieceTable, Span, assemble, steady
from excitation.pulse import Pulse
from excitation.quantity import VALUE, checked, quantity, refusal
from excitation.shaper import EndStop, slide
from excitation.table_run import Course, Phase, TableRun

if TYPE_CHECKING:
    from excitation.capacity import Capacity
    from excitation.limits import Limit


class Settings(Protocol):
    """What an operator sets before the machine is released."""

    @property
    def pulse(self) -> Pulse:
        """The pulse the machine makes when it is set so: near the asked one, for weights come in pieces."""
        ...

    @property
    def sentence(self) -> str:
        """What to set, in words and numbers."""
        ...

    @property
    def numbers(self) -> dict[str, float]:
        """What to set, by names that end in their SI units."""
        ...


class ReleasedMachine(BaseModel, ABC):
    """How a machine that is set by hand makes a run. A push, a slide with friction, an end stop, a slide back.

    A subclass says what it is set to for a pulse (`settings_for`, `refusals`), how it pushes (`push`,
    `slide_distance`), and what a stop can do (`stopping`).

    Attributes
    ----------
    friction : float
        Deceleration by friction while the base slides or coasts, m/s2 (Coulomb's: the same at every speed).
    end_stop : EndStop
        What the base runs into.
    provenance : mapping
        Key in the file -> where its number comes from.
    """

    model_config = {**VALUE, "frozen": True}

    friction: Annotated[float, quantity("m/s2", above=0.0)] = Field(validation_alias="friction_m_s2")
    end_stop: EndStop
    provenance: dict[str, str] = {}

    slide_name: ClassVar[str] = "slide"
    """What the phase between push and end stop is called."""
    stop_name: ClassVar[str] = "end stop"
    """What the end stop, and the phase in it, is called."""
    can_stop: ClassVar[bool] = True
    """Whether a stop does anything once it is released."""
    coasts: ClassVar[bool] = False
    """Whether the time between push and end stop can be asked for."""
    stoppable: ClassVar[bool] = False
    """Whether anything brakes the base once it is released; see `broken_off`."""

    @model_validator(mode="after")
    def _provenance_names_fields(self) -> Self:
        fields = type(self).model_fields
        known = {str(field.validation_alias or name) for name, field in fields.items()} - {"provenance"}
        unknown = sorted(set(self.provenance) - known)
        if unknown:
            raise refusal(f"provenance names {unknown[0]!r}, which is no number of the machine")
        return self

    @property
    def described(self) -> dict[str, tuple[str, str]]:
        """Key in the file -> value in words, and where it comes from."""
        found: dict[str, tuple[str, str]] = {}
        for name, field in type(self).model_fields.items():
            key = str(field.validation_alias or name)
            if name != "provenance":
                value = getattr(self, name)
                several = cast("tuple[object, ...]", value) if isinstance(value, tuple) else (value,)
                words = ", ".join(map(str, several))
                found[key] = (f"{key} {words}", self.provenance.get(key, "no source given"))
        return found

    @property
    @abstractmethod
    def stopping(self) -> str:
        """What a stop can do once the machine is released, as a clause."""

    @abstractmethod
    def refusals(self, pulse: Pulse, name: str, payload: float | None = None) -> list[Limit]:
        """Return what of `pulse` cannot be set on the machine called `name`; what needs `payload`, kg, only with it."""

    @abstractmethod
    def settings_for(self, pulse: Pulse, capacity: Capacity, *, payload: float | None, coast: float) -> Settings:
        """Return what to set for `pulse`, which `excitation.clip` has found to fit, to coast for `coast` s after it.

        Raises
        ------
        ValueError
            Where it cannot be set; one sentence.
        """

    @abstractmethod
    def push(self, pulse: Pulse) -> list[Span]:
        """Return the spans in which the base is pushed from rest to the pulse's velocity."""

    @abstractmethod
    def slide_distance(self, pulse: Pulse, coast: float) -> float:
        """Return the distance from the end of the push to the end stop, m, at least 0; `coast`, s, if it can be set."""

    def impossible(self, pulse: Pulse) -> str | None:  # noqa: ARG002 - most pulses can be made
        """Return why there is no run of `pulse` at all, whatever the limits; None where there is."""
        return None

    def in_gravity(self, gravity: float) -> Self:  # noqa: ARG002 - most machines do not ask
        """Return the machine as it stands where gravity is `gravity`, m/s2."""
        return self

    def moving_mass(self, payload: float | None) -> float | None:  # noqa: ARG002 - most machines do not say
        """Return what moves with `payload`, kg, on it; kg, None where it is not known."""
        return None

    def broken_off(
        self,
        settings: Settings,  # noqa: ARG002 - most machines cannot be stopped
        leg: str,  # noqa: ARG002
        position: float,  # noqa: ARG002
        velocity: float,  # noqa: ARG002
        *,
        payload: float,  # noqa: ARG002
    ) -> list[Span] | None:
        """Return the spans to rest of a base that is stopped in `leg`, at `position`, m, with `velocity`, m/s.

        None where it goes on as it would have.
        """
        return None

    def longest_stop(self, velocity: float, stroke: float) -> float:
        """Return the time, s, in which a base comes to rest once nothing is done to it, by friction and its end stop.

        `velocity`, m/s, and `stroke`, m, are the most there is of each: a slide to rest takes v / f, and over the way x
        no longer than sqrt(2 x / f).
        """
        return 2.0 * longest_slide(velocity, stroke, self.friction) + self.end_stop.duration

    def legs(self, pulse: Pulse, coast: float = 0.0) -> list[tuple[str, list[Span]]]:
        """Return the parts of the run from release to rest, by name; those that do not happen are left out."""
        push = self.push(pulse)
        velocity = PieceTable(assemble(push)).end[1]
        sense, speed = (1.0 if velocity >= 0.0 else -1.0), abs(velocity)
        legs = [("pulse", push)]
        if speed == 0.0:
            return legs
        duration, speed = slide(speed, self.friction, self.slide_distance(pulse, coast))
        if duration > 0.0:
            legs.append((self.slide_name, [steady(duration, -sense * self.friction)]))
        if speed > 0.0:
            legs.append((self.stop_name, self.end_stop.stop(sense * speed)))
            if (back := self.end_stop.rebound * speed) > 0.0:
                legs.append((f"{self.slide_name} back", [steady(back / self.friction, sense * self.friction)]))
        return legs

    def reach(self, pulse: Pulse, coast: float = 0.0) -> tuple[float, float, float]:
        """Return the least, the greatest and the last displacement of the run of `pulse`, m."""
        table = PieceTable(assemble(span for _, spans in self.legs(pulse, coast) for span in spans))
        return *extremes(table).displacement, table.end[2]


def longest_slide(velocity: float, distance: float, friction: float) -> float:
    """Return the longest time, s, that a slide from at most `velocity` over at most `distance` takes."""
    return min(velocity / friction, math.sqrt(2.0 * distance / friction))


@dataclass(frozen=True)
class ReleasedRun(TableRun):
    """A run of a released machine: wait, pulse, coast or slide, end stop, slide back, rest; absent parts are left out.

    Displacement is counted from where the base is held before its release. Rounding left by the parts is taken out
    while the base rests.

    Parameters
    ----------
    machine : ReleasedMachine
    pulse : Pulse
        What the machine makes (`Settings.pulse`).
    wait : float
        Time before the release, s, at least 0.01.
    coast : float
        Time between the end of the pulse and the end stop, s, at least 0, on a machine where it can be set.
    rest : float
        Time at the end, s, at least 0.01.

    Raises
    ------
    ValueError
        One sentence: a value out of its bounds, or a pulse of which there is no run.
    """

    machine: ReleasedMachine
    # Of a frozen dataclass: nobody can put None there.
    pulse: Pulse  # pyright: ignore[reportIncompatibleVariableOverride]
    _: KW_ONLY
    wait: float = 1.0
    coast: float = 0.0
    rest: float = 1.0

    def __post_init__(self) -> None:
        checked("wait", self.wait, "s", at_least=0.01)
        checked("coast", self.coast, "s", at_least=0.0)
        checked("rest", self.rest, "s", at_least=0.01)
        if (reason := self.machine.impossible(self.pulse)) is not None:
            raise ValueError(reason)

    @property
    def phases(self) -> tuple[Phase, ...]:
        """The parts of the run in order, from 0 to `duration`."""
        return tuple(self._course.phases)

    @property
    def shaking_end(self) -> float:
        """Time at which the base has come to rest, s."""
        return self.phases[-1].start

    @property
    def end_stop_position(self) -> float:
        """Displacement at which the base meets the end stop, m."""
        push = PieceTable(assemble(self.machine.push(self.pulse))).end
        sense = 1.0 if push[1] >= 0.0 else -1.0
        return push[2] + sense * self.machine.slide_distance(self.pulse, self.coast)

    def scaled(self, factor: float) -> ReleasedRun:
        """Return the run of the scaled pulse."""
        return ReleasedRun(self.machine, self.pulse.scaled(factor), wait=self.wait, coast=self.coast, rest=self.rest)

    @cached_property
    def _course(self) -> Course:
        course = Course()
        course.pause("wait", self.wait)
        for name, spans in self.machine.legs(self.pulse, self.coast):
            course.add(name, *spans)
        course.pause("rest", self.rest)
        return course

    def _rows(self) -> Array:
        return assemble(self._course.spans)
