"""With what energy the table could run into its end stops: the mass that moves, and the speed that is left there."""

from __future__ import annotations

import math
from dataclasses import dataclass

from excitation.released import ReleasedRun
from twin.whole_run.mechanics import TableMechanics
from twin.whole_run.outcome import StopStudy


@dataclass(frozen=True, slots=True)
class Impact:
    """A base that meets its end stop.

    Attributes
    ----------
    what : str
        How it comes to that.
    time : float or None
        When what leads to it happens, s; None for any time.
    speed : float
        m/s; 0 where it does not get there.
    mass : float or None
        kg; None where it is not known.
    """

    what: str
    time: float | None
    speed: float
    mass: float | None

    @property
    def energy(self) -> float | None:
        """m v^2 / 2, J; None where the mass is not known."""
        return None if self.mass is None else 0.5 * self.mass * self.speed * self.speed


def servo_impacts(
    mechanics: TableMechanics, ramp_down: StopStudy, power_cut: StopStudy | None, peak_velocity: float
) -> tuple[Impact, ...]:
    """Return the ways into a bumper: a ramp-down too late, power lost, a runaway drive."""
    when, stop = ramp_down.fastest_beyond
    found = [Impact("ramp-down", when if stop.beyond else None, stop.beyond, mechanics.mass)]
    if power_cut is not None:
        when, stop = power_cut.fastest_beyond
        found.append(Impact("power lost", when if stop.beyond else None, stop.beyond, mechanics.mass))
    else:
        found.append(Impact("nothing brakes it from the top speed of the run", None, peak_velocity, mechanics.mass))
    if mechanics.top_speed is not None:
        found.append(Impact("the drive runs away at its top speed", None, mechanics.top_speed, mechanics.mass))
    return tuple(found)


def released_impacts(run: ReleasedRun, mass: float | None) -> tuple[Impact, ...]:
    """Return how a released base meets its end stop in the run as planned."""
    name = run.machine.stop_name
    phase = next((phase for phase in run.phases if phase.name == name), None)
    if phase is None:
        return ()
    return (
        Impact(f"the {name}, in every run", phase.start, abs(run.velocity(math.nextafter(phase.start, 0.0))), mass),
    )
