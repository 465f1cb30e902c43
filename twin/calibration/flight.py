"""One flight of a free block between two contacts, in closed form, and what it changes by.

With psi = alpha - |theta| and time u = p (t - t_peak), the free equation is psi'' = sin(psi) (Housner 1963). From rest
at psi0 (Jacobi's functions of modulus k = cos(psi0 / 2); k' = sin(psi0 / 2)):

    sin(psi / 2) = k' / dn(u, k)

A flight is given by its half duration U, in units of 1/p, rather than by its peak: the times of impacts are what a
recording says best. psi0 then follows from psi(U) = alpha.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.special import ellipj

from twin.rocking_data.noise import FloatArray

NEWTON = 30
CONVERGED = 1e-14
STEP = 1e-5
"""Relative step of the central difference by psi0: its error, 1e-10, is far below any noise."""


class Shape(NamedTuple):
    """Flights, one row each.

    Attributes
    ----------
    valley : ndarray, shape (n,)
        psi0 = alpha - peak rotation, rad.
    speed : ndarray
        |d theta / d u| at the contact: sqrt(2 (cos(psi0) - cos(alpha))).
    growth : ndarray
        d psi / d psi0 at the contact.
    """

    valley: FloatArray
    speed: FloatArray
    growth: FloatArray


def lean(valley: FloatArray, u: FloatArray) -> FloatArray:
    """Return psi at u, rad, of blocks let go at `valley`."""
    k2 = np.cos(0.5 * valley) ** 2
    dn = ellipj(u, k2)[2]
    return 2.0 * np.arcsin(np.minimum(np.sin(0.5 * valley) / dn, 1.0))


def growth(valley: FloatArray, u: FloatArray) -> FloatArray:
    """Return d psi / d psi0 at u: about cosh(u)."""
    step = STEP * valley
    return (lean(valley + step, u) - lean(valley - step, u)) / (2.0 * step)


def speed(valley: FloatArray, psi: FloatArray | float) -> FloatArray:
    """Return |d psi / d u| where a block let go at `valley` is at `psi`."""
    # cos(a) - cos(b) = 2 sin((a + b) / 2) sin((b - a) / 2)
    return 2.0 * np.sqrt(np.maximum(np.sin(0.5 * (psi + valley)) * np.sin(0.5 * (psi - valley)), 0.0))


def shape_of(half: FloatArray, alpha: float) -> Shape:
    """Return the flights of half duration `half`, in units of 1/p, of a block of slenderness `alpha`, rad.

    Newton's method from the linear answer psi0 = alpha / cosh(U); psi(U) is all but linear in psi0.
    """
    valley = alpha / np.cosh(half)
    for _ in range(NEWTON):
        slope = growth(valley, half)
        change = (alpha - lean(valley, half)) / slope
        new = np.clip(valley + change, 0.5 * valley, 0.5 * (valley + alpha))
        done = bool(np.all(np.abs(new - valley) <= CONVERGED * alpha))
        valley = new
        if done:
            break
    return Shape(valley, speed(valley, alpha), growth(valley, half))


def half_duration(peak: FloatArray, alpha: float) -> FloatArray:
    """Return U of flights with that peak, rad, below alpha: (K - F(asin(cos(alpha / 2) / k), k)).

    Examples
    --------
    >>> from twin.rocking.block import Block
    >>> block = Block(0.06, 0.27)
    >>> round(float(half_duration(np.array([0.15]), block.slenderness)[0] / block.frequency_parameter), 12)
    0.250518129832
    """
    from scipy.special import ellipk, ellipkinc

    k2 = np.cos(0.5 * (alpha - peak)) ** 2
    phase = np.arcsin(np.minimum(np.cos(0.5 * alpha) / np.sqrt(k2), 1.0))
    return np.asarray(ellipk(k2) - ellipkinc(phase, k2), dtype=np.float64)
