"""Sixteen futures one interval of base motion on, in lock step: a short Taylor series, impacts and uplifts in lanes.

The equation is that of `twin.rocking.series`, in time tau = p t, with the base's a / g as a cubic of the time since the
interval began (`twin.forecast.course`):

    phi'' = -sin(psi) - s f cos(psi),   psi = alpha - phi,   f = k0 + k1 d + k2 d^2 + k3 d^3.

All lanes share the base; slenderness, restitution and state are each lane's own. There is no bound of the error here,
as in `twin.rocking.batch`: a future is wanted to about 1e-5 rad, and `tests/benchmarks/forecast_cycle.py` compares it
with the exact solver. A lane that meets the base or lifts within the interval goes on from there in another round.

While the base is still (f = 0) an interval may be of any length, and each lane crosses it in steps of its own. Where
its impacts end before the interval does, it comes to rest at once. A flight that begins with the rate v lasts at most
2 v / sin(alpha) * artanh(x) / x with x = v / sqrt(alpha sin(alpha)) < 1, as long as it would under the linear pull
psi sin(alpha) / alpha, which is weaker than sin(psi); the next one begins with eta v: what is left is less than the sum
of a geometric series.
"""

from __future__ import annotations

import math
from typing import Any

from twin.forecast.compiled import lent
from twin.forecast.course import K0, K1, K2, K3, LONGEST, STRONGEST
from twin.rocking.batch.lanes import (
    above,
    chosen,
    larger,
    load,
    magnitude,
    marked,
    multiply_add,
    smaller,
    spread,
    store,
)
from twin.rocking.compiled import FloatArray

HALF_TURN = 0.5 * math.pi

# Rows of a group of lanes. State; block; what became of it (time tau of pi/2; whether it lay, or ever rocked).
(SIDE, PHI, RATE, OFFSET, ALPHA, RESTITUTION, THRESHOLD, SINE, COSINE, FELL_AT, FALLEN, ROCKED) = range(12)
ROWS = 12
# A rebound slower than this, units of p, where gravity holds the block down: rest. It would rise by less than
# v^2 / (2 HELD sin(alpha)), some 1e-4 rad of a slender block.
REST_RATE = 3e-4
HELD = 0.1
# For the bound above: largest x, and 2 artanh(x) / x there.
CALM = 0.8
FLIGHT = 2.0 * math.atanh(CALM) / CALM
# Newton's steps at a contact or at pi/2; the step's own end is the start, so that each squares what is left.
NEWTON_STEPS = 5

# Coefficients of sin(x) / x and cos(x) in x^2, highest first: below 1e-9 for |x| up to pi/2.
SINE_TERMS = (-1.0 / 39916800.0, 1.0 / 362880.0, -1.0 / 5040.0, 1.0 / 120.0, -1.0 / 6.0, 1.0)
COSINE_TERMS = (1.0 / 479001600.0, -1.0 / 3628800.0, 1.0 / 40320.0, -1.0 / 720.0, 1.0 / 24.0, -0.5, 1.0)
SINE_FIRST = 1.0 / 6227020800.0
COSINE_FIRST = -1.0 / 87178291200.0


@lent
def sine_cosine(x: Any) -> tuple[Any, Any]:
    """Return sine and cosine of each lane, |x| at most pi/2."""
    z = x * x
    s = spread(SINE_FIRST)
    for factor in SINE_TERMS:
        s = multiply_add(z, s, spread(factor))
    c = spread(COSINE_FIRST)
    for factor in COSINE_TERMS:
        c = multiply_add(z, c, spread(factor))
    return s * x, c


@lent
def advance(m: FloatArray, row: FloatArray, start: float, length: float) -> tuple[int, int]:
    """Take the moving lanes on to `length` after the interval's start, or to what they meet before.

    Parameters
    ----------
    m : ndarray, shape (ROWS, WIDTH)
    row : ndarray, shape (COLUMNS,)
        The interval, see `twin.forecast.course`; its start and length are those given.
    start, length : float
        1/p.

    Returns
    -------
    tuple of int
        Bits of the lanes that are not at the end yet, and of those that met the base.
    """
    still = row[STRONGEST] == 0.0
    reach = LONGEST if still else length
    side = load(m, SIDE)
    phi = load(m, PHI)
    v = load(m, RATE)
    offset = load(m, OFFSET)
    zero = spread(0.0)
    moving = above(magnitude(side), load(m, FALLEN))
    ahead = larger(spread(length) - offset, zero)
    short = smaller(moving, above(ahead, spread(reach)))
    h = chosen(moving, smaller(ahead, spread(reach)), zero)

    k0, k1, k2, k3 = spread(row[K0]), spread(row[K1]), spread(row[K2]), spread(row[K3])
    f0 = side * multiply_add(multiply_add(multiply_add(k3, offset, k2), offset, k1), offset, k0)
    f1 = side * multiply_add(multiply_add(k3 * 3.0, offset, k2 * 2.0), offset, k1)
    f2 = side * multiply_add(k3 * 3.0, offset, k2)
    f3 = side * k3

    # S_k and C_k of series.py, written out.
    s0, c0 = sine_cosine(load(m, ALPHA) - phi)
    a2 = multiply_add(f0, c0, s0) * -0.5
    s1 = zero - v * c0
    c1 = v * s0
    a3 = (s1 + multiply_add(f0, c1, f1 * c0)) * (-1.0 / 6.0)
    w2 = a2 * -2.0
    s2 = (w2 * c0 - v * c1) * 0.5
    c2 = (v * s1 - w2 * s0) * 0.5
    a4 = (s2 + multiply_add(f0, c2, multiply_add(f1, c1, f2 * c0))) * (-1.0 / 12.0)
    w3 = a3 * -3.0
    s3 = (multiply_add(w2, c1, w3 * c0) - v * c2) * (1.0 / 3.0)
    c3 = (v * s2 - multiply_add(w2, s1, w3 * s0)) * (1.0 / 3.0)
    a5 = (s3 + multiply_add(f0, c3, multiply_add(f1, c2, multiply_add(f2, c1, f3 * c0)))) * (-1.0 / 20.0)
    w4 = a4 * -4.0
    s4 = (multiply_add(w2, c2, multiply_add(w3, c1, w4 * c0)) - v * c3) * 0.25
    c4 = (v * s3 - multiply_add(w2, s2, multiply_add(w3, s1, w4 * s0))) * 0.25
    a6 = (s4 + multiply_add(f0, c4, multiply_add(f1, c3, multiply_add(f2, c2, f3 * c1)))) * (-1.0 / 30.0)

    end = _value(phi, v, a2, a3, a4, a5, a6, h)
    rate = _slope(v, a2, a3, a4, a5, a6, h)
    # Down and up again within the step: the lowest point, where a straight line through the rates is zero.
    turns = smaller(above(zero, v), above(rate, zero))
    low = end
    until = h
    if marked(turns):
        until = chosen(turns, h * v / chosen(turns, v - rate, spread(1.0)), h)
        low = _value(phi, v, a2, a3, a4, a5, a6, until)
        until = chosen(above(low, zero), h, until)
    struck = smaller(above(h, zero), 1.0 - above(smaller(low, end), zero))
    over = smaller(above(end, spread(HALF_TURN)), 1.0 - struck)
    store(m, PHI, end)
    store(m, RATE, rate)
    store(m, OFFSET, chosen(moving, chosen(short, offset + h, spread(length)), offset))
    met_base = marked(struck)
    on = marked(short)
    if met_base:
        # Divided by its known root where it starts on the contact, so that this is not found again.
        touching = 1.0 - above(phi, zero)
        b0 = chosen(touching, v, phi)
        b1 = chosen(touching, a2, v)
        b2 = chosen(touching, a3, a2)
        b3 = chosen(touching, a4, a3)
        b4 = chosen(touching, a5, a4)
        b5 = chosen(touching, a6, a5)
        b6 = chosen(touching, zero, a6)
        x = _root(b0, b1, b2, b3, b4, b5, b6, zero, chosen(struck, until, spread(1.0)))
        before = smaller(_slope(v, a2, a3, a4, a5, a6, x), zero)
        after = before * load(m, RESTITUTION) * -1.0
        met = offset + x
        f = multiply_add(multiply_add(multiply_add(k3, met, k2), met, k1), met, k0)
        sine = load(m, SINE)
        rests = smaller(above(spread(REST_RATE), after), above(sine - magnitude(f) * load(m, COSINE), sine * HELD))
        again = struck
        if still:
            left = (1.0 - load(m, RESTITUTION)) * (spread(length) - met)
            ends = smaller(above(sine * left, after * FLIGHT), above(load(m, ALPHA) * sine * CALM**2, after * after))
            rests = larger(rests, ends)
            again = smaller(struck, 1.0 - rests)
        store(m, PHI, chosen(struck, zero, end))
        store(m, RATE, chosen(struck, chosen(rests, zero, after), rate))
        store(m, SIDE, chosen(struck, chosen(rests, zero, side * -1.0), side))
        store(m, OFFSET, chosen(struck, met, load(m, OFFSET)))
        on = marked(larger(again, smaller(short, 1.0 - struck)))
    if marked(over):
        x = _root(
            spread(HALF_TURN) - phi,
            v * -1.0,
            a2 * -1.0,
            a3 * -1.0,
            a4 * -1.0,
            a5 * -1.0,
            a6 * -1.0,
            zero,
            chosen(over, h, spread(1.0)),
        )
        store(m, PHI, chosen(over, spread(HALF_TURN), load(m, PHI)))
        store(m, FALLEN, chosen(over, spread(1.0), load(m, FALLEN)))
        store(m, FELL_AT, chosen(over, offset + x + start, load(m, FELL_AT)))
    return on, met_base


@lent
def lift(m: FloatArray, row: FloatArray, length: float) -> int:
    """Start the resting lanes that the base lifts within the interval; the others rest to its end.

    The first of five points of the interval beyond the threshold closes in on the crossing, by false position.
    """
    zero = spread(0.0)
    side = load(m, SIDE)
    offset = load(m, OFFSET)
    resting = 1.0 - above(magnitude(side), zero)
    threshold = load(m, THRESHOLD)
    k0, k1, k2, k3 = spread(row[K0]), spread(row[K1]), spread(row[K2]), spread(row[K3])
    right = offset
    f = multiply_add(multiply_add(multiply_add(k3, right, k2), right, k1), right, k0)
    beyond = above(magnitude(f), threshold)
    left = offset
    below = magnitude(f) - threshold
    high = below
    force = f
    for k in range(1, 5):
        x = offset + (spread(length) - offset) * (0.25 * k)
        f = multiply_add(multiply_add(multiply_add(k3, x, k2), x, k1), x, k0)
        excess = magnitude(f) - threshold
        now = above(excess, zero)
        # Not beyond yet: the bracket moves on, and closes where it first is.
        left = chosen(smaller(1.0 - beyond, 1.0 - now), x, left)
        below = chosen(smaller(1.0 - beyond, 1.0 - now), excess, below)
        right = chosen(beyond, right, x)
        high = chosen(beyond, high, excess)
        force = chosen(beyond, force, f)
        beyond = larger(beyond, now)
    lifts = smaller(resting, beyond)
    if marked(lifts) == 0:
        store(m, OFFSET, chosen(resting, spread(length), offset))
        return 0
    x = right
    for _ in range(4):
        gap = right - left
        span = high - below
        x = chosen(above(span, zero), left - gap * below / chosen(above(span, zero), span, spread(1.0)), right)
        f = multiply_add(multiply_add(multiply_add(k3, x, k2), x, k1), x, k0)
        excess = magnitude(f) - threshold
        now = above(excess, zero)
        right = chosen(now, x, right)
        high = chosen(now, excess, high)
        left = chosen(now, left, x)
        below = chosen(now, below, excess)
    away = chosen(above(force, zero), spread(-1.0), spread(1.0))
    store(m, SIDE, chosen(lifts, away, side))
    store(m, ROCKED, chosen(lifts, spread(1.0), load(m, ROCKED)))
    store(m, OFFSET, chosen(lifts, x, chosen(resting, spread(length), offset)))
    return marked(lifts)


@lent
def _value(b0: Any, b1: Any, b2: Any, b3: Any, b4: Any, b5: Any, b6: Any, x: Any) -> Any:
    y = multiply_add(b6, x, b5)
    y = multiply_add(y, x, b4)
    y = multiply_add(y, x, b3)
    y = multiply_add(y, x, b2)
    y = multiply_add(y, x, b1)
    return multiply_add(y, x, b0)


@lent
def _slope(b1: Any, b2: Any, b3: Any, b4: Any, b5: Any, b6: Any, x: Any) -> Any:
    y = multiply_add(b6 * 6.0, x, b5 * 5.0)
    y = multiply_add(y, x, b4 * 4.0)
    y = multiply_add(y, x, b3 * 3.0)
    y = multiply_add(y, x, b2 * 2.0)
    return multiply_add(y, x, b1)


@lent
def _root(b0: Any, b1: Any, b2: Any, b3: Any, b4: Any, b5: Any, b6: Any, left: Any, right: Any) -> Any:
    """Return where the polynomial, above zero at `left`, first falls through zero: Newton from the `right`."""
    x = right
    for _ in range(NEWTON_STEPS):
        y = _value(b0, b1, b2, b3, b4, b5, b6, x)
        d = _slope(b1, b2, b3, b4, b5, b6, x)
        x = smaller(larger(x - y / smaller(d, spread(-1e-12)), left), right)
    return x
