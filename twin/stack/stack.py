"""The stack: rigid blocks on each other, centred, from the base up."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Annotated, Any, cast

from pydantic import Field, field_validator, model_validator
from pydantic.dataclasses import dataclass as value

from excitation.quantity import VALUE, refusal
from twin.rocking.block import Block

MOST_BLOCKS = 8


@dataclass(frozen=True, slots=True)
class Part:
    """The blocks from one interface up, taken as one rigid body that stands on that interface.

    Attributes
    ----------
    mass : float
        kg, or relative to the others where the blocks tell no mass.
    half_width : float
        Half the width of the contact, m.
    centre : float
        Height of the centre of mass above the interface, m.
    inertia : float
        Moment of inertia about a corner of the contact, kg m2.
    gravity : float
        m/s2.
    """

    mass: float
    half_width: float
    centre: float
    inertia: float
    gravity: float

    @property
    def uplift_acceleration(self) -> float:
        """g c / z: base acceleration above which the part, on a resting stack, begins to rock, m/s2."""
        return self.gravity * self.half_width / self.centre

    @property
    def slenderness(self) -> float:
        """Rotation at which the part, on a resting stack, balances on a corner, rad."""
        return math.atan2(self.half_width, self.centre)

    @property
    def frequency_parameter(self) -> float:
        """sqrt(m g R / I), rad/s."""
        return math.sqrt(self.mass * self.gravity * math.hypot(self.half_width, self.centre) / self.inertia)

    @property
    def barrier(self) -> float:
        """Energy that lifts the centre of mass over a corner, J."""
        return self.mass * self.gravity * (math.hypot(self.half_width, self.centre) - self.centre)


@value(frozen=True, config=VALUE)
class Stack:
    """Blocks standing on each other, their middles above one another.

    The contact of two blocks is as wide as the narrower one. Nothing slides: pivots are where the narrower block's
    corners were at rest.

    Parameters
    ----------
    blocks : sequence of Block
        From the base up; 1 to 8 of them, of one gravity. Either all have a mass or none: then all are of one density
        and thickness, and what is said of masses and energies is relative (mass = width x height).
    impulse_shares : sequence of float, optional
        For each interface from the base up: where an impact's impulse acts, as a share k of the half width, 0 to 1.
        None: 1 everywhere, the plastic projection (Housner's impact of one block); 0 loses nothing.

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`: where that is not so.

    Examples
    --------
    >>> stack = Stack([Block(0.06, 0.27), Block(0.06, 0.27)])
    >>> round(stack.uplift_acceleration, 12), stack.first_to_lift
    (1.09, 0)
    """

    blocks: Annotated[tuple[Block, ...], Field(min_length=1, max_length=MOST_BLOCKS)]
    impulse_shares: tuple[float, ...] | None = field(default=None)

    @field_validator("blocks", "impulse_shares", mode="before")
    @classmethod
    def _sequence(cls, value: Any) -> Any:
        return tuple(cast("list[object]", value)) if isinstance(value, list) else value

    @model_validator(mode="after")
    def _one_kind(self) -> Stack:
        gravities = sorted({block.gravity for block in self.blocks})
        if len(gravities) > 1:
            raise refusal(f"blocks of a stack must share one gravity; given are {gravities[0]:g} and {gravities[-1]:g}")
        told = sum(block.mass is not None for block in self.blocks)
        if 0 < told < len(self.blocks):
            raise refusal(f"{told} of {len(self.blocks)} blocks have a mass; a stack needs all or none")
        shares = self.impulse_shares
        if shares is not None:
            if len(shares) != len(self.blocks):
                raise refusal(f"{len(shares)} impulse shares are given for {len(self.blocks)} interfaces")
            for share in shares:
                if not 0.0 <= share <= 1.0:
                    raise refusal(f"impulse share is {share:g}; it is a share of the half width, 0 to 1")
        return self

    def __len__(self) -> int:
        return len(self.blocks)

    @property
    def gravity(self) -> float:
        """m/s2."""
        return self.blocks[0].gravity

    @property
    def height(self) -> float:
        """Of the whole stack, m."""
        return sum(block.height for block in self.blocks)

    @property
    def masses(self) -> tuple[float, ...]:
        """kg; width x height where the blocks tell none."""
        return tuple(b.width * b.height if b.mass is None else b.mass for b in self.blocks)

    @property
    def half_contacts(self) -> tuple[float, ...]:
        """Half the width of the contact at each interface, m."""
        widths = [block.width for block in self.blocks]
        return tuple(0.5 * min(w, below) for w, below in zip(widths, [widths[0], *widths[:-1]], strict=True))

    def part(self, interface: int) -> Part:
        """Return the blocks from `interface` up as one rigid body."""
        mass = moment = about_interface = base = 0.0
        for block, m in list(zip(self.blocks, self.masses, strict=True))[interface:]:
            centre = base + 0.5 * block.height
            mass += m
            moment += m * centre
            about_interface += m * ((block.width**2 + block.height**2) / 12.0 + centre**2)
            base += block.height
        c = self.half_contacts[interface]
        return Part(mass, c, moment / mass, about_interface + mass * c * c, self.gravity)

    @property
    def parts(self) -> tuple[Part, ...]:
        """The part above each interface."""
        return tuple(self.part(interface) for interface in range(len(self)))

    @property
    def first_to_lift(self) -> int:
        """The interface that opens first when the base acceleration grows."""
        return min(range(len(self)), key=lambda i: self.part(i).uplift_acceleration)

    @property
    def uplift_acceleration(self) -> float:
        """Base acceleration under which the whole stack stands still, m/s2."""
        return self.part(self.first_to_lift).uplift_acceleration

    @property
    def frequency_parameter(self) -> float:
        """The largest p of a single block of the stack, rad/s: the solver's unit of time is its inverse."""
        return max(block.frequency_parameter for block in self.blocks)
