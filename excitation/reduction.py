"""How a pulse gives way: the family of smaller pulses that `clip` searches for the largest that fits."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

from excitation.double_pulse import DoublePulse, run_up
from excitation.reshaped import Ramped, Saturated
from excitation.search import GUARD, ROUNDING, largest_factor
from excitation.wave import Wave

if TYPE_CHECKING:
    from collections.abc import Callable

    from excitation.capacity import Capacity
    from excitation.demand import LimitName, Terms
    from excitation.pulse import Pulse

Mode: TypeAlias = Literal["scale", "saturate"]
GiveWay: TypeAlias = Literal["amplitude", "duration", "velocity"]

# A double pulse at less than this share of what was asked is another experiment.
_LEAST_DOUBLE_PULSE: Final = 1e-3

# Ratio of the levels at which a saturated pulse is tried, from the highest down.
_LEVELS: Final = 0.95


@dataclass(frozen=True, slots=True)
class Reduction:
    """A pulse as a function of one factor from `smallest` to 1.

    Attributes
    ----------
    largest : Pulse
        The pulse at factor 1, as a table would perform it: no jumps or frequencies that it does not allow.
    smaller : callable
        Factor -> pulse.
    obstacle : callable
        Factor -> fraction; above 1 there is no such pulse.
    smallest : float
        Least factor worth trying.
    stride : float or None
        As in `largest_factor`.
    fixed : tuple of str
        Limits whose use does not change with the factor: they may stay as near to the limit as they are.
    """

    largest: Pulse
    smaller: Callable[[float], Pulse]
    obstacle: Callable[[float], float]
    smallest: float
    stride: float | None = None
    fixed: tuple[LimitName, ...] = ("frequency", "payload")

    def fit(self, terms: Terms) -> Pulse | None:
        """Return the largest pulse within `terms`, None where none is; see `largest_factor`."""

        def worst(factor: float) -> float:
            obstacle = self.obstacle(factor)
            if obstacle > 1.0:
                return obstacle
            return max(obstacle, self._reducible(self.smaller(factor), terms))

        factor = largest_factor(worst, self.smallest, self.stride)
        return None if factor is None else self.smaller(factor)

    def _reducible(self, pulse: Pulse, terms: Terms) -> float:
        usage = terms.usage(pulse)
        if isinstance(pulse, Ramped) and "jerk" in usage:
            # The slope of the ramps is the limit itself, near enough, at every size.
            usage["jerk"] = pulse.pulse.peak_jerk / terms.has("jerk")
        return max(share for name, share in usage.items() if name not in self.fixed or share > 1.0 + ROUNDING)


def reduction(pulse: Pulse, capacity: Capacity, mode: Mode, give_way: GiveWay | None) -> Reduction:
    """Return how `pulse` gives way on a table of `capacity`; see `clip`.

    Raises
    ------
    ValueError
        One sentence: an unknown mode, or a `give_way` that is not one for this pulse and mode.
    """
    ways = ("duration", "velocity") if isinstance(pulse, DoublePulse) else ("amplitude",)
    ways = ways if mode == "scale" else ()
    if mode not in ("scale", "saturate"):
        raise ValueError(f"mode is {mode!r}; it must be 'scale' or 'saturate'")
    if give_way is not None and give_way not in ways:
        allowed = " or ".join(map(repr, ways)) or "left out"
        raise ValueError(f"give_way is {give_way!r}; for a {pulse.kind} in mode {mode!r} it must be {allowed}")
    if isinstance(pulse, DoublePulse) and mode == "scale":
        return _double_pulse(pulse, capacity, keep_length=give_way == "velocity")
    slope = ramp_slope(capacity)
    start = pulse.pulse if isinstance(pulse, Ramped) and slope is not None and pulse.jerk > slope else pulse
    start = _slowed(start, capacity)

    level = min(start.peak_acceleration, capacity.acceleration * (1.0 - 2.0 * GUARD))

    def saturated(factor: float) -> Pulse:
        cuts = factor * level < start.peak_acceleration
        return _ramped(Saturated(start, factor * level) if cuts else start, capacity)

    def scaled(factor: float) -> Pulse:
        return _ramped(start.scaled(factor), capacity)

    # What is cut off a record may add to its travel or take from it: look for the highest level step by step.
    smaller, stride = (saturated, _LEVELS) if mode == "saturate" else (scaled, None)
    return Reduction(_ramped(start, capacity), smaller, lambda _: 0.0, 1e-15, stride)


def ramp_slope(capacity: Capacity) -> float | None:
    """Return the slope of the ramps that stand for jumps, m/s3: just inside the jerk limit; None without one."""
    return None if capacity.jerk is None else capacity.jerk * (1.0 - 4.0 * GUARD)


def _slowed(pulse: Pulse, capacity: Capacity) -> Pulse:
    fastest = capacity.frequency
    if fastest is None or not isinstance(pulse, Wave) or pulse.frequency <= fastest * (1.0 + ROUNDING):
        return pulse
    return replace(pulse, frequency=fastest)


def _ramped(pulse: Pulse, capacity: Capacity) -> Pulse:
    slope = ramp_slope(capacity)
    return pulse if slope is None or pulse.largest_jump == 0.0 else Ramped(pulse, slope)


def _double_pulse(pulse: DoublePulse, capacity: Capacity, *, keep_length: bool) -> Reduction:
    slopes = [slope for slope in (pulse.jerk, ramp_slope(capacity)) if slope is not None]
    slope = min(slopes, default=None)
    highest = pulse.pulse_acceleration
    if not keep_length:
        highest = min(highest, capacity.acceleration * (1.0 - 2.0 * GUARD))

    def numbers(factor: float) -> tuple[float, float]:
        return factor * pulse.peak_velocity, factor * highest if keep_length else highest

    def obstacle(factor: float) -> float:
        return run_up(*numbers(factor), slope) / pulse.stop_gap

    def smaller(factor: float) -> DoublePulse:
        velocity, acceleration = numbers(factor)
        return replace(pulse, peak_velocity=velocity, pulse_acceleration=acceleration, jerk=slope)

    # The nudges below the limits must not show in a pulse that is within them as asked.
    steep = slope is not None and (pulse.jerk is None or pulse.jerk > slope * (1.0 + 8.0 * GUARD))
    strong = highest < pulse.pulse_acceleration * (1.0 - 4.0 * GUARD)
    largest = smaller(1.0) if (steep or strong) and obstacle(1.0) <= 1.0 else pulse
    fixed = ("jerk", "payload") if keep_length else ("acceleration", "jerk", "payload")
    return Reduction(largest, smaller, obstacle, _LEAST_DOUBLE_PULSE, fixed=fixed)
