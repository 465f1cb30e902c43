"""How far the nonlinear motion can be from a simpler model's over one flight between two contacts.

Write F(phi, f) = -sin(alpha - phi) - f cos(alpha - phi) for the nonlinear acceleration and F0 for the simpler one. Both
flights are counted from their own first instant; the nonlinear block left delta1 +- rho_delta later than the simpler
one. With e the difference of the rotations, x the simpler one and f1 the base motion delta1 later,

    e'' = [F(x, f1) - F0(x, f)] + F_phi(x, f1) e + r,    |r| <= |F_phi_phi| e2 / 2 + |f'| rho_delta.

The bracket, the defect, is known along the simpler motion: the nonlinear equation is evaluated, never solved. e1, the
solution without r, is carried forward together with a majorant rho of what r adds, |e - e1| <= rho:

    e1'' = defect + k e1,    rho'' = |k| rho + 1/2 M (|e1| + rho)2 + |f'| rho_delta,    k = F_phi(x, f1),

M >= |F_phi_phi| within |e1| + rho of x. (A defect bound with Gronwall's majorant: Hairer, Norsett & Wanner, Solving
Ordinary Differential Equations I, 1993, section I.10; the first-order part is taken out so that gravity's and the base
motion's shares of the defect may cancel.) The classical Runge-Kutta rule carries both; its own error is below 1e-6 of
them at the steps used here, and `PADDING` covers it.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled

LONGEST = 0.02
"""Longest step, units of 1/p."""
LEAST_STEPS = 120
"""Least number of steps in a flight: the peak of a short one is looked for as finely as that of a long one."""
LONGEST_ANGLE = 0.1
"""Longest step, rad of the base motion's phase."""
PADDING = 1.02
"""Factor on every bound, for the rounding and truncation of the bound's own arithmetic."""

# Columns of the rows that `carry_defect` goes through, one per step.
LENGTH, X0, FS0, FT0, STEEP, JUMP = 0, 1, 4, 7, 10, 11
COLUMNS = 12
# What is carried: e1, e1', rho, rho'.
CARRIED = 4
# What comes out besides: bounds of the nonlinear peak, from above and from below.
HIGHEST, LOWEST = range(2)


@compiled
def _simple(x: float, f: float, body: FloatArray) -> float:
    """Return the simpler model's acceleration."""
    if body[1] == 0.0:
        return x - body[0] - f
    # Small rotation only: sin(alpha - x) = S - C x, cos(alpha - x) = C + S x.
    return -(body[2] - body[3] * x) - f * (body[3] + body[2] * x)


@compiled
def _slopes(y: FloatArray, x: float, fs: float, ft: float, steep: float, body: FloatArray, out: FloatArray) -> None:
    alpha = body[0]
    s = math.sin(alpha - x)
    c = math.cos(alpha - x)
    k = c - ft * s
    reach = abs(y[0]) + y[2]
    bend = abs(s + ft * c) + math.sqrt(1.0 + ft * ft) * reach
    out[0] = y[1]
    out[1] = (-s - ft * c - _simple(x, fs, body)) + k * y[0]
    out[2] = y[3]
    out[3] = abs(k) * y[2] + 0.5 * bend * reach * reach + steep


@compiled
def carry_defect(rows: FloatArray, body: FloatArray, margin: float, y: FloatArray, out: FloatArray) -> bool:
    """Carry (e1, e1', rho, rho') in `y` through the rows; return whether the nonlinear block is proved to fly.

    Parameters
    ----------
    rows : ndarray, shape (n, COLUMNS)
        Step length; x, f, f1 at its start, middle and end; |f1'| rho_delta over it; jump of f1 times rho_delta at its
        start. In units of rad and 1/p.
    body : ndarray, shape (4,)
        alpha; 0 for the linearised model, 1 for the quasi-linear one; sin and cos of alpha.
    margin : float
        How much of either end of the flight, units of 1/p, is left to the caller's argument that the block flies.
    out : ndarray, shape (2,)
        HIGHEST and LOWEST, raised in place. Between the three points of a step x stays below the largest of them by
        its acceleration times h2 / 32, or less.
    """
    k1, k2, k3, k4 = np.zeros(4), np.zeros(4), np.zeros(4), np.zeros(4)
    total = 0.0
    for i in range(rows.shape[0]):
        total += rows[i, LENGTH]
    gone = 0.0
    for i in range(rows.shape[0]):
        row = rows[i]
        h = row[LENGTH]
        y[3] += row[JUMP]
        e = y[0]
        _slopes(y, row[X0], row[FS0], row[FT0], row[STEEP], body, k1)
        _slopes(y + 0.5 * h * k1, row[X0 + 1], row[FS0 + 1], row[FT0 + 1], row[STEEP], body, k2)
        _slopes(y + 0.5 * h * k2, row[X0 + 1], row[FS0 + 1], row[FT0 + 1], row[STEEP], body, k3)
        _slopes(y + h * k3, row[X0 + 2], row[FS0 + 2], row[FT0 + 2], row[STEEP], body, k4)
        for j in range(CARRIED):
            y[j] += h / 6.0 * (k1[j] + 2.0 * k2[j] + 2.0 * k3[j] + k4[j])
        gone += h
        x = row[X0 + 2]
        rho = PADDING * y[2]
        curve = 1.1 * max(abs(_simple(row[X0], row[FS0], body)), abs(_simple(x, row[FS0 + 2], body)))
        top = max(row[X0], row[X0 + 1], x) + h * h / 32.0 * curve + max(e, y[0]) + rho
        out[HIGHEST] = max(out[HIGHEST], top)
        out[LOWEST] = max(out[LOWEST], x + y[0] - rho)
        if margin < gone < total - margin and x + y[0] - rho <= 0.0:
            return False
        if not abs(y[0]) + rho < 0.5:
            return False
    return True


def step_rows(
    pieces: FloatArray,
    gravity: float,
    p: float,
    side: float,
    start: float,
    end: float,
    late: float,
    unsure: float,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the rows of a flight with x still to be filled in, and the times to know it at.

    Parameters
    ----------
    pieces : ndarray, shape (n, 7)
        Contiguous, the last one unbounded.
    start, end : float
        The simpler flight, s.
    late, unsure : float
        delta1 and rho_delta, s.

    Returns
    -------
    rows : ndarray, shape (m, COLUMNS)
    times : ndarray, shape (m, 3)
        Start, middle and end of each step, s, in the simpler model's time.
    jumps : ndarray, shape (k, 2)
        Every break of the base motion: its time in the simpler flight, s, and the size of its jump (of f).
    """
    inner = pieces[1:, 0]
    sizes = np.abs(_f(pieces[1:], inner) - _f(pieces[:-1], inner)) / gravity
    cuts = np.concatenate([[start, end], inner, inner - late])
    cuts = np.unique(cuts[(cuts >= start) & (cuts <= end)])
    middle = 0.5 * (cuts[1:] + cuts[:-1])
    simple = pieces[np.searchsorted(inner, middle, side="right")]
    real = pieces[np.searchsorted(inner, middle + late, side="right")]
    fastest = np.maximum(simple[:, 5] * (simple[:, 4] != 0.0), real[:, 5] * (real[:, 4] != 0.0))
    width = np.diff(cuts)
    longest = min(LONGEST, p * (end - start) / LEAST_STEPS)
    count = np.maximum(np.ceil(np.maximum(p * width / longest, fastest * width / LONGEST_ANGLE)), 1).astype(np.intp)
    owner = np.repeat(np.arange(count.size), count)
    place = np.arange(owner.size) - (np.cumsum(count) - count)[owner]
    h = (width / count)[owner]
    left = cuts[:-1][owner] + place * h
    times = np.stack([left, left + 0.5 * h, left + h], axis=1)
    rows = np.zeros((owner.size, COLUMNS))
    rows[:, LENGTH] = p * h
    for j in range(3):
        rows[:, FS0 + j] = side / gravity * _f(simple[owner], times[:, j])
        rows[:, FT0 + j] = side / gravity * _f(real[owner], times[:, j] + late)
    steep = np.abs(pieces[:, 3]) + np.abs(pieces[:, 4] * pieces[:, 5])
    steep = np.maximum(steep, np.maximum(np.append(steep[1:], 0.0), np.append(0.0, steep[:-1]))) / gravity
    rows[:, STEEP] = (steep[np.searchsorted(inner, middle + late, side="right")] * unsure)[owner]
    # A jump of the base motion comes rho_delta sooner or later: an impulse of that length, wherever it may fall.
    reach = (inner - late >= start - unsure) & (inner - late <= end + unsure)
    first = np.minimum(np.searchsorted(left, (inner - late)[reach] - unsure), owner.size - 1)
    np.add.at(rows[:, JUMP], first, p * unsure * sizes[reach])
    return rows, times, np.stack([inner - late, sizes], axis=1)


def _f(rows: FloatArray, t: FloatArray) -> FloatArray:
    """Return the base acceleration of each row at each time, m/s2."""
    s = t - rows[:, 0]
    return rows[:, 2] + rows[:, 3] * s + rows[:, 4] * np.sin(rows[:, 5] * s + rows[:, 6])
