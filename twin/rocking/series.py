"""Taylor series of the rocking equation about one instant.

In units of 1/p, with phi = |theta| on side s, psi = alpha - phi, f = s a / g (Zhang & Makris 2001, eq. 4):

    phi'' = -sin(psi) - f cos(psi)

Series arithmetic after Jorba & Zou (2005): with S = sin(psi), C = cos(psi),

    k S_k = sum j psi_j C_(k-j),   k C_k = -sum j psi_j S_(k-j).
"""

from __future__ import annotations

import math

import numpy as np

from twin.rocking.compiled import FloatArray, compiled

ORDER = 24
# A step never exceeds this, in units of 1/p, whatever the coefficients promise.
LONGEST_STEP = 1.0

# Columns of a piece of base motion: a = c0 + c1 (t - t0) + A sin(omega (t - t0) + psi) on [t0, t1).
T0, T1, C0, C1, AMPLITUDE, OMEGA, PHASE = range(7)


@compiled
def base_acceleration(piece: FloatArray, t: float) -> float:
    """Return a(t) of one piece, m/s2."""
    dt = t - piece[T0]
    a = piece[C0] + piece[C1] * dt
    if piece[AMPLITUDE] != 0.0:
        a += piece[AMPLITUDE] * math.sin(piece[OMEGA] * dt + piece[PHASE])
    return a


@compiled
def forcing_series(piece: FloatArray, t: float, scale: float, p: float, f: FloatArray) -> int:
    """Write the coefficients of scale * a about time t, in powers of p (t' - t), and return how many are not zero."""
    dt = t - piece[T0]
    f[:] = 0.0
    f[0] = scale * (piece[C0] + piece[C1] * dt)
    f[1] = scale * piece[C1] / p
    count = 2 if f[1] != 0.0 else 1
    amplitude = scale * piece[AMPLITUDE]
    if amplitude == 0.0:
        return count
    w = piece[OMEGA] / p
    angle = piece[OMEGA] * dt + piece[PHASE]
    s = math.sin(angle)
    c = math.cos(angle)
    power = amplitude
    for k in range(f.size):
        quarter = k % 4
        if quarter == 0:
            f[k] += power * s
        elif quarter == 1:
            f[k] += power * c
        elif quarter == 2:
            f[k] -= power * s
        else:
            f[k] -= power * c
        power *= w / (k + 1)
    return f.size


@compiled
def rocking_series(
    psi: float, phi: float, v: float, f: FloatArray, forced: int, c: FloatArray, work: FloatArray
) -> None:
    """Write the coefficients of phi into c[0..ORDER].

    Parameters
    ----------
    psi, phi, v : float
        alpha - phi, phi (both given, so that neither is the difference of nearly equal numbers), and d(phi)/d(p t).
    f : ndarray
        Coefficients of s a / g, `forced` of which are not zero.
    c : ndarray, shape (ORDER + 1,)
        Result.
    work : ndarray, shape (3, ORDER + 1)
        The first two rows become S and C.
    """
    sines = work[0]
    cosines = work[1]
    c[0] = phi
    c[1] = v
    sines[0] = math.sin(psi)
    cosines[0] = math.cos(psi)
    for k in range(ORDER - 1):
        if k > 0:
            ds = 0.0
            dc = 0.0
            for j in range(1, k + 1):
                moved = -j * c[j]  # j psi_j
                ds += moved * cosines[k - j]
                dc -= moved * sines[k - j]
            sines[k] = ds / k
            cosines[k] = dc / k
        pull = sines[k]
        for j in range(min(k + 1, forced)):
            pull += f[j] * cosines[k - j]
        c[k + 2] = -pull / ((k + 1) * (k + 2))


@compiled
def step_length(c: FloatArray, tolerance: float) -> float:
    """Return the step, in units of 1/p, after which the last two terms stay below `tolerance` (rad)."""
    last = abs(c[ORDER])
    before = abs(c[ORDER - 1])
    h = LONGEST_STEP
    if last > 0.0:
        h = min(h, (tolerance / last) ** (1.0 / ORDER))
    if before > 0.0:
        h = min(h, (tolerance / before) ** (1.0 / (ORDER - 1)))
    return 0.9 * h


def scratch() -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the arrays `rocking_series` writes into: f, c, work."""
    return np.zeros(ORDER + 1), np.zeros(ORDER + 1), np.zeros((3, ORDER + 1))
