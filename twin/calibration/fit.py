"""Fit a free-rocking recording: from the impacts found in it to the course that its samples say best."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.calibration.course import BoolArray, Flights
from twin.calibration.entry import Entry, with_entry
from twin.calibration.flights_seen import Seen, flights_seen, laid_out
from twin.calibration.least_squares import Adjusted, Known, adjust
from twin.calibration.repair import repaired, zero_of
from twin.calibration.whole_flights import Evidence, misfits, settled
from twin.errors import InputError
from twin.rocking_data.impacts import Impacts, find_impacts
from twin.rocking_data.noise import FloatArray, noise_level

LEAST_SAMPLES = 20
"""Fewest samples of a recording."""
LEAST_NOISE = 1e-9
"""Noise of a recording without any, rad."""
QUIET = 1.3
"""Residuals of flights across gaps are no larger than so many times the noise."""
WILD = 6.0
"""A sample further off than so many deviations is wild, and left out."""
FAR, AROUND, FASTEST = 10.0, 7, 0.99
"""Before the fit: further from the median of so many samples than so many deviations, and what the block moves in as
many samples at nearly its fastest."""
MOST_WILD = 0.02
"""Where more than this part is wild, it is not the samples that are wrong."""
BLOCKS = (8, 32)
"""Neighbouring residuals whose sums say whether they are independent."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A recording and the course that fits it.

    Attributes
    ----------
    time, rotation : ndarray, shape (n,)
        What was measured, s, rad, finite samples only.
    impacts : Impacts
        As found in them.
    flights : Flights
        What was fitted.
    adjusted : Adjusted
    how : str or None
        How the first flight began; None where it is not among them.
    white : float
        Noise as the third differences say it, rad.
    noise : float
        Standard deviation of the residuals, rad.
    inflation : float
        How many times larger variances are than with white noise, at least 1.
    repairs : tuple of str
        What was done to the flights found, in words.
    """

    time: FloatArray
    rotation: FloatArray
    impacts: Impacts
    flights: Flights
    adjusted: Adjusted
    how: str | None
    white: float
    noise: float
    inflation: float
    repairs: tuple[str, ...]

    @property
    def alpha(self) -> float:
        """Slenderness, rad."""
        return float(np.exp(self.adjusted.x[self.flights.instants]))

    @property
    def p(self) -> float:
        """Frequency parameter, rad/s."""
        return float(np.exp(self.adjusted.x[self.flights.instants + 1]))

    @property
    def zero(self) -> float:
        """What the sensor reads at rest, rad."""
        return float(self.adjusted.x[-1])

    @property
    def covariance(self) -> FloatArray:
        """Of the unknowns."""
        return self.adjusted.covariance * self.inflation


def fit_free_rocking(time: FloatArray, rotation: FloatArray, known: Known) -> Fit:
    """Fit a free-rocking recording.

    Parameters
    ----------
    time, rotation : ndarray, shape (n,)
        s, increasing; rad, NaN where missing.
    known : Known
        What is known of slenderness and frequency parameter before.

    Raises
    ------
    InputError
        It has no whole flight between two impacts that can be seen.
    """
    seen = np.isfinite(time) & np.isfinite(rotation)
    time, rotation = time[seen], rotation[seen]
    if time.size < LEAST_SAMPLES:
        raise InputError(f"the recording has {time.size} samples with a rotation; it takes {LEAST_SAMPLES}")
    noise = max(noise_level(time, rotation), LEAST_NOISE)
    kept = ~_wild(rotation, noise)
    time, rotation = time[kept], rotation[kept]
    evidence = Evidence(time, rotation, noise, known)
    offset = zero_of(evidence)
    impacts = find_impacts(time, rotation, offset=offset)
    plain, bridged = (flights_seen(time, rotation - offset, impacts, bridge=bridge) for bridge in (False, True))
    if not laid_out(time, rotation, bridged)[1].size:
        raise InputError(_nothing_in(rotation - offset, impacts, evidence.noise))
    fit = _fitted(evidence, impacts, bridged, offset)
    if bridged.time.size > plain.time.size or not np.array_equal(bridged.whole, plain.whole):
        fit = _bridge(fit, evidence, impacts, plain, offset)
    return _told(_determined(fit), int(np.count_nonzero(~kept)))


def _determined(fit: Fit) -> Fit:
    """Return the fit; raises InputError where its samples do not say each of its unknowns."""
    diagonal = np.diagonal(fit.adjusted.normal)
    if not (np.all(np.isfinite(diagonal)) and np.all(diagonal > 0.0) and np.all(np.isfinite(fit.adjusted.covariance))):
        raise InputError("no rigid block rocks as this recording does: its samples determine none")
    return fit


def _told(fit: Fit, number: int) -> Fit:
    """Return the fit with a note of the wild samples, those left out before and those of the fit."""
    number += int(np.count_nonzero(~fit.adjusted.kept))
    words = (f"{number} wild sample{'s' * (number > 1)} left out",) if number else ()
    return replace(fit, repairs=(*fit.repairs, *words))


def _wild(rotation: FloatArray, noise: float) -> BoolArray:
    """Return which samples are far from those around them: further than noise and the block's own motion explain."""
    beside = np.pad(rotation, AROUND // 2, mode="edge")
    usual = np.median(np.lib.stride_tricks.sliding_window_view(beside, AROUND), axis=1)
    fastest = float(np.quantile(np.abs(np.diff(usual)), FASTEST))
    wild = np.abs(rotation - usual) > FAR * noise + AROUND * fastest
    return wild & (np.count_nonzero(wild) <= MOST_WILD * wild.size)


def _bridge(fit: Fit, evidence: Evidence, impacts: Impacts, plain: Seen, offset: float) -> Fit:
    """Return the fit with impacts put into gaps where all its flights fit, else that of what is seen whole."""
    added = np.setdiff1d(fit.adjusted.x[: fit.flights.instants], plain.time).size
    whole = not np.any(misfits(fit.flights, fit.adjusted, evidence.noise)) and fit.noise <= QUIET * fit.white
    if (whole and not fit.repairs) or not laid_out(evidence.time, evidence.rotation, plain)[1].size:
        words = "flights across gaps of the recording are fitted as well"
        return replace(fit, repairs=(*fit.repairs, words)) if added else fit
    return _fitted(evidence, impacts, plain, offset)


def _nothing_in(rotation: FloatArray, impacts: Impacts, noise: float) -> str:
    highest = float(np.max(np.abs(rotation)))
    if highest >= 0.5 * np.pi - 0.02 and len(impacts) < 2:
        return "the block falls before it has rocked twice: there is no flight between two impacts to calibrate from"
    return (
        f"no whole flight between two impacts is seen: {len(impacts)} impact{'s' * (len(impacts) != 1)}, largest "
        f"rotation {highest:.3g} rad, noise {noise:.2g} rad; it takes two impacts and flights ten times the noise"
    )


def _fitted(evidence: Evidence, impacts: Impacts, seen: Seen, offset: float) -> Fit:
    time, rotation, white, known = evidence
    flights, adjusted, seen, repairs = repaired(evidence, seen, offset)
    how: str | None = None
    entry = _entry(evidence, impacts, seen, flights, adjusted)
    if entry is not None:
        flights, adjusted, how = entry
        flights, adjusted = settled(flights, adjusted, evidence)
    adjusted = _without_wild(flights, adjusted, white, known)
    noise = _noise(adjusted, white)
    if noise != white:
        adjusted = adjust(flights, adjusted.x, noise, known, adjusted.kept)
    inflation = _inflation(adjusted, noise)
    return Fit(time, rotation, impacts, flights, adjusted, how, white, noise, inflation, tuple(repairs))


def _entry(evidence: Evidence, impacts: Impacts, seen: Seen, flights: Flights, adjusted: Adjusted) -> Entry | None:
    first = int(laid_out(evidence.time, evidence.rotation, seen)[1][0])
    row = int(np.argmin(np.abs(impacts.time - seen.time[first])))
    if first > 0 or row > 0 or np.any(impacts.hidden[:, 0] < seen.time[first]):
        # The flight before it came after an impact, or may have: none by which a recording begins.
        return None
    return with_entry(evidence, flights, adjusted, abs(float(impacts.rate_before[row])))


def _without_wild(flights: Flights, adjusted: Adjusted, noise: float, known: Known) -> Adjusted:
    """Return the fit without wild samples."""
    usual = max(float(np.median(np.abs(adjusted.misfit))) / 0.6745, noise)
    wild = np.abs(adjusted.misfit) > WILD * usual
    number = int(np.count_nonzero(wild))
    if not number or number > MOST_WILD * wild.size:
        return adjusted
    return adjust(flights, adjusted.x, noise, known, ~wild)


def _noise(adjusted: Adjusted, white: float) -> float:
    """Return the standard deviation of the residuals, by their degrees of freedom."""
    freedom = int(np.count_nonzero(adjusted.kept)) - int(np.count_nonzero(adjusted.free))
    if freedom < 10:
        return white
    return max(float(np.sqrt(np.sum(adjusted.misfit[adjusted.kept] ** 2) / freedom)), LEAST_NOISE)


def _inflation(adjusted: Adjusted, noise: float) -> float:
    """Return how many times larger the variance of sums of residuals is than that of independent ones, at least 1.

    From sums over `BLOCKS` neighbours; what chance alone makes of it counts as 1.
    """
    rows = adjusted.misfit[adjusted.kept]
    largest = 1.0
    for length in BLOCKS:
        blocks = rows.size // length
        if blocks < 8:
            continue
        sums = np.add.reduceat(rows[: blocks * length], np.arange(0, blocks * length, length))
        ratio = float(np.mean(sums**2)) / (length * noise**2)
        if ratio > 1.0 + 3.0 * np.sqrt(2.0 / blocks):
            largest = max(largest, ratio)
    return largest
