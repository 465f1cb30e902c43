"""Base motions as pieces that the futures are shaken by: through samples, made longer, cut at times."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
from scipy.linalg import solveh_banded  # pyright: ignore[reportMissingTypeStubs, reportUnknownVariableType]

from excitation import Pulse
from twin.rocking.compiled import FloatArray

FINEST = 2.0
"""Samples between two knots, at least."""
SHAPE_ERROR = 2e-3
"""Of the peak: what a chord may miss the samples by. The knots' values are fitted: nothing is missed in the mean."""
FAINT = 1e-4
"""Of the peak: what is less than that to the end is left out."""
T0, T1, C0, C1, AMPLITUDE, OMEGA, PHASE = range(7)


@dataclass(frozen=True, eq=False)
class BaseMotion(Pulse):
    """A base motion given by its pieces alone, e.g. as a table really makes it.

    Parameters
    ----------
    rows : ndarray, shape (n, 7)
        See `Pulse.pieces`.
    """

    rows: FloatArray

    @property
    def family(self) -> str:
        """It is nobody's to clip."""
        return "base motion"

    @property
    def kind(self) -> str:
        """What sentences call it."""
        return "base motion"

    def scaled(self, factor: float) -> BaseMotion:
        """Return it `factor` times as strong."""
        return BaseMotion(scaled(self.rows, factor))

    def _rows(self) -> FloatArray:
        return self.rows


def scaled(rows: FloatArray, factor: float) -> FloatArray:
    """Return pieces `factor` times as strong."""
    result = rows.copy()
    result[:, [C0, C1, AMPLITUDE]] *= factor
    return result


def pieces_through(samples: FloatArray, step: float) -> FloatArray:
    """Return straight pieces, shape (n, 7), through samples `step` s apart, from the first one's time on.

    The knots lie closer where the samples bend more (a chord of length h misses h^2 |a''| / 8), and their values are
    fitted to all samples in the least squares, so that momentum is kept: what topples a block is the integral.
    """
    peak = float(np.max(np.abs(samples)))
    loud = np.nonzero(np.abs(samples) > FAINT * peak)[0]
    last = min(int(loud[-1]) + 2, len(samples) - 1) if loud.size else 1
    a = samples[: last + 1]
    t = np.arange(len(a), dtype=np.float64) * step
    knots = _knots(a, step, SHAPE_ERROR * peak)
    values = _fitted(t, a, knots)
    rows = np.zeros((len(knots) - 1, 7))
    rows[:, T0], rows[:, T1] = knots[:-1], knots[1:]
    rows[:, C0] = values[:-1]
    rows[:, C1] = np.diff(values) / np.diff(knots)
    return rows


def _knots(a: FloatArray, step: float, error: float) -> FloatArray:
    n = len(a)
    bend = np.zeros(n)
    if n > 2:
        bend[1:-1] = np.abs(np.diff(a, 2)) / step**2
    # The widest of five neighbours: a knot is no use just behind a corner.
    wide = np.pad(bend, 2, mode="edge")
    bend = np.max(np.lib.stride_tricks.sliding_window_view(wide, 5), axis=1)
    densest = 1.0 / (FINEST * step)
    density = np.clip(np.sqrt(bend / max(8.0 * error, 1e-300)), 1e-3 * densest, densest)
    way = np.concatenate([[0.0], np.cumsum(0.5 * (density[1:] + density[:-1]) * step)])
    total = float(way[-1])
    count = max(1, math.ceil(total))
    knots = np.interp(np.linspace(0.0, total, count + 1), way, np.arange(n) * step)
    knots[0], knots[-1] = 0.0, (n - 1) * step
    return knots


def _fitted(t: FloatArray, a: FloatArray, knots: FloatArray) -> FloatArray:
    """Return the values at `knots` of the polygon nearest to the samples (normal equations: three diagonals)."""
    m: int = len(knots)
    left = np.clip(np.searchsorted(knots, t, side="right") - 1, 0, m - 2)
    share = (t - knots[left]) / (knots[left + 1] - knots[left])
    band = np.zeros((2, m))
    band[0] = np.bincount(left, (1.0 - share) ** 2, m) + np.bincount(left + 1, share**2, m)
    band[1] = np.bincount(left, share * (1.0 - share), m)
    right = np.bincount(left, (1.0 - share) * a, m) + np.bincount(left + 1, share * a, m)
    # A knot without a sample of its own keeps to its neighbours' line.
    band[0] += 1e-9
    right += 1e-9 * np.interp(knots, t, a)
    return np.asarray(cast("FloatArray", solveh_banded(band, right, lower=True)), dtype=np.float64)


def delayed(rows: FloatArray, delay: float) -> FloatArray:
    """Return pieces that begin `delay` s later, after a still base; none where there is no delay."""
    if delay <= 0.0:
        return rows
    later = rows.copy()
    later[:, :2] += delay
    later[1:, T0] = later[:-1, T1]
    still = np.zeros((1, 7))
    still[0, T1] = later[0, T0]
    return np.concatenate([still, later])


def cut_at(rows: FloatArray, times: FloatArray) -> FloatArray:
    """Return the same motion with a piece's end at each of `times` inside it, and still pieces up to the last one."""
    end = rows[-1, T1]
    if len(times) and times[-1] > end:
        still = np.zeros((1, 7))
        still[0, :2] = end, times[-1]
        rows = np.concatenate([rows, still])
    edges = np.union1d(np.append(rows[:, T0], rows[-1, T1]), times[times > 0.0])
    which = np.searchsorted(rows[:, T0], edges[:-1], side="right") - 1
    result = rows[which]
    gone = edges[:-1] - rows[which, T0]
    result[:, C0] += result[:, C1] * gone
    result[:, PHASE] += result[:, OMEGA] * gone
    result[:, T0], result[:, T1] = edges[:-1], edges[1:]
    return result


def stacked(motions: list[FloatArray]) -> FloatArray:
    """Return motions as one array, shape (m, n, 7), the shorter ones with still pieces behind them."""
    longest = max(len(rows) for rows in motions)
    result = np.zeros((len(motions), longest, 7))
    for target, rows in zip(result, motions, strict=True):
        target[: len(rows)] = rows
        spare = rows[-1, T1] + 1e-3 * np.arange(longest - len(rows) + 1)
        target[len(rows) :, T0], target[len(rows) :, T1] = spare[:-1], spare[1:]
    return result
