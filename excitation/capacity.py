"""What a table can do, as a value: its limits in SI units, and where each number comes from."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import BaseModel, BeforeValidator, Field, SerializeAsAny, model_validator

from excitation.quantity import VALUE, quantity, refusal
from excitation.released import ReleasedMachine

if TYPE_CHECKING:
    from excitation.pulse import Pulse


def _spelled(kinds: object) -> object:
    """Take a list as well (TOML has no tuples), and "double_pulse" for "double pulse"."""
    if not isinstance(kinds, (list, tuple)):
        return kinds
    spelled: list[object] = list(kinds)  # pyright: ignore[reportUnknownArgumentType]
    return tuple(kind.replace("_", " ") if isinstance(kind, str) else kind for kind in spelled)


class Capacity(BaseModel):
    """Limits of one table. A pulse is within them at the limit itself.

    Attributes
    ----------
    name : str
        What sentences call the table.
    stroke : float
        Total travel, m, from one end to the other; 0 is its centre.
    velocity, acceleration : float
        Largest |v|, m/s, and |a|, m/s2.
    jerk : float or None
        Largest |da/dt|, m/s3; None allows jumps.
    frequency : float or None
        Largest fundamental frequency of a wave, Hz; None for no limit. Records have none.
    payload : float or None
        Largest mass on the table, kg; None for no limit.
    kinds : tuple of str or None
        Families of pulses (or single kinds) the table can make; None for any. See `Pulse.family`.
    one_signed : bool
        Whether it can accelerate towards +x only.
    machine : ReleasedMachine or None
        How a machine that is set by hand and released makes its runs; None for a table that follows set-points.
    provenance : mapping
        Field name -> where its number comes from ("data sheet", "recalled placeholder").

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`; its messages name the value, its limit and unit.
    """

    model_config = {**VALUE, "frozen": True}

    name: Annotated[str, Field(min_length=1, max_length=100)]
    stroke: Annotated[float, quantity("m", above=0.0)]
    velocity: Annotated[float, quantity("m/s", above=0.0)]
    acceleration: Annotated[float, quantity("m/s2", above=0.0)]
    jerk: Annotated[float, quantity("m/s3", above=0.0, at_most=1e9)] | None = None
    frequency: Annotated[float, quantity("Hz", above=0.0)] | None = None
    payload: Annotated[float, quantity("kg", above=0.0)] | None = None
    kinds: Annotated[Annotated[tuple[str, ...], Field(min_length=1)] | None, BeforeValidator(_spelled)] = None
    one_signed: bool = False
    machine: SerializeAsAny[ReleasedMachine] | None = None
    provenance: dict[str, str] = {}

    @model_validator(mode="after")
    def _provenance_names_fields(self) -> Capacity:
        unknown = sorted(set(self.provenance) - set(type(self).model_fields))
        if unknown:
            raise refusal(f"provenance names {unknown[0]!r}, which is no number of a capacity")
        return self

    def __hash__(self) -> int:
        return hash((self.name, self.stroke, self.velocity, self.acceleration))

    @property
    def sources(self) -> dict[str, str]:
        """Where each number comes from, those of a released machine included as "machine.KEY"."""
        machine = {} if self.machine is None else self.machine.described
        return {**self.provenance, **{f"machine.{key}": source for key, (_, source) in machine.items()}}

    def makes(self, pulse: Pulse) -> bool:
        """Return whether `pulse` is of a kind this table makes, whatever its size and sense."""
        return self.kinds is None or pulse.family in self.kinds or pulse.kind in self.kinds

    def machine_for(self, pulse: Pulse) -> ReleasedMachine | None:
        """Return the released machine that makes `pulse` in its own way; None where the table follows set-points."""
        return self.machine if self.makes(pulse) else None
