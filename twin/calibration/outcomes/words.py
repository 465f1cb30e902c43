"""A fit of outcomes in words."""

from __future__ import annotations

import math

from twin.calibration.outcomes.agreement import Agreement
from twin.calibration.outcomes.fit import Estimate, OutcomeFit
from twin.calibration.outcomes.likelihood import ALPHA, ETA, LEVELS, LN_P

MOST_NAMED = 3


def outcome_lines(fit: OutcomeFit) -> list[str]:
    """Return the fit in lines: the block with its intervals, what trades off, and what speaks against it."""
    width, height = fit.size
    low, high = math.degrees(fit.alpha.low), math.degrees(fit.alpha.high)
    c = fit.correlations
    mixing, agreement = fit.mixing, fit.agreement
    lines = [
        f"trials     {len(fit.trials)}, of which {agreement.falls} fell; {len(agreement.rows)} different ones",
        f"alpha      {_interval(fit.alpha)}: {math.degrees(fit.alpha.best):.2f} deg ({low:.2f} to {high:.2f})",
        f"p          {_interval(fit.p)}",
        f"eta        {_interval(fit.eta)}; Housner's for this alpha is {fit.housner_restitution:.4f}",
        f"scatter    of the amplitudes {100.0 * fit.spread.best:.2g} % "
        f"({100.0 * fit.spread.low:.2g} to {100.0 * fit.spread.high:.2g} %)",
        f"block      {1e3 * width:.1f} x {1e3 * height:.1f} mm if it is homogeneous",
        f"trade-off  correlation of alpha and p {c[ALPHA, LN_P]:+.2f}, of alpha and eta {c[ALPHA, ETA]:+.2f}, "
        f"of p and eta {c[LN_P, ETA]:+.2f}",
        f"fitted     maximum likelihood (ln L = {fit.log_likelihood:.2f}) of {fit.evaluations} blocks tried, "
        f"each trial at {LEVELS} amplitudes; in brackets 95 % of the sampled blocks",
        f"chains     Gelman-Rubin {max(mixing.ratios):.3f} at worst; forget within {max(mixing.times):.0f} steps; "
        f"worth {mixing.draws:.0f} independent draws",
        f"check      {agreement.falls} fell, {agreement.falls_low} to {agreement.falls_high} would have; "
        f"{agreement.share:.0%} of drawn tables are as unlikely; Brier score {agreement.brier:.3f}",
    ]
    lines += [f"strange    {words}" for words in strange_words(agreement)]
    lines += [f"warning    {words}" for words in fit.faults]
    return lines


def strange_words(agreement: Agreement) -> list[str]:
    """Return the least probable outcomes, at most three, in words."""
    said: list[str] = []
    for row, fell, probability in agreement.strange[:MOST_NAMED]:
        size, frequency = agreement.rows[row, :2]
        said.append(
            f"{size:.4g} m/s2 at {frequency:.4g} Hz {'fell' if fell else 'stood'}: "
            f"the blocks found give that {100.0 * probability:.2g} %"
        )
    return said


def _interval(estimate: Estimate) -> str:
    unit = f" {estimate.unit}" if estimate.unit else ""
    return f"{estimate.best:.4f}{unit} ({estimate.low:.4f} to {estimate.high:.4f})"
