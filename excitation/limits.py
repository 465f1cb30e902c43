"""Which limits a pulse exceeds, by how much, in numbers and in sentences."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from excitation.demand import UNITS, LimitName, Terms, ends_moving
from excitation.extremes import JUMP_TOLERANCE
from excitation.search import ROUNDING

if TYPE_CHECKING:
    from excitation.capacity import Capacity
    from excitation.pulse import Pulse


@dataclass(frozen=True, slots=True)
class Limit:
    """One limit of a capacity that the asked pulse exceeds.

    Attributes
    ----------
    name : str
        "stroke", "velocity", "acceleration", "jerk", "frequency", "payload", "kind", "sense", "gap" or "drop".
    asked, limit : float or None
        What the pulse asks and the table has, in `unit`. Both are None for a kind or a sense the table does not make,
        and `asked` for a jump, which no finite jerk makes.
    unit : str
        "m", "m/s", "m/s2", "m/s3", "Hz", "kg" or "".
    sentence : str
        The same in words: "single sine asks 0.286 m of stroke; quanser_st3 has 0.216 m".
    """

    name: LimitName
    asked: float | None
    limit: float | None
    unit: str
    sentence: str

    @property
    def ratio(self) -> float | None:
        """Asked over limit; None where either is."""
        return None if self.asked is None or self.limit is None else self.asked / self.limit


def refusals(asked: Pulse, terms: Terms) -> list[Limit]:
    """Return what no smaller pulse would mend: a kind or a sense the table does not make, too heavy a payload."""
    capacity, found = terms.capacity, list[Limit]()
    if not capacity.makes(asked):
        kinds = " or ".join(capacity.kinds or ())
        sentence = f"{capacity.name} makes pulses of kind {kinds} only, no {asked.kind}"
        found.append(Limit("kind", None, None, "", sentence))
    if capacity.one_signed and asked.acceleration_range[0] < -JUMP_TOLERANCE * asked.peak_acceleration:
        sentence = f"{asked.kind} asks acceleration towards -x; {capacity.name} has it towards +x only"
        found.append(Limit("sense", None, None, "", sentence))
    if capacity.payload is not None and terms.payload is not None and terms.payload > capacity.payload:
        found.append(_limit("payload", "the run", terms.payload, capacity))
    return found


def not_settable(given: Pulse, terms: Terms) -> list[Limit]:
    """Return why a released machine cannot be set to `given`; nothing for a table that follows set-points."""
    machine = terms.capacity.machine_for(given)
    return [] if machine is None else machine.refusals(given, terms.capacity.name, terms.payload)


def exceeded(asked: Pulse, performed: Pulse, terms: Terms) -> list[Limit]:
    """Return the numbers that are exceeded, the greatest ratio first, jumps last.

    Acceleration, jerk and frequency are those of the asked pulse; stroke and velocity are those of `performed`, the
    pulse as the table would have to make it before any reduction of its size: with its jumps made into ramps, at the
    highest frequency it allows.

    Raises
    ------
    ValueError
        The pulse ends moving and there is no brake.
    """
    capacity = terms.capacity
    asks = terms.asks(performed)
    own: dict[LimitName, float] = {
        "acceleration": asked.peak_acceleration,
        "jerk": asked.peak_jerk,
        "frequency": asked.fundamental or 0.0,
    }
    asks.update(own)
    asks.pop("payload", None)
    over: dict[LimitName, float] = {
        name: value for name, value in asks.items() if value > terms.has(name) * (1.0 + ROUNDING)
    }
    found = [_limit(name, asked.kind if name in own else performed.kind, over[name], capacity) for name in over]
    found.sort(key=lambda limit: -(limit.ratio or 0.0))
    if capacity.jerk is not None and asked.largest_jump > 0.0 and "jerk" not in over:
        sentence = (
            f"{asked.kind} asks a jump of {asked.largest_jump:.4g} m/s2; "
            f"{capacity.name} has ramps of {capacity.jerk:.4g} m/s3"
        )
        found.append(Limit("jerk", None, capacity.jerk, UNITS["jerk"], sentence))
    return found


def missing_brake(asked: Pulse, terms: Terms) -> bool:
    """Return whether `asked` ends moving with nothing stated to stop it."""
    return terms.brake is None and ends_moving(asked) and terms.capacity.machine_for(asked) is None


def _limit(name: LimitName, what: str, asked: float, capacity: Capacity) -> Limit:
    limit, unit = float(getattr(capacity, name)), UNITS[name]
    # As many digits as it takes to see the difference.
    digits = next((n for n in range(3, 17) if f"{asked:.{n}g}" != f"{limit:.{n}g}"), 17)
    sentence = f"{what} asks {asked:.{digits}g} {unit} of {name}; {capacity.name} has {limit:.{digits}g} {unit}"
    return Limit(name, asked, limit, unit, sentence)
