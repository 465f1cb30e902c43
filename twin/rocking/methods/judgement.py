"""What a finished run says: its events sorted, and whether the block falls on a base that stays still from now on."""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import FELL
from twin.rocking.methods.equations import margin_slopes, margins
from twin.rocking.run import SAFETY
from twin.rocking.state import ALPHA, E11, E12, E22, IMPACT, PSI, RATE, REST, RESTITUTION, SIDE, UPLIFT

ROUNDING = 4e-16


@compiled
def still_base_verdict(model: int, body: FloatArray, state: FloatArray, code: int) -> tuple[bool, bool]:
    """Return whether the block overturns if the base stays still from now on, and whether its error may decide that.

    `code` is the march's; the state carries its error.
    """
    if code == FELL:
        return True, False
    if state[SIDE] == 0.0:
        return False, False
    alpha = body[ALPHA]
    eta = body[RESTITUTION]
    psi = state[PSI]
    v = state[RATE]
    ahead, around = margins(model, alpha, eta, psi, v)
    along, by_phi, by_v = margin_slopes(model, alpha, psi, v)
    doubt = abs(ahead) <= SAFETY * _spread(state, along, 1.0)
    if ahead <= 0.0:
        doubt = doubt or abs(around) <= SAFETY * (eta * _spread(state, by_phi, by_v) + ROUNDING)
    return ahead > 0.0 or around > 0.0, doubt


@compiled
def _spread(state: FloatArray, by_phi: float, by_v: float) -> float:
    """Return the standard deviation of a quantity with these derivatives, plus one rounding of the state."""
    variance = by_phi * by_phi * state[E11] + 2.0 * by_phi * by_v * state[E12] + by_v * by_v * state[E22]
    return math.sqrt(max(0.0, variance)) + ROUNDING


@compiled
def _sort(events: FloatArray, impacts: FloatArray) -> tuple[int, float, float]:
    count = 0
    lift = -1.0
    rest = -1.0
    for i in range(events.shape[0]):
        code = events[i, 2]
        if code == IMPACT:
            impacts[0, count] = events[i, 0]
            impacts[1, count] = events[i, 1]
            count += 1
        elif code == UPLIFT and lift < 0.0:
            lift = events[i, 0]
        elif code == REST:
            rest = events[i, 0]
    return count, lift, rest


def sorted_events(events: FloatArray) -> tuple[FloatArray, float | None, float | None]:
    """Return impacts, shape (2, n): times s and signed rates rad/s; the first uplift and the last rest, s."""
    impacts = np.empty((2, len(events)))
    count, lift, rest = _sort(events, impacts)
    return impacts[:, :count], None if lift < 0.0 else lift, None if rest < 0.0 else rest
