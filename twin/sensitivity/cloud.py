"""Perturbed initial conditions: how often a small change of tilt and rate changes outcome or direction."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import betaincinv

from twin.rocking.compiled import FloatArray
from twin.rocking.methods.problem import LINEARISED, NONLINEAR
from twin.rocking.response import Outcome, Response
from twin.sensitivity.case import Case
from twin.sensitivity.outcomes import fell
from twin.sensitivity.pulses import LEFT, RIGHT, ROCKS, STAYS, UNDECIDED, Classes

SIZES = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0)
"""Clouds beside the asked one, as multiples of its spreads."""
LARGEST_TILT = 1.5
"""rad; a draw beyond is cut here."""


@dataclass(frozen=True, slots=True)
class Share:
    """`count` of `whole`, with the 95 % interval of Clopper and Pearson."""

    count: int
    whole: int

    @property
    def value(self) -> float:
        """The share."""
        return self.count / self.whole

    @property
    def interval(self) -> tuple[float, float]:
        """Its 95 % interval."""
        k, n = self.count, self.whole
        low = float(betaincinv(k, n - k + 1, 0.025)) if k else 0.0
        return low, float(betaincinv(k + 1, n - k, 0.975)) if k < n else 1.0

    @property
    def words(self) -> str:
        """The share in words."""
        low, high = self.interval
        return f"{100.0 * self.value:.3g} % ({100.0 * low:.3g} to {100.0 * high:.3g} %)"


@dataclass(frozen=True, slots=True)
class Cloud:
    """Draws about the scene's initial state, from independent normal spreads.

    Attributes
    ----------
    tilt_spread, rate_spread : float
        One standard deviation, rad and rad/s.
    tilts, rates : ndarray, shape (n,)
        rad, rad/s, signed.
    classes, linearised : ndarray of uint8, shape (n,)
        Outcome and direction by the nonlinear and by the linearised model; see `pulses`.
    nominal : int
        Class of the unperturbed state.
    sizes : tuple of (float, Share)
        Multiple of the spreads -> share of draws whose outcome or direction is not the unperturbed one's.
    """

    tilt_spread: float
    rate_spread: float
    tilts: FloatArray
    rates: FloatArray
    classes: Classes
    linearised: Classes
    nominal: int
    sizes: tuple[tuple[float, Share], ...]

    def share(self, *wanted: int) -> Share:
        """Return the share of draws of these classes."""
        return Share(int(np.count_nonzero(np.isin(self.classes, wanted))), len(self.classes))

    @property
    def changed(self) -> Share:
        """Draws with another outcome or direction than the unperturbed state; STAYS and ROCKS are the same one."""
        return _changed(self.classes, self.nominal)

    @property
    def differing(self) -> Share:
        """Draws of which the linearised model says another outcome or direction."""
        falls = fell(self.classes), fell(self.linearised)
        apart = (falls[0] != falls[1]) | (falls[0] & (self.classes != self.linearised))
        return Share(int(np.sum(apart)), len(self.classes))


def cloud_of(case: Case, tilt_spread: float, rate_spread: float, count: int, seed: int) -> Cloud:
    """Draw `count` initial states about the case's and follow them; a fifth as many for each of `SIZES`."""
    rng = np.random.default_rng(seed)
    nominal = class_of(case.response(NONLINEAR))
    z = rng.standard_normal((count, 2))
    tilts = np.clip(case.tilt + tilt_spread * z[:, 0], -LARGEST_TILT, LARGEST_TILT)
    rates = rate_spread * z[:, 1]
    classes = _follow(case, tilts, rates, NONLINEAR)
    sizes: list[tuple[float, Share]] = []
    for size in SIZES:
        if size == 1.0:
            sizes.append((size, _changed(classes, nominal)))
            continue
        drawn = rng.standard_normal((max(1, count // 5), 2))
        near = np.clip(case.tilt + size * tilt_spread * drawn[:, 0], -LARGEST_TILT, LARGEST_TILT)
        sizes.append((size, _changed(_follow(case, near, size * rate_spread * drawn[:, 1], NONLINEAR), nominal)))
    linearised = _follow(case, tilts, rates, LINEARISED)
    return Cloud(tilt_spread, rate_spread, tilts, rates, classes, linearised, nominal, tuple(sizes))


def class_of(response: Response) -> int:
    """Return the class of a response."""
    if response.outcome is Outcome.UNDECIDED:
        return UNDECIDED
    if response.outcome is Outcome.OVERTURNED:
        return RIGHT if response.direction > 0 else LEFT
    return STAYS if response.outcome is Outcome.STAYED else ROCKS


def default_rate_spread(case: Case, tilt_spread: float) -> float:
    """Return the rate as large as the tilt in the phase plane, whose unit of time is 1/p: p times the tilt, rad/s."""
    return case.block.frequency_parameter * tilt_spread


def _follow(case: Case, tilts: FloatArray, rates: FloatArray, model: str) -> Classes:
    found = [class_of(case.response(model, float(tilt), float(rate))) for tilt, rate in zip(tilts, rates, strict=True)]
    return np.array(found, dtype=np.uint8)


def _changed(classes: Classes, nominal: int) -> Share:
    same = np.isin(classes, (STAYS, ROCKS)) if nominal in (STAYS, ROCKS) else classes == nominal
    return Share(int(np.count_nonzero(~same)), len(classes))
