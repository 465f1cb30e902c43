"""What is known of the block and how well: the covariance of (phi, v, alpha, eta), carried with the motion.

With delta the error of each, phi and v on the block's own side, in units of 1/p (phi'' = -sin(psi) - f cos(psi)):

    flight    delta phi'' = K (delta phi - delta alpha),   K = cos(psi) - f sin(psi)
    impact    delta phi+ = -eta delta phi
              delta v+   = -eta delta v + (eta F- + F+) / v- delta phi - v- delta eta

F- and F+ are phi'' just before and after. The second is the saltation matrix of the impact (as in
`twin.rocking.error_ellipse`): it turns an uncertain instant of impact into an uncertain rate, so that the filter knows
the jump and does not smooth it. With it a Kalman filter on a hybrid system is the salted one of N. J. Kong, J. J.
Payne, G. Council & A. M. Johnson, Automatica 131, 2021.
"""

from __future__ import annotations

import math

from twin.forecast.compiled import compiled
from twin.rocking.compiled import FloatArray

PHI, RATE, ALPHA, ETA = range(4)
SIZE = 4
# The settings, see `twin.forecast.observer.Uncertainty`: rad, per g, per g, pure number, pure number, rad, per p.
(NOISE, ACCELERATION_NOISE, ACCELERATION_DRIFT, ACCELERATION_SHARE, SCATTER, INITIAL_TILT, SLOWEST) = range(7)
# Beyond this the change of phi'' over the uncertain contact is no small one and the linear picture ends.
LINEAR_IMPACT = 0.3
# The largest deviations of rotation, rad, and of rate, units of p.
WIDEST, FASTEST = 0.1, 0.1


@compiled
def fly(cov: FloatArray, psi: float, force: float, h: float, settings: FloatArray) -> None:
    """Carry the covariance over a stretch `h` (1/p) of flight that starts at `psi` under f = `force`.

    The measured acceleration is wrong by one amount in each sample, and by others that stay for about 1 / p: a drift,
    and a share of itself.
    """
    if not h > 0.0:
        return
    stiffness = math.cos(psi) - force * math.sin(psi)
    bend = 0.5 * stiffness * h * h
    turn = stiffness * h
    for j in range(SIZE):
        phi = cov[PHI, j]
        rate = cov[RATE, j]
        alpha = cov[ALPHA, j]
        cov[PHI, j] = phi + h * rate + bend * (phi - alpha)
        cov[RATE, j] = rate * (1.0 + bend) + turn * (phi - alpha)
    for i in range(SIZE):
        phi = cov[i, PHI]
        rate = cov[i, RATE]
        alpha = cov[i, ALPHA]
        cov[i, PHI] = phi + h * rate + bend * (phi - alpha)
        cov[i, RATE] = rate * (1.0 + bend) + turn * (phi - alpha)
    pushed = math.cos(psi) * math.cos(psi) * h
    lasting = settings[ACCELERATION_DRIFT] ** 2 + (settings[ACCELERATION_SHARE] * force) ** 2
    pushed *= settings[ACCELERATION_NOISE] ** 2 * h + lasting
    cov[RATE, RATE] += pushed
    cov[PHI, RATE] += 0.5 * pushed * h
    cov[RATE, PHI] += 0.5 * pushed * h
    cov[PHI, PHI] += pushed * h * h / 3.0
    _limit(cov, PHI, WIDEST)
    _limit(cov, RATE, FASTEST)


@compiled
def _limit(cov: FloatArray, which: int, most: float) -> None:
    """Let a deviation grow no further: unseen for long, the linear picture would have it without a bound."""
    if cov[which, which] > most * most:
        share = most / math.sqrt(cov[which, which])
        cov[which, :] *= share
        cov[:, which] *= share


@compiled
def strike(cov: FloatArray, alpha: float, eta: float, before: float, force: float, settings: FloatArray) -> bool:
    """Carry the covariance over an impact at rate `before` < 0, f = `force` on the side left; tell whether it teaches.

    A slow impact says nothing of the restitution that could be told from the sensor's noise.
    """
    leaving = -math.sin(alpha) - force * math.cos(alpha)
    entering = -math.sin(alpha) + force * math.cos(alpha)
    turn = 0.0
    if math.sqrt(max(0.0, cov[PHI, PHI])) * abs(leaving) < LINEAR_IMPACT * before * before:
        turn = (eta * leaving + entering) / before
    teaches = -before > settings[SLOWEST]
    by_eta = -before if teaches else 0.0
    for j in range(SIZE):
        phi = cov[PHI, j]
        cov[PHI, j] = -eta * phi
        cov[RATE, j] = -eta * cov[RATE, j] + turn * phi + by_eta * cov[ETA, j]
    for i in range(SIZE):
        phi = cov[i, PHI]
        cov[i, PHI] = -eta * phi
        cov[i, RATE] = -eta * cov[i, RATE] + turn * phi + by_eta * cov[i, ETA]
    spread = settings[SCATTER] ** 2
    if not teaches:
        spread += cov[ETA, ETA]
    cov[RATE, RATE] += spread * before * before
    return teaches


@compiled
def lift(cov: FloatArray, alpha: float) -> None:
    """Let a block at rest go: one that leaned unseen rocks already, as fast as its lean makes it, at some phase.

    v^2 = 2 sin(alpha) phi, half of it on the average.
    """
    cov[RATE, RATE] += math.sin(alpha) * math.sqrt(max(0.0, cov[PHI, PHI]))


@compiled
def settle(cov: FloatArray, tilt: float) -> None:
    """Forget all of a motion that has come to rest but the parameters; the rotation is known to `tilt`, rad."""
    cov[:2, :] = 0.0
    cov[:, :2] = 0.0
    cov[PHI, PHI] = tilt * tilt


@compiled
def correct(cov: FloatArray, innovation: float, variance: float, change: FloatArray) -> None:
    """Write what an innovation of phi, of that variance, changes of the four, and shrink the covariance.

    Gain K = P h / (h P h + r^2) with h = (1, 0, 0, 0); P - K h P (Kalman 1960). `change`, shape (4,), is K times the
    innovation.
    """
    for i in range(SIZE):
        change[i] = cov[i, PHI]
    for i in range(SIZE):
        for j in range(SIZE):
            cov[i, j] -= change[i] * change[j] / variance
    for i in range(SIZE):
        change[i] *= innovation / variance
    for i in range(SIZE):
        cov[i, i] = max(cov[i, i], 0.0)
