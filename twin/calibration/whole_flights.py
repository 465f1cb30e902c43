"""Fit the flights between impacts: a first guess of the block, then everything; and which of them do not fit."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.calibration.course import OTHERS, BoolArray, Flights, halves, possible, sorted_out
from twin.calibration.flight import half_duration
from twin.calibration.flights_seen import Seen, bounds_of, laid_out
from twin.calibration.least_squares import Adjusted, Known, adjust
from twin.errors import InputError
from twin.rocking_data.flights import median_of_three
from twin.rocking_data.noise import FloatArray

SLENDERNESSES = (1.02, 1.08, 1.2, 1.4, 1.8, 2.5, 4.0)
"""First guesses of alpha, in parts of the highest peak, where nothing is known of it."""
LARGEST = 1.2
"""Largest of them, rad."""
MISFIT = 1.5
"""A flight does not fit where its mean square residual exceeds so many variances of the noise (and its own spread)."""
SURE = 5.0
"""And so many deviations of what chance does to it."""
SETTLING = 4
"""Times that samples beside impacts are sorted out."""


class Evidence(NamedTuple):
    """What a fit is made from.

    Attributes
    ----------
    time, rotation : ndarray, shape (n,)
        s, rad; finite samples only.
    noise : float
        Standard deviation of one of them, rad.
    known : Known
        Of the block, before.
    """

    time: FloatArray
    rotation: FloatArray
    noise: float
    known: Known


def fit_whole(evidence: Evidence, seen: Seen, offset: float) -> tuple[Flights, Adjusted]:
    """Fit the whole flights: slenderness held at the guess first, then everything."""
    flights, rows = laid_out(evidence.time, evidence.rotation, seen)
    instants = seen.time[bounds_of(rows)]
    x = np.concatenate([instants, _guess(flights, instants, offset, evidence.known), [offset]])
    if not possible(flights, x):
        x[-OTHERS + 1] = np.log(1.0 / float(np.mean(np.diff(instants))))
    if not possible(flights, x):
        raise InputError("no rigid block rocks as this recording does: its flights differ too much in length")
    held = Known(np.array([x[-OTHERS], x[-OTHERS + 1]]), np.array([0.0, np.inf]))
    x = adjust(flights, x, evidence.noise, held).x
    return settled(flights, adjust(flights, x, evidence.noise, evidence.known), evidence)


def settled(flights: Flights, adjusted: Adjusted, evidence: Evidence) -> tuple[Flights, Adjusted]:
    """Return the fit with every sample in the flight that the fit itself says."""
    for _ in range(SETTLING):
        sorted_ = sorted_out(flights, adjusted.x)
        same = np.array_equal(sorted_.time, flights.time) and np.array_equal(sorted_.flight, flights.flight)
        if same or not sorted_.time.size:
            break
        flights, adjusted = sorted_, adjust(sorted_, adjusted.x, evidence.noise, evidence.known)
    return flights, adjusted


def _guess(flights: Flights, instants: FloatArray, offset: float, known: Known) -> FloatArray:
    """Return ln alpha and ln p: those with which durations and peaks of the flights agree best."""
    size = np.abs(median_of_three(flights.rotation) - offset)
    rows = np.unique(flights.flight)
    peaks = np.array([float(np.max(size[flights.flight == k])) for k in rows])
    half = halves(flights, instants)[0][rows]
    tried = [float(np.exp(known.values[0]))] if np.isfinite(known.spreads[0]) else []
    tried = tried or [min(factor * float(np.max(peaks)), LARGEST) for factor in SLENDERNESSES]
    best = (np.inf, 0.0, 0.0)
    for alpha in tried:
        logs = np.log(half_duration(np.minimum(peaks, 0.999 * alpha), alpha) / half)
        weight = peaks**2 * half
        middle = float(np.sum(weight * logs) / np.sum(weight))
        spread = float(np.sum(weight * (logs - middle) ** 2) / np.sum(weight))
        best = min(best, (spread, float(np.log(alpha)), middle))
    p = float(known.values[1]) if np.isfinite(known.spreads[1]) else best[2]
    return np.array([best[1], p])


def misfits(flights: Flights, adjusted: Adjusted, noise: float) -> BoolArray:
    """Return which flights do not fit: their residuals exceed the noise by more than chance does."""
    count = flights.left.size
    samples = np.bincount(flights.flight[adjusted.kept], minlength=count)
    squares = np.bincount(flights.flight[adjusted.kept], adjusted.misfit[adjusted.kept] ** 2, minlength=count)
    mean = squares / np.maximum(samples, 1) / noise**2
    # Where the whole recording is noisier than its third differences say (coloured noise), that is no misfit of one.
    usual = max(float(np.median(mean)), 1.0)
    mean /= usual
    return mean > np.maximum(MISFIT, 1.0 + SURE * np.sqrt(2.0 / np.maximum(samples, 1)))
