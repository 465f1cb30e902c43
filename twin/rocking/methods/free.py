"""Everything after the excitation in closed form: flight by flight to rest, to pi/2, or to the end of the run.

The state is that of `twin.rocking.march`. Rows of the history have the layout of `segment`; those of the nonlinear
equation hold psi at the start in the place of phi''.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.march import CAME_TO_REST, FELL, FULL, HALF_TURN, LONGEST_FLIGHT, REACHED, REST_RATE, STUCK
from twin.rocking.methods.elliptic import position
from twin.rocking.methods.equations import FULL_EQUATION, acceleration, centre, growth, margin_slopes, time_to_rest
from twin.rocking.methods.flight import bounce, fall, flight_series, strike
from twin.rocking.methods.segment import COLUMNS, K0, LENGTH, MU, PHI0, START, V0, motion, row_at
from twin.rocking.methods.segment import SIDE as ROW_SIDE
from twin.rocking.state import ALPHA, AT_REST, E11, E12, E22, PEAK, PHI, PSI, RATE, RESTITUTION, SIDE, TIME, WORST, P

MOST_IMPACTS = 100_000
EPSILON = 2.3e-16
# Derivatives of a flight's time, for the error of the error only, are differences over this share of the state.
NUDGE = 1e-6


def impacts_left(body: FloatArray, state: FloatArray, end: float) -> int:
    """Return a bound of the impacts until the rate falls to `REST_RATE`, at most `MOST_IMPACTS`."""
    eta = float(body[RESTITUTION])
    # No rate ever exceeds that of a fall from the equilibrium or from the present state.
    largest = math.hypot(float(state[RATE]), 2.0) + 2.0
    if eta >= 1.0:
        return MOST_IMPACTS if math.isinf(end) else 4096
    if eta <= 0.0:
        return 2
    return min(MOST_IMPACTS, 3 + int(math.log(REST_RATE / largest) / math.log(eta)))


@compiled
def run_free(
    model: int,
    body: FloatArray,
    state: FloatArray,
    end: float,
    impacts: FloatArray,
    rows: FloatArray,
    used: FloatArray,
) -> int:
    """Advance `state` in place over a still base.

    Parameters
    ----------
    model : int
        See `equations`.
    body, state : ndarray
        As for `march`.
    end : float
        s, may be infinite.
    impacts, rows : ndarray, shape (2, n) and (n, COLUMNS)
        Time and signed rate of each impact; one row per flight. Written from `used[0]` on.

    Returns
    -------
    int
        As `march`; FULL where `impacts` is, and STUCK on the unstable equilibrium or its stable branch.
    """
    if state[SIDE] == 0.0:
        return CAME_TO_REST if math.isinf(end) else REACHED
    alpha = body[ALPHA]
    p = body[P]
    eta = body[RESTITUTION]
    c = centre(model, alpha)
    base = 2.0 * math.sin(0.5 * alpha) if model == FULL_EQUATION else growth(model, alpha) * c
    series = flight_series(alpha)
    phi = state[PHI]
    psi = state[PSI]
    v = state[RATE]
    t = state[TIME]
    side = state[SIDE]
    n = int(used[0])
    timing = 0.0
    spread = 0.0
    first = True
    earlier = 0.0
    earlier_time = 0.0
    while True:
        if n >= rows.shape[0]:
            state[TIME] = t
            state[SIDE] = side
            state[PHI] = phi
            state[PSI] = psi
            state[RATE] = v
            state[E11] = (timing * v) ** 2
            state[E12] = 0.0
            state[E22] = spread * spread
            return FULL
        half = math.sin(0.5 * psi)
        ahead = v - 2.0 * half if model == FULL_EQUATION else v - growth(model, alpha) * psi
        falling = ahead > 0.0
        if falling:
            x = fall(model, alpha, psi, v)
            peak = HALF_TURN
            rate = 0.0
        elif phi == 0.0:
            x = bounce(model, alpha, series, v)
            rate = v
            peak = _height(model, alpha, v, base)
        else:
            x, rate, peak = strike(model, alpha, psi, v)
        stuck = x > LONGEST_FLIGHT
        if stuck:
            x = LONGEST_FLIGHT
        row = rows[n]
        row[:] = 0.0
        row[START] = t
        row[LENGTH] = x
        row[ROW_SIDE] = side
        row[PHI0] = phi
        row[V0] = v
        row[K0] = psi if model == FULL_EQUATION else acceleration(model, alpha, phi, psi, 0.0)
        row[MU] = growth(model, alpha) ** 2
        n += 1
        used[0] = n
        until = t + x / p
        if until > end or stuck:
            cut = min(until, end)
            phi, psi, v = _later(model, alpha, row, p * (cut - t))
            state[PEAK] = max(state[PEAK], peak if v <= 0.0 and not falling else phi)
            state[TIME] = cut
            state[PHI] = phi
            state[PSI] = psi
            state[RATE] = v
            state[SIDE] = side
            return STUCK if stuck and until <= end else REACHED
        t = until
        if falling:
            state[TIME] = t
            state[PHI] = HALF_TURN
            state[PSI] = c - HALF_TURN
            state[PEAK] = HALF_TURN
            state[SIDE] = side
            _, _, rate = _later(model, alpha, row, x)
            state[RATE] = rate
            if first:
                timing = _timing(model, alpha, state, psi, v, x, falling)
            state[WORST] = max(state[WORST], min(timing * rate, 1.0))
            return FELL

        state[PEAK] = max(state[PEAK], peak)
        if first:
            # The error of the first strike is that of its rate and of its instant.
            _, by_phi, by_v = margin_slopes(model, alpha, psi, v)
            spread = _deviation(state, by_phi, by_v) + EPSILON * rate
            timing = _timing(model, alpha, state, psi, v, x, falling)
            state[WORST] = max(state[WORST], min(timing * rate, 1.0))
            first = False
        else:
            if earlier > 0.0 and earlier > rate:
                timing += abs(earlier_time - x) / (earlier - rate) * spread
            timing += EPSILON * x
            spread *= eta
            state[WORST] = max(state[WORST], min(timing * rate, 1.0))
        earlier = rate
        earlier_time = x if phi == 0.0 else 0.0
        if earlier_time == 0.0:
            earlier = 0.0

        impacts[0, n - 1] = t
        impacts[1, n - 1] = -side * p * rate
        side = -side
        phi = 0.0
        psi = c
        v = eta * rate
        if v < REST_RATE:
            left = time_to_rest(model, alpha, eta, v)
            if not math.isinf(left) and t + left / p <= end:
                state[TIME] = t + left / p
                state[SIDE] = 0.0
                state[PHI] = 0.0
                state[PSI] = c
                state[RATE] = 0.0
                state[E11] = 0.0
                state[E12] = 0.0
                state[E22] = 0.0
                state[AT_REST] = state[TIME]
                return CAME_TO_REST


@compiled
def _height(model: int, alpha: float, v: float, base: float) -> float:
    """Return the rotation at the top of a flight that leaves the contact at v, without cancellation."""
    if model == FULL_EQUATION:
        k = math.sqrt(max(0.0, (0.5 * base - 0.5 * v) * (0.5 * base + 0.5 * v)))
        turn = 2.0 * math.asin(k)
        return 4.0 * math.asin(v * v / (4.0 * (0.5 * base + k)) / (2.0 * math.cos(0.25 * (alpha + turn))))
    lam = growth(model, alpha)
    w = v / lam
    c = centre(model, alpha)
    return w * w / (c + math.sqrt(max(0.0, (c - w) * (c + w))))


@compiled
def _later(model: int, alpha: float, row: FloatArray, x: float) -> tuple[float, float, float]:
    """Return phi, psi and v after x of a flight."""
    if model == FULL_EQUATION:
        return position(alpha, row[PHI0], row[K0], row[V0], x)
    moved, v, _ = motion(row, x)
    phi = row[PHI0] + moved
    return phi, (-row[K0] / row[MU]) - moved, v


@compiled
def _timing(model: int, alpha: float, state: FloatArray, psi: float, v: float, x: float, falling: bool) -> float:
    """Return the deviation of the time x a flight takes, from the state's error and one rounding of psi."""
    nudge = NUDGE * (abs(psi) + abs(v))
    if falling:
        by_psi = fall(model, alpha, psi - nudge, v) - x
        by_v = fall(model, alpha, psi, v + nudge) - x
    else:
        by_psi = strike(model, alpha, psi + nudge, v)[0] - x
        by_v = strike(model, alpha, psi, v - nudge)[0] - x
    if not (math.isfinite(by_psi) and math.isfinite(by_v) and nudge > 0.0):
        return 1.0
    by_psi /= nudge
    rounding = abs(by_psi) * EPSILON * 0.25 * alpha
    return _deviation(state, by_psi, by_v / nudge) + rounding + EPSILON * x


@compiled
def _deviation(state: FloatArray, by_phi: float, by_v: float) -> float:
    variance = by_phi * by_phi * state[E11] + 2.0 * by_phi * by_v * state[E12] + by_v * by_v * state[E22]
    return math.sqrt(max(0.0, variance))


@compiled
def evaluate_flights(
    model: int, alpha: float, rows: FloatArray, times: FloatArray, p: float, rotation: FloatArray, rate: FloatArray
) -> None:
    """Write rotation (rad) and angular velocity (rad/s) at `times` (s) from rows of flights."""
    for i in range(times.size):
        row = rows[row_at(rows, times[i])]
        x = min(max(p * (times[i] - row[START]), 0.0), row[LENGTH])
        phi, _, v = _later(model, alpha, row, x)
        rotation[i] = row[ROW_SIDE] * phi
        rate[i] = row[ROW_SIDE] * v * p


def flight_rows(count: int) -> tuple[FloatArray, FloatArray]:
    """Return the arrays `run_free` writes impacts and flights into."""
    return np.empty((2, count)), np.empty((count, COLUMNS))
