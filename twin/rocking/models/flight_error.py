"""How the difference between the nonlinear block and a simpler model's goes through one flight and its contact.

What is known at a contact is how much later the nonlinear block touches (delta, 1/p) and how much faster it leaves
(nu, p), each as a first-order part and a bound of the rest. Over the flight they are carried by `defect`.

At the simpler contact, at the rate -w, the nonlinear block is e above the base and moves at e' - w. With F its
acceleration there it touches Delta later, 0 = e + (e' - w) Delta + F Delta2 / 2, at the rate w - e' - F Delta. How much
F changes over that instant bounds what is left out (the first-order part is the saltation of Leine & Nijmeijer,
Dynamics and Bifurcations of Non-Smooth Mechanical Systems, 2004, chapter 7).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import QUASI_LINEAR, Problem, Solution
from twin.rocking.models.defect import FT0, PADDING, X0, carry_defect, step_rows

FLYING_SHARE = 0.02
"""Share of a flight, at either end, over which the rates and not the heights prove that both blocks fly."""


class Unbounded(Exception):  # noqa: N818 -- an answer
    """The simpler run cannot be shown to go as the nonlinear one does: a predicate, as in "it may be off by 2 %"."""


@dataclass(frozen=True, slots=True)
class Contact:
    """A contact, or start, of the simpler block, and how the nonlinear one's differs.

    `time` in s; `side` it leaves to, +1 or -1; `rate` it leaves at (p); `delta` and `nu` with bounds `rho_` of what
    they leave out, in 1/p and p.
    """

    time: float
    side: float
    rate: float
    delta: float = 0.0
    rho_delta: float = 0.0
    nu: float = 0.0
    rho_nu: float = 0.0


def carry_flight(
    problem: Problem, pieces: FloatArray, solution: Solution, index: int, at: Contact, peaks: FloatArray
) -> tuple[Contact, str | None]:
    """Return the contact that ends the flight begun `at` one, and why it is no proof, if it is none.

    Parameters
    ----------
    problem, solution : Problem, Solution
        Of the simpler model.
    pieces : ndarray, shape (n, 7)
        The base motion, the last row unbounded.
    index : int
        Which of the solution's impacts ends the flight.
    peaks : ndarray, shape (2,)
        See `carry_defect`.

    Raises
    ------
    Unbounded
        Where the flights may differ in kind.
    """
    block, eta = problem.block, problem.eta
    p, g = block.frequency_parameter, block.gravity
    s, c = math.sin(block.slenderness), math.cos(block.slenderness)
    end = float(solution.impact_times[index])
    w = abs(float(solution.impact_rates[index])) / p
    if at.rate > 0.0 and abs(at.nu) + at.rho_nu > 0.5 * at.rate:
        raise Unbounded(f"touches too softly at {at.time:.3f} s for the next flight to be bounded")
    rows, times, jumps = step_rows(pieces, g, p, at.side, at.time, end, at.delta / p, at.rho_delta / p)
    x, _ = solution.history.evaluate(np.minimum(times.reshape(-1), end))
    rows[:, X0 : X0 + 3] = at.side * x.reshape(-1, 3)
    # At a contact the history already belongs to the next flight, or still to the last one, to a rounding.
    rows[-1, X0 + 2] = 0.0
    if index > 0 or problem.rotation == 0.0:
        rows[0, X0] = 0.0
    y = np.array([0.0, at.nu, 0.0, at.rho_nu])
    body = np.array([block.slenderness, 1.0 if problem.model == QUASI_LINEAR else 0.0, s, c])
    margin = FLYING_SHARE * p * (end - at.time)
    if not carry_defect(rows, body, margin, y, peaks):
        raise Unbounded(
            f"cannot be bounded in flight {index + 1}: the nonlinear block might touch the base there, or fall"
        )

    e, slope, rho, rho_slope = float(y[0]), float(y[1]), PADDING * float(y[2]), PADDING * float(y[3])
    force = -s - float(rows[-1, FT0 + 2]) * c
    strongest = float(np.max(np.abs(rows[:, FT0 : FT0 + 3])))
    steepest = float(np.max(np.abs(pieces[:, 3]) + np.abs(pieces[:, 4] * pieces[:, 5]))) / (g * p)
    fall = w - slope
    soft = Unbounded(f"touches too softly at {end:.3f} s to be bounded")
    if not fall > 0.0:
        raise soft
    lag = 2.0 * e / (fall + math.sqrt(max(0.0, fall * fall - 2.0 * force * e)))
    rho_lag, window, change = rho / fall, abs(lag), 0.0
    for _ in range(6):
        window = abs(lag) + rho_lag
        strength = s + strongest + window * (w + 1.0)
        slowest = fall - rho_slope - strength * window
        if slowest < 0.3 * w:
            raise soft
        near = p * np.abs(jumps[:, 0] - end) <= window + at.rho_delta
        change = (1.0 + strongest) * (abs(e) + rho + (w + abs(slope) + strength * window) * window)
        change += steepest * (window + at.rho_delta) + float(np.sum(jumps[near, 1]))
        rho_lag = (rho + rho_slope * window + 0.5 * change * window * window) / slowest
    contact = Contact(
        time=end,
        side=-at.side,
        rate=eta * w,
        delta=at.delta + lag,
        rho_delta=at.rho_delta + rho_lag,
        nu=eta * (-slope - force * lag),
        rho_nu=eta * (rho_slope + abs(force) * rho_lag + change * window),
    )
    if window > margin:
        return contact, f"ends flight {index + 1} too uncertainly to be bounded"
    return contact, None
