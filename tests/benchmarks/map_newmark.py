"""The thesis' scheme for a verdict map, in Numba: Newmark's average acceleration at 1 ms, Newton-Raphson to 1e-8.

N. Ceh, doctoral thesis, Rijeka 2018, chapter 3; a step that ends below the base is repeated with an unknown length
(here bisection on the length, as cheap as its Newton). The verdict after the pulse is the exact one.
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled
from twin.rocking.verdict import barrier_margins


@compiled
def _step(alpha: float, psi: float, v: float, a: float, f: float, h: float) -> tuple[float, float, float]:
    """Return psi, v and a after `h` (1/p): psi'' = sin(psi) + f cos(psi), average acceleration."""
    new = psi + v * h + 0.5 * a * h * h
    for _ in range(50):
        residual = (new - psi - v * h) * 4.0 / (h * h) - a - (math.sin(new) + f * math.cos(new))
        if abs(residual) < 1e-8:
            break
        new -= residual / (4.0 / (h * h) - math.cos(new) + f * math.sin(new))
    after = (new - psi - v * h) * 4.0 / (h * h) - a
    return new, v + 0.5 * h * (a + after), after


@compiled
def newmark_map(
    alpha: float, p: float, eta: float, amplitudes: FloatArray, frequencies: FloatArray, dt: float
) -> FloatArray:
    """Return 1 where one sine of A (g tan alpha) and W (p) overturns the block, else 0; one entry a cell."""
    fallen = np.zeros(amplitudes.size)
    for cell in range(amplitudes.size):
        amplitude, w = amplitudes[cell] * math.tan(alpha), frequencies[cell]
        end = 2.0 * math.pi / w
        t = 0.0
        side = 0.0
        psi = alpha
        v = 0.0
        a = 0.0
        full = p * dt
        while t < end:
            h = min(full, end - t)
            f = amplitude * math.sin(w * (t + h))
            if side == 0.0:
                t += h
                if abs(f) > math.tan(alpha):
                    side = -1.0 if f > 0.0 else 1.0
                    psi, v = alpha, 0.0
                    a = math.sin(psi) + side * f * math.cos(psi)
                continue
            new, rate, after = _step(alpha, psi, v, a, side * f, h)
            if new <= alpha:
                psi, v, a, t = new, rate, after, t + h
                if psi < alpha - 0.5 * math.pi:
                    break
                continue
            low, high = 0.0, h
            for _ in range(40):
                h = 0.5 * (low + high)
                f = amplitude * math.sin(w * (t + h))
                new, rate, after = _step(alpha, psi, v, a, side * f, h)
                if new > alpha:
                    high = h
                else:
                    low = h
            t += h
            side = -side
            psi, v = alpha, -eta * rate
            a = math.sin(psi) + side * f * math.cos(psi)
            if abs(v) < 1e-4 and a > 0.0:
                side = 0.0
        if side != 0.0:
            if psi < alpha - 0.5 * math.pi:
                fallen[cell] = 1.0
            else:
                ahead, around = barrier_margins(alpha, eta, psi, -v)
                fallen[cell] = 1.0 if ahead > 0.0 or around > 0.0 else 0.0
    return fallen
