"""What a run asks of the contact: the horizontal and the normal force on the block, and where pure rocking fails.

About the corner on side s, with psi = alpha - |theta|, v = d|theta|/d(p t), w = d2|theta|/d(p t)2 and f = s a / g, the
centre of mass stands at (-s R sin psi, R cos psi) from the corner. Newton's law for it, with R p2 / g = 3/4:

    T / (m g) = a / g + 3/4 s (w cos psi + v2 sin psi)     the base's push on the block, positive towards +x
    N / (m g) = 1 + 3/4 (w sin psi - v2 cos psi)           upwards
    w = -sin psi - f cos psi                               (Housner 1963; Ishiyama 1982, section 3)

and T = m a, N = m g at rest. The block would slide where |T| / N exceeds the friction coefficient, and leave the base
where N is not above 0; from then on the solution is no longer the block's motion.

At an impact the centre of mass, coming down about one corner at the rate v0, leaves about the other at eta v0: its
velocity changes by R v0 (1 - eta) cos(alpha) across and by R v0 (1 + eta) sin(alpha) up. So, whatever the restitution
and however the impulse is spread over the base,

    horizontal impulse / normal impulse = (1 - eta) / ((1 + eta) tan(alpha)),

which for Housner's restitution is 3 sin(alpha) cos(alpha) / (4 - 3 sin2(alpha)).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from twin.rocking.block import Block
from twin.rocking.compiled import FloatArray
from twin.rocking.response import Outcome, Response
from twin.rocking.validity_search import Instants, first_passage, greatest

if TYPE_CHECKING:
    from excitation import Pulse

SPACING = 0.02
"""Longest distance between the instants looked at first, in units of 1/p."""
PER_WAVE = 60
"""Least number of instants in a cycle of the base motion."""
MOST_INSTANTS = 200_000


@dataclass(frozen=True, slots=True)
class Validity:
    """What pure rocking asked of the contact over a run; times in s, forces as shares of m g.

    Attributes
    ----------
    friction_needed, friction_time : float
        Largest |T| / N, and when; infinite, at `lift_off_time`, where the block leaves the base.
    least_normal, least_normal_time : float
        Least N / (m g), and when.
    impact_friction : float or None
        Horizontal over normal impulse, the same at every impact; None where there is none.
    lift_off_time : float or None
        First time N is not above 0; None where the base always pushes.
    friction : float or None
        The friction coefficient it is judged by; None where none was given.
    sliding_time : float or None
        First time, impacts included, more friction is needed than there is; None where there is enough, or no number.
    until : float
        End of the span judged, s: the end of the motion or, where the block overturns, the last time it passes alpha:
        what the base does to a block that is falling anyway does not change the answer.
    """

    friction_needed: float
    friction_time: float
    least_normal: float
    least_normal_time: float
    impact_friction: float | None
    lift_off_time: float | None
    friction: float | None
    sliding_time: float | None
    until: float

    @property
    def holds(self) -> bool:
        """Whether the block neither leaves the base nor slides (so far as a friction coefficient was given)."""
        return self.lift_off_time is None and self.sliding_time is None


def impact_friction(block: Block, restitution: float) -> float:
    """Return the horizontal over the normal impulse of an impact: (1 - eta) / ((1 + eta) tan(alpha))."""
    return (1.0 - restitution) / ((1.0 + restitution) * math.tan(block.slenderness))


def reactions(response: Response, pulse: Pulse | None, t: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return T / (m g) and N / (m g) at the times `t`, s, within the motion known; just after it, at an impact.

    Examples
    --------
    >>> from twin import simulate
    >>> block = Block(0.06, 0.27)
    >>> tangential, normal = reactions(simulate(block), None, np.array([1.0]))
    >>> float(tangential[0]), float(normal[0])
    (0.0, 1.0)
    """
    return _forces(response.block, *_state(response, pulse, np.asarray(t, dtype=np.float64)))


def validity(response: Response, pulse: Pulse | None, *, friction: float | None = None) -> Validity:
    """Return what the run asked of the contact.

    Parameters
    ----------
    response : Response
    pulse : Pulse or None
        The base motion it answers.
    friction : float, optional
        Coefficient between block and base, above 0.

    Notes
    -----
    The forces are looked at on both sides of every event and break point, and every `SPACING` / p (`PER_WAVE` times
    in a cycle) between them; the extremes are then closed in on to 1e-6 of their value. An extreme narrower than that
    spacing is missed only inside a smooth stretch of the motion, which has none. The accelerations are those of the
    nonlinear equation in the state the response gives, whatever model that is of.

    Raises
    ------
    ValueError
        Where `friction` is not finite and above 0.
    """
    if friction is not None and not 0.0 < friction < math.inf:
        raise ValueError(f"friction is {friction:g}; it must be above 0 and finite")
    until = _judged_until(response, pulse)

    def look(t: FloatArray) -> Instants:
        return Instants(t, *reactions(response, pulse, t))

    instants = _instants(response, pulse, until)
    in_contact = instants.normal > 0.0
    lift_off = None if bool(in_contact.all()) else first_passage(instants, look, lambda i: -i.normal, 0.0)
    least_time, least = greatest(instants, look, lambda i: -i.normal)
    if lift_off is None and least >= 0.0:
        lift_off = least_time
    friction_time, needed = (lift_off, math.inf) if lift_off is not None else greatest(instants, look, _ratio)
    impulses = impact_friction(response.block, response.restitution) if len(response.impact_times) else None
    sliding = None
    if friction is not None:
        if needed > friction:
            sliding = first_passage(instants, look, _ratio, friction)
            sliding = friction_time if sliding is None else min(sliding, friction_time)
        if impulses is not None and impulses > friction:
            first = float(response.impact_times[0])
            sliding = first if sliding is None else min(sliding, first)
    return Validity(needed, friction_time, -least, least_time, impulses, lift_off, friction, sliding, until)


def _ratio(instants: Instants) -> FloatArray:
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = np.abs(instants.tangential) / instants.normal
    return np.where(instants.normal > 0.0, ratio, math.inf)


def _state(
    response: Response, pulse: Pulse | None, t: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return side, |theta| (rad), v (units of p) and a / g at times `t`."""
    block = response.block
    theta = np.asarray(response.rotation(t), dtype=np.float64).reshape(t.shape)
    omega = np.asarray(response.angular_velocity(t), dtype=np.float64).reshape(t.shape)
    a = _base(pulse, t)
    # Standing on a base that lifts it from this very instant on.
    lifting = np.where(np.abs(a) > block.uplift_acceleration, -np.sign(a), 0.0)
    side = np.where(theta != 0.0, np.sign(theta), np.where(omega != 0.0, np.sign(omega), lifting))
    return side, np.abs(theta), side * omega / block.frequency_parameter, a / block.gravity


def _forces(
    block: Block, side: FloatArray, phi: FloatArray, v: FloatArray, a: FloatArray
) -> tuple[FloatArray, FloatArray]:
    psi = block.slenderness - phi
    s, c = np.sin(psi), np.cos(psi)
    w = -s - side * a * c
    rocking = side != 0.0
    tangential = a + np.where(rocking, 0.75 * side * (w * c + v * v * s), 0.0)
    normal = 1.0 + np.where(rocking, 0.75 * (w * s - v * v * c), 0.0)
    return tangential, normal


def _base(pulse: Pulse | None, t: FloatArray) -> FloatArray:
    return np.zeros_like(t) if pulse is None else np.asarray(pulse.acceleration(t), dtype=np.float64)


def _judged_until(response: Response, pulse: Pulse | None) -> float:
    """Return the end of the span judged, s."""
    shaking = 0.0 if pulse is None else pulse.duration
    if response.outcome is Outcome.OVERTURNED and response.overturning_time is not None:
        return _last_below(response, response.overturning_time)
    if math.isfinite(response.end_time):
        return response.end_time
    still = max(response.rest_time or 0.0, response.overturning_time or 0.0)
    return max(shaking, still)


def _last_below(response: Response, fallen: float) -> float:
    """Return the last time before `fallen` (s) at which |theta| is not above alpha, or 0: bisection on a fine grid."""
    alpha = response.block.slenderness
    t = np.linspace(0.0, fallen, max(2000, int(fallen * response.block.frequency_parameter / SPACING)))
    below = np.nonzero(np.abs(np.asarray(response.rotation(t))) <= alpha)[0]
    if not below.size:
        return 0.0
    low = float(t[below[-1]])
    high = float(t[min(below[-1] + 1, t.size - 1)])
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if abs(response.rotation(middle)) <= alpha else (low, middle)
    return low


def _instants(response: Response, pulse: Pulse | None, until: float) -> Instants:
    """Return the forces at the first grid: the events and break points from both sides, and evenly between them."""
    block = response.block
    marks = [0.0, until, *(t for t in (response.uplift_time, response.rest_time) if t is not None)]
    spacing = SPACING / block.frequency_parameter
    if pulse is not None:
        marks += pulse.breakpoints.tolist()
        waves = pulse.pieces[pulse.pieces[:, 4] != 0.0, 5]
        if waves.size:
            spacing = min(spacing, 2.0 * math.pi / (PER_WAVE * float(waves.max())))
    spacing = max(spacing, until / MOST_INSTANTS)
    even = np.linspace(0.0, until, 2 + math.ceil(until / spacing))
    breaks = np.asarray(marks, dtype=np.float64)
    t = np.unique(np.concatenate([even, breaks, np.nextafter(breaks, -1.0), response.impact_times]))
    t = t[(t >= 0.0) & (t <= until)]
    after = Instants(t, *reactions(response, pulse, t))
    rates = response.impact_rates
    hits = response.impact_times
    inside = hits <= until
    hits, rates = hits[inside], rates[inside]
    before = _forces(
        block,
        -np.sign(rates),
        np.zeros_like(rates),
        -np.abs(rates) / block.frequency_parameter,
        _base(pulse, hits) / block.gravity,
    )
    return after.with_limits(Instants(hits, *before))
