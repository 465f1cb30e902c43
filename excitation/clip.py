"""Make a pulse fit a table by reducing its parameters, and say what bound and by how much."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

from excitation.constant import ConstantPulse
from excitation.demand import LimitName, Terms
from excitation.double_pulse import DoublePulse
from excitation.limits import Limit, exceeded, missing_brake, not_settable, refusals
from excitation.quantity import SMALLEST
from excitation.reduction import reduction
from excitation.reshaped import Ramped, Saturated
from excitation.search import GUARD

if TYPE_CHECKING:
    from collections.abc import Mapping

    from excitation.capacity import Capacity
    from excitation.pulse import Pulse
    from excitation.reduction import GiveWay, Mode


@dataclass(frozen=True, slots=True)
class Clipped:
    """What was asked, what the table is given, and why.

    Attributes
    ----------
    asked : Pulse
        The pulse as asked.
    given : Pulse or None
        The pulse that fits: `asked` itself where it does; None where no pulse of that kind does.
    limits : tuple of Limit
        The limits that `asked` exceeds, the governing one first; see `excitation.limits.exceeded`.
    suggestion : Pulse or None
        Where nothing is given, the nearest pulse that fits, if there is a rule for one; see `clip`.
    usage : mapping
        Name of each limited number -> fraction of it that `given` uses; empty where nothing is given.
    factor : float
        Peak acceleration given over asked: 1 where unchanged, 0 where nothing is given.
    shape_error : float
        Root mean square of the acceleration cut off, over that of the asked pulse (`Saturated.shape_error`); 0 for
        pulses that were only scaled.
    stopping_distance : float
        Travel of coast and brake after the given pulse, m, signed.
    """

    asked: Pulse
    given: Pulse | None
    limits: tuple[Limit, ...]
    suggestion: Pulse | None = None
    usage: Mapping[LimitName, float] = field(default_factory=dict[LimitName, float])
    factor: float = 0.0
    shape_error: float = 0.0
    stopping_distance: float = 0.0

    @property
    def changed(self) -> bool:
        """Whether the table is given something else than was asked, or nothing."""
        return self.given is not self.asked

    @property
    def feasible(self) -> bool:
        """Whether the table makes the pulse exactly as asked."""
        return not self.changed

    @property
    def binding(self) -> Limit | None:
        """The governing limit; None where the pulse is feasible as asked."""
        return self.limits[0] if self.limits else None

    @property
    def residual_velocity(self) -> float:
        """Velocity at the end of the given pulse, which coast and brake take out, m/s; 0 where nothing is given."""
        return 0.0 if self.given is None else self.given.final_velocity

    @property
    def extra_duration(self) -> float:
        """How much longer the given pulse is than the asked one (ramps, a lower frequency), s; 0 without one."""
        return 0.0 if self.given is None else self.given.duration - self.asked.duration


def clip(
    pulse: Pulse,
    capacity: Capacity,
    *,
    mode: Mode = "scale",
    give_way: GiveWay | None = None,
    brake: float | None = None,
    coast: float = 0.0,
    payload: float | None = None,
) -> Clipped:
    """Return `pulse` reduced until a table of `capacity` can make it.

    Its parameters are reduced, never its samples: clipped samples integrate to drift and break similarity.

    * Waves, constant pulses and records: the amplitude. A wave above `capacity.frequency` is first lowered to it.
    * Double pulses: `give_way` "duration" (the default) keeps the peak velocity and lowers the pulses' acceleration, so
      that they last longer, and the velocity only where limits or the gap leave no other way; "velocity" lowers
      velocity and acceleration together and keeps the pulses' length. The gap is never changed.
    * With a jerk limit, jumps become ramps of that slope (`Ramped`; trapezoids of equal change of speed in a double
      pulse), whose extra time, velocity and travel count.
    * `mode` "saturate" cuts the waveform instead (`Saturated`) at the highest level that fits.

    Stroke is the whole travel of pulse, coast and brake from the best starting point, which `Motion` takes. A pulse is
    feasible as asked up to a share of 1e-12 above a limit; a reduced one stays 1e-11 below it.

    A released machine (`Capacity.machine`) stops by itself: its stroke is that of its own run, `brake` is not looked
    at, and what it cannot be set to (a weight, a drop, a gap) is refused after the reduction.

    No pulse is given where the table does not make the kind (`suggestion`: the constant pulse with the same peak
    acceleration and peak velocity, towards +x, clipped in its turn, braked at `capacity.acceleration` unless told), for
    too heavy a payload, and where the gap of a double pulse leaves no room to stop (`suggestion`: a shorter gap).

    Parameters
    ----------
    pulse : Pulse
        What is asked.
    capacity : Capacity
        What the table can do.
    mode : {"scale", "saturate"}
        What gives way: size or waveform.
    give_way : {"duration", "velocity", "amplitude"}, optional
        The first two for double pulses in mode "scale", the last for all others.
    brake : float, optional
        Deceleration after a pulse that ends moving, m/s2, within the capacity.
    coast : float
        Time between the end of such a pulse and the brake, s.
    payload : float, optional
        Mass on the table, kg.

    Raises
    ------
    ValueError
        One sentence: the pulse ends moving and no brake is given, the brake is beyond the capacity, or an option is
        unknown, out of its bounds or not one for this pulse.

    Examples
    --------
    >>> from excitation import Capacity, SineWave
    >>> table = Capacity(name="small", stroke=0.1, velocity=1.0, acceleration=9.81)
    >>> clipped = clip(SineWave(4.0, 2.0), table)
    >>> round(clipped.factor, 6), clipped.limits[0].sentence
    (0.628319, 'single sine asks 0.159 m of stroke; small has 0.1 m')
    """
    terms = Terms(capacity, brake, coast, payload)
    way = reduction(pulse, capacity, mode, give_way)
    refused = refusals(pulse, terms)
    if refused:
        over = () if missing_brake(pulse, terms) else exceeded(pulse, pulse, terms)
        suggestion = None if any(limit.name == "payload" for limit in refused) else _nearest_constant(pulse, terms)
        return Clipped(pulse, None, (*refused, *over), suggestion)
    limits = exceeded(pulse, way.largest, terms)
    given = way.fit(terms) if limits else pulse
    if given is None:
        if mode == "saturate":
            suggestion = clip(pulse, capacity, brake=brake, coast=coast, payload=payload).given
        else:
            suggestion = _shorter_gap(pulse, terms, give_way)
        return Clipped(pulse, None, tuple(limits), suggestion)
    if out_of_reach := not_settable(given, terms):
        # What is wrong with the asked pulse already says more than what is wrong with the reduced one.
        return Clipped(pulse, None, (*(not_settable(pulse, terms) or out_of_reach), *limits))
    usage = terms.usage(given)
    # What the given pulse uses up governed its size; a frequency or a jump is mended before any reduction.
    limits.sort(key=lambda limit: (limit.name == "frequency" or limit.asked is None, -round(usage[limit.name], 9)))
    peak = pulse.peak_acceleration
    core = given.pulse if isinstance(given, Ramped) else given
    return Clipped(
        asked=pulse,
        given=given,
        limits=tuple(limits),
        usage=usage,
        factor=given.peak_acceleration / peak if given is not pulse and peak > 0.0 else 1.0,
        shape_error=core.shape_error if isinstance(core, Saturated) and core is not pulse else 0.0,
        stopping_distance=terms.stop(given),
    )


def _nearest_constant(pulse: Pulse, terms: Terms) -> Pulse | None:
    peak, velocity = pulse.peak_acceleration, pulse.peak_velocity
    if peak == 0.0 or velocity == 0.0:
        return None
    nearest = ConstantPulse(peak, velocity / peak)
    if not terms.capacity.makes(nearest):
        return None
    brake = terms.capacity.acceleration if terms.brake is None else terms.brake
    return clip(nearest, terms.capacity, brake=brake, coast=terms.coast, payload=terms.payload).given


def _shorter_gap(pulse: Pulse, terms: Terms, give_way: GiveWay | None) -> Pulse | None:
    """Return the double pulse that fits a stroke longer by its gap, with its gap shorter by what that is too much."""
    if not isinstance(pulse, DoublePulse):
        return None
    longer = terms.capacity.model_copy(update={"stroke": terms.capacity.stroke + pulse.stop_gap})
    wide = clip(pulse, longer, give_way=give_way, brake=terms.brake, coast=terms.coast).given
    if not isinstance(wide, DoublePulse):
        return None
    gap = wide.stop_gap - (terms.asks(wide)["stroke"] - terms.capacity.stroke * (1.0 - 2.0 * GUARD))
    if gap < max(wide.run_up, SMALLEST):
        return None
    shorter = replace(wide, stop_gap=gap)
    return shorter if max(terms.usage(shorter).values()) <= 1.0 else None
