"""The base motions the futures are shaken by: the asked one as the table makes it, with what is not known of that."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import ndtri  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from excitation import ReleasedRun, TableRun
from twin.rehearsal import Rehearsal, initial_rotation
from twin.rocking.compiled import FloatArray
from twin.scene_uncertainty import KnownUncertainty, SpreadPart
from twin.uncertainty.motion import C0, C1, T0, T1, cut_at, delayed, stacked
from twin.uncertainty.table import TableResponse

DELAY, NOISE, REBOUND = SHAPE_CAUSES = ("table delay", "table noise", "rebound")
VARIANTS = 256
"""Base motions that differ in noise, delay or rebound; a future has one of them."""
_SEED = 5
MANY_PIECES = 500
"""A motion of more, an earthquake, costs so much that only the probability itself is asked of all futures."""


@dataclass(frozen=True, slots=True)
class Shaking:
    """The base motions of a scene's futures.

    Attributes
    ----------
    made : ndarray, shape (n, 7)
        The base motion without any spread; its time 0 is `start` s after the start of the run.
    variants : ndarray, shape (m, n, 7)
    start : float
        s.
    spread : tuple of str
        Those of `SHAPE_CAUSES` that make the variants differ.
    """

    made: FloatArray
    variants: FloatArray
    start: float
    spread: tuple[str, ...]

    def affordable(self, count: int) -> int:
        """Return how many of `count` futures are asked again: fewer where the motion has thousands of pieces."""
        return max(min(count, 200), round(count * min(1.0, MANY_PIECES / self.variants.shape[1])))


def shaking_of(rehearsal: Rehearsal, response: TableResponse, without: str | None = None) -> Shaking:
    """Return the base motions of a rehearsed scene on a table that answers with `response`.

    From rest they begin with the pulse. `without` is one of `SHAPE_CAUSES` that stays at its mean.
    """
    spreads = rehearsal.scene.spreads
    tilted = initial_rotation(rehearsal.scene) != 0.0
    from_rest = not tilted and rehearsal.given is not None
    start = rehearsal.motion.pulse_start if from_rest else 0.0
    present = tuple(cause for cause in _spread(rehearsal, spreads, tilted=tilted) if cause != without)
    made = response.made(_rows(_mean_run(rehearsal.motion, spreads), from_rest=from_rest))
    if not present:
        return Shaking(made, made[None], start, ())
    rng = np.random.default_rng((spreads.seed, _SEED))
    levels = (np.arange(VARIANTS) + 0.5) / VARIANTS
    # Each cause has all its quantiles, in an order of its own.
    quantile = {cause: rng.permutation(levels) for cause in SHAPE_CAUSES}
    delays = _at(spreads.table.delay_ms, 0.0, quantile[DELAY]) * 1e-3
    rebounds = _at(spreads.table.rebound, _rebound(rehearsal.motion), quantile[REBOUND])
    variants: list[FloatArray] = []
    for k in range(VARIANTS):
        rows = made
        if REBOUND in present:
            run = _with_rebound(rehearsal.motion, float(rebounds[k]))
            rows = response.made(_rows(run, from_rest=from_rest))
        if NOISE in present:
            rows = _noisy(rows, spreads.table.noise_m_s2, spreads.table.noise_hz, rng)
        if DELAY in present:
            # Earlier than the earliest is not asked: all are later by the same, and the block is let go as much later.
            rows = delayed(rows, float(delays[k] - delays.min()))
        variants.append(rows)
    return Shaking(made, stacked(variants), start, present)


def _spread(rehearsal: Rehearsal, spreads: KnownUncertainty, *, tilted: bool) -> list[str]:
    table, run = spreads.table, rehearsal.motion
    if rehearsal.given is None:
        return []
    found = [DELAY] if tilted and table.delay_ms.deviation > 0.0 else []
    if table.noise_m_s2 > 0.0:
        found.append(NOISE)
    rebounds = isinstance(run, ReleasedRun) and run.machine.end_stop.rebound > 0.0
    if rebounds and table.rebound.deviation > 0.0:
        found.append(REBOUND)
    return found


def _rows(run: TableRun, *, from_rest: bool) -> FloatArray:
    return run.shaking.pieces if from_rest else run.pieces


def _rebound(run: TableRun) -> float:
    return run.machine.end_stop.rebound if isinstance(run, ReleasedRun) else 0.0


def _mean_run(run: TableRun, spreads: KnownUncertainty) -> TableRun:
    """Return the run with the rebound in the middle of its distribution."""
    own = _rebound(run)
    mean = spreads.table.rebound.centre(own)
    return run if mean == own or own == 0.0 else _with_rebound(run, mean)


def _with_rebound(run: TableRun, rebound: float) -> TableRun:
    if not isinstance(run, ReleasedRun):
        return run
    stop = run.machine.end_stop.model_copy(update={"rebound": min(max(rebound, 0.0), 1.0)})
    return replace(run, machine=run.machine.model_copy(update={"end_stop": stop}))


def _at(spread: SpreadPart, own: float, quantiles: FloatArray) -> FloatArray:
    """Return a distribution's values at `quantiles`."""
    if spread.low is not None and spread.high is not None:
        return spread.low + (spread.high - spread.low) * quantiles
    return spread.centre(own) + spread.deviation * np.asarray(ndtri(quantiles))


def _noisy(rows: FloatArray, deviation: float, highest: float, rng: np.random.Generator) -> FloatArray:
    """Return the motion with noise up to about `highest`, Hz: straight between independent values 1 / (2 f) apart.

    Between its knots such a noise has two thirds of their variance, which is made up for.
    """
    spacing = 0.5 / highest
    count = int(np.ceil(rows[-1, T1] / spacing))
    knots = np.arange(count + 1, dtype=np.float64) * spacing
    values = np.sqrt(1.5) * deviation * rng.standard_normal(count + 1)
    values[0] = values[-1] = 0.0
    result = cut_at(rows, knots[1:])
    inside = np.clip(np.searchsorted(knots, result[:, T0], side="right") - 1, 0, count - 1)
    slope = np.diff(values) / spacing
    result[:, C0] += values[inside] + slope[inside] * (result[:, T0] - knots[inside])
    result[:, C1] += slope[inside]
    return result
