"""One Taylor step of sixteen cells in lock step, with a bound of its error and of where it can have been.

The equation and its series are those of series.py, in a lower order and in time tau = p t:

    phi'' = -sin(psi) - f cos(psi),   psi = alpha - phi,   f = s (c0 + c1 d + A sin(w d + q)) / g,   d = tau - tau0.

The error is a shift T of the whole course in time, plus (e, e'). With K >= |cos(psi) - f sin(psi)| = k^2 and
D >= |df/dtau|, comparison with y'' = K y + T D bounds it after h by

    e cosh(k h) + (e' + T D h / 2) h sinh(k h) / (k h)   and   e k sinh(k h) + (e' + T D h) cosh(k h),

to which each step adds eight times its last two terms and its rounding. An impact that comes early or late only shifts
what follows, so that T holds most of the error (`batch_contact`). Sines and cosines: fdlibm's kernels.
"""

from __future__ import annotations

from typing import Any

from twin.rocking.batch.compiled import lent
from twin.rocking.batch.lanes import (
    above,
    larger,
    load,
    magnitude,
    multiply_add,
    rough_root,
    smaller,
    spread,
    store,
    turned,
)
from twin.rocking.compiled import FloatArray

ORDER = 12
# Rounding of a step, relative to 1 rad and to the sum of its terms.
ROUNDING = 1e-15

# Rows of a lane's numbers. State; piece of base motion (per g, in units of 1/p); what the last step found.
(TAU, SIDE, PHI, PSI, RATE, ERROR, RATE_ERROR, SHIFT) = range(8)
(BEGIN, FINISH, C0, C1, AMPLITUDE, OMEGA, PHASE, STRONGEST, STEEPEST, BARRIER) = range(8, 18)
(LENGTH, START, START_ERROR, START_RATE_ERROR, NOTICED) = range(18, 23)
(SINE, COSINE, HALF_SINE) = range(23, 26)  # of alpha, and sin(alpha / 2): the same in all lanes
COEFFICIENTS = 26
SINES = COEFFICIENTS + ORDER + 1
COSINES = SINES + ORDER
MOVED = COSINES + ORDER
FORCE = MOVED + ORDER + 1
# The rate, units of p, below which a rebound counts as rest, and what such rests have left out: an error of the rate.
FAINT = FORCE + ORDER
RESIDUE = FAINT + 1
ROWS = RESIDUE + 1
# What a lane's step may have met: nothing; the piece's end; contact or pi/2, to be looked at; a fall for good.
ENDED, LOOK, LOST = 1.0, 2.0, 3.0
# An error beyond this is not carried on: the cell goes to the accurate method.
LARGEST_ERROR = 1e-4
# A rotation that may have reached this is compared with pi/2, rad.
NEARLY_FLAT = 1.57
# Coefficients after the highest: of (sin(r) / r - 1) / r^2 and of (cos(r) - 1) / r^2 (fdlibm), and of cosh(y) and
# sinh(y) / y in y^2, whose highest is doubled so that the sum is above the function.
SINE_TERMS = (
    -2.50507602534068634195e-08,
    2.75573137070700676789e-06,
    -1.98412698298579493134e-04,
    8.33333333332248946124e-03,
    -1.66666666666666324348e-01,
)
COSINE_TERMS = (
    2.08757232129817482790e-09,
    -2.75573143513906633035e-07,
    2.48015872894767294178e-05,
    -1.38888888888741095749e-03,
    4.16666666666666019037e-02,
    -0.5,
)
COSH_TERMS = (1.0 / 720.0, 1.0 / 24.0, 0.5, 1.0)
SINH_TERMS = (1.0 / 5040.0, 1.0 / 120.0, 1.0 / 6.0, 1.0)


@lent
def sine_cosine(x: Any) -> tuple[Any, Any]:
    """Return sine and cosine of each lane, to one rounding for |x| below 1e5."""
    shifted = multiply_add(x, spread(0.6366197723675814), spread(6755399441055744.0))
    n = shifted - 6755399441055744.0
    r = multiply_add(n, spread(-1.57079632673412561417), x)
    r = multiply_add(n, spread(-6.07710050650619224932e-11), r)
    z = r * r
    s = spread(1.58969099521155010221e-10)
    for factor in SINE_TERMS:
        s = multiply_add(z, s, spread(factor))
    c = spread(-1.13596475577881948265e-11)
    for factor in COSINE_TERMS:
        c = multiply_add(z, c, spread(factor))
    return turned(shifted, multiply_add(z * r, s, r), multiply_add(z, c, spread(1.0)))


@lent
def series(m: FloatArray) -> None:
    """Write the coefficients of phi about the lanes' present time."""
    side = load(m, SIDE)
    d = load(m, TAU) - load(m, BEGIN)
    w = load(m, OMEGA)
    sine, cosine = sine_cosine(multiply_add(w, d, load(m, PHASE)))
    power = side * load(m, AMPLITUDE)
    for k in range(0, ORDER, 2):
        sign = 1.0 - (k % 4)
        store(m, FORCE + k, power * sine * sign)
        power = power * w * (1.0 / (k + 1))
        store(m, FORCE + k + 1, power * cosine * sign)
        power = power * w * (1.0 / (k + 2))
    slope = side * load(m, C1)
    store(m, FORCE, load(m, FORCE) + side * load(m, C0) + slope * d)
    store(m, FORCE + 1, load(m, FORCE + 1) + slope)

    sine, cosine = sine_cosine(load(m, PSI))
    rate = load(m, RATE)
    store(m, SINES, sine)
    store(m, COSINES, cosine)
    store(m, COEFFICIENTS, load(m, PHI))
    store(m, COEFFICIENTS + 1, rate)
    store(m, MOVED + 1, rate * -1.0)
    pull = multiply_add(load(m, FORCE), cosine, sine)
    for k in range(1, ORDER):
        following = pull * (-1.0 / (k * (k + 1)))
        store(m, COEFFICIENTS + k + 1, following)
        store(m, MOVED + k + 1, following * -(k + 1.0))
        if k == ORDER - 1:
            break
        moved = load(m, MOVED + k)
        sines = moved * cosine
        cosines = moved * sine
        pull = load(m, FORCE + k) * cosine
        for j in range(1, k):
            moved = load(m, MOVED + j)
            other = load(m, COSINES + k - j)
            sines = multiply_add(moved, other, sines)
            cosines = multiply_add(moved, load(m, SINES + k - j), cosines)
            pull = multiply_add(load(m, FORCE + j), other, pull)
        sines = sines * (1.0 / k)
        cosines = cosines * (-1.0 / k)
        store(m, SINES + k, sines)
        store(m, COSINES + k, cosines)
        pull = multiply_add(load(m, FORCE), cosines, pull + sines)


@lent
def advance(m: FloatArray, tolerance: float) -> None:
    """Take every lane one step on, as far as its piece lasts, and write into `NOTICED` what may have happened in it.

    The last two terms of a step stay below about `tolerance`, rad. Where `NOTICED` is LOOK, the step began at `START`
    and has to be undone from there if it met something.
    """
    series(m)
    last = magnitude(load(m, COEFFICIENTS + ORDER))
    before = magnitude(load(m, COEFFICIENTS + ORDER - 1))
    tiny = spread(1e-250)
    h = spread(0.9) / larger(
        rough_root(larger(last * (1.0 / tolerance), tiny), spread(1.0 / ORDER)),
        rough_root(larger(before * (1.0 / tolerance), tiny), spread(1.0 / (ORDER - 1))),
    )
    h = smaller(h, spread(1.0))
    start = load(m, TAU)
    finish = load(m, FINISH)
    going_on = above(finish - start, h)
    h = smaller(h, finish - start)
    store(m, START, start)
    store(m, LENGTH, h)
    store(m, TAU, going_on * (start + h) + (1.0 - going_on) * finish)

    zero = spread(0.0)
    moved = load(m, COEFFICIENTS + ORDER)
    rate = moved * float(ORDER)
    travel = last
    # Upwards bend and downwards slope alone: what can take phi under its chord, or under its start.
    top = load(m, COEFFICIENTS + ORDER)
    bend = last * float(ORDER * (ORDER - 1))
    bend_up = larger(top, zero) * float(ORDER * (ORDER - 1))
    fall = smaller(top, zero)
    lift = zero
    power = h
    for k in range(ORDER - 1, 0, -1):
        c = load(m, COEFFICIENTS + k)
        size = magnitude(c)
        moved = multiply_add(moved, h, c)
        rate = multiply_add(rate, h, c * float(k))
        travel = multiply_add(travel, h, size)
        if k > 1:
            bend = multiply_add(bend, h, size * float(k * (k - 1)))
            bend_up = multiply_add(bend_up, h, larger(c, zero) * float(k * (k - 1)))
            fall = multiply_add(fall, h, smaller(c, zero))
            power = power * h
        else:
            fall = multiply_add(fall, h, c)
        if k == 4:
            lift = multiply_add(fall, h, load(m, COEFFICIENTS + 3))
    # The last two terms are |c_N| h^N and |c_(N-1)| h^(N-1), and `power` is h^(N-1).
    dropped = multiply_add(last, h, before) * power * 8.0 + (travel + 1.0) * ROUNDING
    phi = load(m, PHI)
    moved = moved * h
    phi_next = phi + moved
    psi_next = load(m, PSI) - moved
    store(m, PHI, phi_next)
    store(m, PSI, psi_next)
    store(m, RATE, rate)

    error = load(m, ERROR)
    rate_error = load(m, RATE_ERROR)
    swing = smaller(multiply_add(travel, h, magnitude(load(m, SINES)) + error), spread(1.0))
    stiffness = multiply_add(load(m, STRONGEST), swing, spread(1.0))
    x = stiffness * h * h
    cosh = spread(2.0 / 40320.0)
    sinh = spread(2.0 / 362880.0)
    for factor in COSH_TERMS:
        cosh = multiply_add(x, cosh, spread(factor))
    for factor in SINH_TERMS:
        sinh = multiply_add(x, sinh, spread(factor))
    shift = load(m, SHIFT)
    pushed = shift * load(m, STEEPEST) * h
    error_next = error * cosh + (rate_error + pushed * 0.5) * h * sinh + dropped
    rate_error_next = error * stiffness * h * sinh + (rate_error + pushed) * cosh + dropped * (float(ORDER) / h)
    store(m, START_ERROR, error)
    store(m, START_RATE_ERROR, rate_error)
    store(m, ERROR, error_next)
    store(m, RATE_ERROR, rate_error_next)

    # phi >= chord - max(phi'') h^2 / 8, and phi >= phi0 + tau (c1 + sum of min(c_k, 0) h^(k-1)): either clears it,
    # and, where it lifts at the threshold (c1 = c2 = 0), phi >= tau^3 (c3 + sum of min(c_k, 0) h^(k-3)).
    blur = error_next * 2.0
    eighth = h * h * 0.125
    look = above(multiply_add(bend_up, eighth, blur), smaller(phi, phi_next))
    enough = blur / h + rate_error_next * 2.0
    look = smaller(look, above(enough, fall))
    start_rate = load(m, COEFFICIENTS + 1)
    bending = above(magnitude(load(m, COEFFICIENTS + 2)), spread(1e-15))
    look = smaller(look, larger(larger(bending, above(start_rate, zero)), above(enough, lift * h * h)))
    blur = blur + shift * 2.0 * multiply_add(bend, h, magnitude(start_rate))
    look = larger(look, above(multiply_add(bend, eighth, larger(phi, phi_next)) + blur, spread(NEARLY_FLAT)))
    look = larger(look, above(error_next + shift, spread(LARGEST_ERROR)))
    # Past the angle where the strongest push still to come cannot turn it, and going outwards.
    lost = smaller(above(load(m, BARRIER), psi_next + blur), above(rate, (rate_error_next + shift * bend) * 2.0))
    store(m, NOTICED, larger(larger(1.0 - going_on, lost * (1.0 - look) * LOST), look * LOOK))
