"""What a pulse asks of a table, stopping included, beside what the table has."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from excitation.quantity import checked
from excitation.speed_change import stopping_distance

if TYPE_CHECKING:
    from excitation.capacity import Capacity
    from excitation.pulse import Pulse

LimitName: TypeAlias = Literal[
    "stroke", "velocity", "acceleration", "jerk", "frequency", "payload", "kind", "sense", "gap", "drop"
]

UNITS: Final[dict[LimitName, str]] = {
    "stroke": "m",
    "velocity": "m/s",
    "acceleration": "m/s2",
    "jerk": "m/s3",
    "frequency": "Hz",
    "payload": "kg",
    "kind": "",
    "sense": "",
    "gap": "m",
    "drop": "m",
}

# A pulse whose last velocity is below this share of its peak ends at rest: the rest is rounding.
REST_TOLERANCE: Final = 1e-9


def ends_moving(pulse: Pulse) -> bool:
    """Return whether `pulse` leaves the table moving: |final velocity| above `REST_TOLERANCE` of its peak velocity."""
    return abs(pulse.final_velocity) > REST_TOLERANCE * pulse.peak_velocity


@dataclass(frozen=True, slots=True)
class Terms:
    """What a pulse is measured against: a capacity, the mass on the table, and how the table stops afterwards.

    Parameters
    ----------
    capacity : Capacity
        The table's limits.
    brake : float or None
        Deceleration after a pulse that ends moving, m/s2, above 0 and within the capacity; not of a released machine.
    coast : float
        Time at constant velocity between such a pulse and the brake, s, at least 0.
    payload : float or None
        Mass on the table, kg; None where it is not known.

    Raises
    ------
    ValueError
        One sentence: a value that is not finite or out of its bounds.
    """

    capacity: Capacity
    brake: float | None = None
    coast: float = 0.0
    payload: float | None = None

    def __post_init__(self) -> None:
        if self.brake is not None:
            checked("brake", self.brake, "m/s2", above=0.0)
            if self.brake > self.capacity.acceleration:
                raise ValueError(
                    f"brake asks {self.brake:.6g} m/s2; {self.capacity.name} has {self.capacity.acceleration:.6g} m/s2"
                )
        checked("coast", self.coast, "s", at_least=0.0)
        if self.payload is not None:
            checked("payload", self.payload, "kg", at_least=0.0)

    def stop(self, pulse: Pulse) -> float:
        """Return the signed distance of coast and brake after `pulse`, m; a released machine's is as it makes it.

        Raises
        ------
        ValueError
            The pulse ends moving and there is no brake.
        """
        if (machine := self.capacity.machine_for(pulse)) is not None:
            return machine.reach(pulse, self.coast)[2] - pulse.net_displacement
        if not ends_moving(pulse):
            return 0.0
        velocity = pulse.final_velocity
        if self.brake is None:
            raise ValueError(f"{pulse.kind} ends moving at {velocity:.4g} m/s; a brake in m/s2 must be given")
        return velocity * self.coast + stopping_distance(velocity, self.brake, self.capacity.jerk)

    def reach(self, pulse: Pulse) -> tuple[float, float]:
        """Return the least and greatest displacement from the start of `pulse` to the end of its brake, m."""
        if (machine := self.capacity.machine_for(pulse)) is not None:
            return machine.reach(pulse, self.coast)[:2]
        lowest, highest = pulse.displacement_range
        end = pulse.net_displacement + self.stop(pulse)
        return min(lowest, end), max(highest, end)

    def asks(self, pulse: Pulse) -> dict[LimitName, float]:
        """Return what `pulse` asks of every number the capacity limits, in its unit.

        Stroke is the whole travel of pulse, coast and brake, whatever the starting point (see `Motion`); jerk is that
        inside the pieces, so jumps are not in it.
        """
        lowest, highest = self.reach(pulse)
        asks: dict[LimitName, float] = {
            "stroke": highest - lowest,
            "velocity": pulse.peak_velocity,
            "acceleration": pulse.peak_acceleration,
        }
        if self.capacity.jerk is not None:
            asks["jerk"] = pulse.peak_jerk
        if self.capacity.frequency is not None and pulse.fundamental is not None:
            asks["frequency"] = pulse.fundamental
        if self.capacity.payload is not None and self.payload is not None:
            asks["payload"] = self.payload
        return asks

    def has(self, name: LimitName) -> float:
        """Return the capacity's limit called `name`, in its unit; infinite where there is none."""
        limit: float | None = getattr(self.capacity, name)
        return float("inf") if limit is None else limit

    def usage(self, pulse: Pulse) -> dict[LimitName, float]:
        """Return `asks` as fractions of the capacity."""
        return {name: asked / self.has(name) for name, asked in self.asks(pulse).items()}
