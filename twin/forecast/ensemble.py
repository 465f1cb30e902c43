"""The futures' starting points: a fixed set of normal deviates, laid each time about what is known now.

While readings are believed, the futures are drawn in each cycle from the observer's estimate and its covariance
(state, slenderness and restitution together) rather than carried as weighted particles: what the measurements say of
them, and of how they hang together, is in that covariance, and thirty-two weights would soon be one. The deviates are
the same in every cycle, so that a probability changes because the knowledge does, never because of the dice. Without a
reading the futures are carried on instead, each by its own impacts: a block that rocks unseen is uncertain in phase
and not in energy, which no covariance says. One future in 32 is the resolution.
"""

from __future__ import annotations

import math
from statistics import NormalDist

import numpy as np

from twin.forecast.compiled import compiled
from twin.forecast.step import (
    ALPHA,
    COSINE,
    FALLEN,
    FELL_AT,
    HALF_TURN,
    OFFSET,
    PHI,
    RATE,
    RESTITUTION,
    ROCKED,
    SIDE,
    SINE,
    THRESHOLD,
)
from twin.rocking.batch.lanes import WIDTH
from twin.rocking.compiled import FloatArray

FUTURES = 32
GROUPS = FUTURES // WIDTH
DIMENSIONS = 4
# Sobol's direction numbers of the first four dimensions (Joe & Kuo 2008), in 32nds. SciPy has the same, but half of the
# time in which a run started went into importing it.
DIRECTIONS = ((16, 16, 16, 16), (8, 24, 24, 24), (4, 20, 12, 4), (2, 30, 18, 10), (1, 17, 29, 31))
# An estimate in one row: side, |theta| rad, d|theta|/d(p t), alpha rad, restitution. Its covariance is that of the last
# four; at rest the first of them is the signed rotation.
(KNOWN_SIDE, KNOWN_PHI, KNOWN_RATE, KNOWN_ALPHA, KNOWN_RESTITUTION) = range(5)
KNOWN = 5
# A future that leans less than this, rad, rests. None is thinner or thicker than these shares of the estimate.
LEANS = 1e-5
THINNEST, THICKEST = 0.5, 1.5


def deviates(seed: int) -> FloatArray:
    """Return standard normal deviates, shape (FUTURES, DIMENSIONS): Sobol's points, shifted by a random vector.

    The first is zero, the estimate itself; the others are made to have, with it, mean 0 and covariance 1 exactly.
    """
    points = np.zeros((FUTURES, DIMENSIONS), dtype=np.int64)
    for n in range(1, FUTURES):
        # Gray code: the direction of the lowest bit that n - 1 has not set.
        points[n] = points[n - 1] ^ DIRECTIONS[(n & -n).bit_length() - 1]
    shifted = np.clip((points / FUTURES + np.random.default_rng(seed).random(DIMENSIONS)) % 1.0, 1e-6, 1.0 - 1e-6)
    normal = NormalDist().inv_cdf
    z = np.array([[normal(share) for share in point] for point in shifted.tolist()])
    z = z[np.argsort(np.sum(z * z, axis=1), kind="stable")]
    z[0] = 0.0
    z[1:] -= z[1:].mean(axis=0)
    root = np.linalg.cholesky(z.T @ z / FUTURES)
    return np.ascontiguousarray(np.linalg.solve(root, z.T).T, dtype=np.float64)


@compiled
def draw(known: FloatArray, root: FloatArray, z: FloatArray, tau: float, groups: FloatArray) -> None:
    """Lay the futures about an estimate into lanes.

    Parameters
    ----------
    known : ndarray, shape (KNOWN,)
    root : ndarray, shape (4, 4)
        Lower triangular root of the covariance, from `square_root`.
    z : ndarray, shape (FUTURES, DIMENSIONS)
    tau : float
        Time now, 1/p.
    groups : ndarray, shape (GROUPS, ROWS, WIDTH)
        Written.
    """
    for future in range(z.shape[0]):
        side = known[KNOWN_SIDE]
        phi = known[KNOWN_PHI] + _along(root, z, future, 0)
        v = known[KNOWN_RATE] + _along(root, z, future, 1)
        alpha = known[KNOWN_ALPHA] + _along(root, z, future, 2)
        eta = known[KNOWN_RESTITUTION] + _along(root, z, future, 3)
        alpha = min(max(alpha, THINNEST * known[KNOWN_ALPHA]), min(THICKEST * known[KNOWN_ALPHA], 0.99 * HALF_TURN))
        eta = min(max(eta, 0.0), 1.0)
        if side == 0.0:
            v = 0.0
            side = 0.0 if abs(phi) < LEANS else math.copysign(1.0, phi)
            phi = abs(phi) if side != 0.0 else 0.0
        elif phi < 0.0:
            # On the other side of the contact: it has struck already, or has not yet.
            side = -side
            if v < 0.0:
                phi = -eta * phi
                v = -eta * v
            else:
                phi = -phi
                v = -v / max(eta, 0.1)
        place(groups[future // WIDTH], future % WIDTH, side, phi, v, alpha, eta, tau)


@compiled
def place(m: FloatArray, lane: int, side: float, phi: float, v: float, alpha: float, eta: float, tau: float) -> None:
    """Put one future into a lane, at time `tau` (1/p)."""
    m[SIDE, lane] = side
    m[PHI, lane] = min(phi, HALF_TURN)
    m[RATE, lane] = v
    m[OFFSET, lane] = 0.0
    m[ALPHA, lane] = alpha
    m[RESTITUTION, lane] = eta
    m[THRESHOLD, lane] = math.tan(alpha)
    m[SINE, lane] = math.sin(alpha)
    m[COSINE, lane] = math.cos(alpha)
    m[FALLEN, lane] = 1.0 if phi >= HALF_TURN else 0.0
    m[FELL_AT, lane] = tau
    m[ROCKED, lane] = 0.0 if side == 0.0 else 1.0


@compiled
def _along(root: FloatArray, z: FloatArray, future: int, row: int) -> float:
    total = 0.0
    for j in range(row + 1):
        total += root[row, j] * z[future, j]
    return total


@compiled
def square_root(covariance: FloatArray, root: FloatArray) -> None:
    """Write the lower triangular root of a covariance (Cholesky); what is not known to vary stays 0."""
    n = covariance.shape[0]
    for j in range(n):
        rest = covariance[j, j]
        for k in range(j):
            rest -= root[j, k] * root[j, k]
        root[j, j] = math.sqrt(rest) if rest > 0.0 else 0.0
        for i in range(j + 1, n):
            value = covariance[i, j]
            for k in range(j):
                value -= root[i, k] * root[j, k]
            root[i, j] = value / root[j, j] if root[j, j] > 1e-12 else 0.0
