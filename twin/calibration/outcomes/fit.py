"""`fit_outcomes`: the rigid block that would have fallen where the specimen fell and stood where it stood."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.calibration.outcomes.agreement import Agreement, agreement_of
from twin.calibration.outcomes.chains import FULL, Effort, sample
from twin.calibration.outcomes.likelihood import ALPHA, ETA, LN_P, LN_SPREAD, Likelihood
from twin.calibration.outcomes.mixing import Mixing, mixing_of
from twin.calibration.outcomes.trials import Trial
from twin.errors import InputError
from twin.rocking.compiled import FloatArray

FEWEST_TRIALS = 10
LEVEL = 0.95
TAILS = (0.5 - 0.5 * LEVEL, 0.5 + 0.5 * LEVEL)
LOWEST = np.array([0.01, math.log(0.5), 0.0, math.log(1e-3)])
HIGHEST = np.array([1.2, math.log(100.0), 1.0, math.log(0.3)])
"""The box in which every block counts as equally likely before the trials, in alpha, ln p, eta and ln spread."""
BOUND_SHARE = 0.5
"""An interval wider than this share of its box says that the trials do not bound the parameter."""


@dataclass(frozen=True, slots=True)
class Estimate:
    """One parameter: its value at the likeliest block, and the ends of its 95 % interval, in `unit`."""

    name: str
    unit: str
    best: float
    low: float
    high: float


@dataclass(frozen=True, slots=True)
class OutcomeFit:
    """The equivalent block of a table of outcomes.

    Attributes
    ----------
    trials : tuple of Trial
    gravity : float
        m/s2.
    alpha, p, eta, spread : Estimate
        rad, rad/s, ratio of rates over an impact, and the relative scatter of the amplitudes (one deviation).
    points : ndarray, shape (n, 4)
        The sampled blocks: alpha, ln p, eta, ln spread.
    correlations : ndarray, shape (4, 4)
        Of the sampled parameters.
    log_likelihood : float
        Of the likeliest block.
    evaluations : int
        Blocks tried.
    mixing : Mixing
    agreement : Agreement
    """

    trials: tuple[Trial, ...]
    gravity: float
    alpha: Estimate
    p: Estimate
    eta: Estimate
    spread: Estimate
    points: FloatArray
    correlations: FloatArray
    log_likelihood: float
    evaluations: int
    mixing: Mixing
    agreement: Agreement

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the homogeneous block with the likeliest alpha and p, m."""
        diagonal = 1.5 * self.gravity / self.p.best**2
        return diagonal * math.sin(self.alpha.best), diagonal * math.cos(self.alpha.best)

    @property
    def housner_restitution(self) -> float:
        """What Housner's formula gives for the likeliest alpha."""
        return max(0.0, 1.0 - 1.5 * math.sin(self.alpha.best) ** 2)

    @property
    def unbounded(self) -> list[str]:
        """Names of the parameters that the trials leave open: an interval over more than half of its box."""
        spans = np.quantile(self.points, 0.5 + 0.5 * LEVEL, axis=0) - np.quantile(
            self.points, 0.5 - 0.5 * LEVEL, axis=0
        )
        shares = spans / (HIGHEST - LOWEST)
        # The scatter is a nuisance: an upper bound of it is all that clean trials can give.
        return [e.name for e, k in ((self.alpha, ALPHA), (self.p, LN_P), (self.eta, ETA)) if shares[k] > BOUND_SHARE]

    @property
    def faults(self) -> list[str]:
        """Why the intervals should not be believed, one sentence each; empty where nothing speaks against them."""
        said = [f"the chains have not mixed: {self.mixing.fault}"] if self.mixing.fault is not None else []
        if self.unbounded:
            said.append(f"the trials do not bound {', '.join(self.unbounded)}")
        if self.agreement.fault is not None:
            said.append(self.agreement.fault)
        return said

    @property
    def trustworthy(self) -> bool:
        """Whether nothing speaks against the intervals."""
        return not self.faults

    def as_data(self) -> dict[str, object]:
        """Return the fit as JSON data, SI units."""
        names = ("alpha", "p", "eta", "spread")
        estimates = (self.alpha, self.p, self.eta, self.spread)
        return {
            "kind": "outcomes",
            "trials": len(self.trials),
            "fell": self.agreement.falls,
            "estimates": {
                name: {"unit": e.unit, "maximum_likelihood": e.best, "low": e.low, "high": e.high}
                for name, e in zip(names, estimates, strict=True)
            },
            "interval": LEVEL,
            "width_m": self.size[0],
            "height_m": self.size[1],
            "housner_restitution": self.housner_restitution,
            "correlations": {
                "alpha, ln p": float(self.correlations[ALPHA, LN_P]),
                "alpha, eta": float(self.correlations[ALPHA, ETA]),
                "ln p, eta": float(self.correlations[LN_P, ETA]),
            },
            "log_likelihood": self.log_likelihood,
            "blocks_tried": self.evaluations,
            "gelman_rubin": list(self.mixing.ratios),
            "autocorrelation_steps": list(self.mixing.times),
            "independent_draws": self.mixing.draws,
            "drawn_tables_as_unlikely": self.agreement.share,
            "falls_drawn": [self.agreement.falls_low, self.agreement.falls_high],
            "brier": self.agreement.brier,
            "faults": self.faults,
        }


def fit_outcomes(trials: Sequence[Trial], *, gravity: float = 9.81, seed: int = 1, effort: Effort = FULL) -> OutcomeFit:
    """Estimate alpha, p and eta of the block that explains a table of outcomes, by maximum likelihood.

    Parameters
    ----------
    trials : sequence of Trial
        At least 10; some fell and some stood.
    gravity : float
        m/s2.
    seed : int
        Of search, walkers and the check; the answer is the same for the same seed.
    effort : Effort
        How long is sampled.

    Raises
    ------
    InputError
        Where the trials can say nothing: too few, all fell, or all stood.

    Notes
    -----
    The intervals are the middle 95 % of the blocks sampled in proportion to their likelihood, flat before the trials in
    alpha, ln p, eta and the logarithm of the scatter over `LOWEST` to `HIGHEST`.
    """
    trials = tuple(trials)
    falls = sum(trial.overturned for trial in trials)
    if len(trials) < FEWEST_TRIALS:
        raise InputError(f"{len(trials)} trials are too few to estimate a block; {FEWEST_TRIALS} are needed")
    if falls in (0, len(trials)):
        raise InputError(
            f"every one of the {len(trials)} trials {'fell' if falls else 'stood'}: no block can be told from that; "
            "trials on both sides of a boundary are needed"
        )
    likelihood = Likelihood(trials, gravity, LOWEST, HIGHEST)
    chains = sample(likelihood, _start_box(trials, gravity), seed, effort)
    points = chains.points.reshape(-1, chains.points.shape[-1])
    agreement = agreement_of(likelihood, points, np.random.default_rng([seed, 1]))
    values = points.copy()
    values[:, (LN_P, LN_SPREAD)] = np.exp(points[:, (LN_P, LN_SPREAD)])
    best = chains.best.copy()
    best[[LN_P, LN_SPREAD]] = np.exp(chains.best[[LN_P, LN_SPREAD]])
    lows, highs = np.quantile(values, TAILS, axis=0)

    def estimate(k: int, name: str, unit: str) -> Estimate:
        return Estimate(name, unit, float(best[k]), float(lows[k]), float(highs[k]))

    with np.errstate(invalid="ignore", divide="ignore"):
        correlations = np.asarray(np.nan_to_num(np.corrcoef(points, rowvar=False)))
    return OutcomeFit(
        trials,
        gravity,
        estimate(ALPHA, "alpha", "rad"),
        estimate(LN_P, "p", "rad/s"),
        estimate(ETA, "eta", ""),
        estimate(LN_SPREAD, "spread", ""),
        points,
        correlations,
        chains.best_log_likelihood,
        chains.evaluations,
        mixing_of(chains.points),
        agreement,
    )


def _start_box(trials: Sequence[Trial], gravity: float) -> tuple[FloatArray, FloatArray]:
    """Return where to begin: a block falls only where g tan(alpha) is passed, and p is near the frequencies asked."""
    felled = np.array([abs(trial.amplitude) for trial in trials if trial.overturned])
    # One in twenty may have been read wrong.
    steepest = math.atan(1.1 * float(np.quantile(felled, 0.05)) / gravity)
    lowest = np.array([0.05 * steepest, math.log(1.0), 0.5, math.log(3e-3)])
    highest = np.array([steepest, math.log(40.0), 1.0, math.log(0.1)])
    return np.maximum(lowest, LOWEST), np.minimum(highest, HIGHEST)
