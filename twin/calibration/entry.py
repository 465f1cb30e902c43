"""The first flight, of which only the end is an impact: let go from a tilt, or already rocking as the record begins."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.calibration.course import Flights, course, possible
from twin.calibration.flight import half_duration
from twin.calibration.flights_seen import LEAST_SAMPLES
from twin.calibration.least_squares import Adjusted, adjust
from twin.calibration.whole_flights import LARGEST, SLENDERNESSES, Evidence
from twin.rocking_data.flights import median_of_three
from twin.rocking_data.noise import FloatArray

HELD, ROCKING, LET_GO = "held", "rocking", "let go"
FALL = 0.25
"""Of a fall from a peak, the first part that does not count until it is known how the fall began."""
FAR = 5.0
"""A block held, or going up as it went down, is no more than so many deviations of the noise from it."""
AGREES = 1.2
"""Mean square of residuals, in variances of the noise, up to which samples before the fall are explained."""
FEW = 2
"""So few flights may leave the slenderness open."""
BEFORE = 8
"""Samples before the peak that say how the fall began."""
NEAREST = 0.999
"""Largest energy of the first flight, in parts of what overturns the block, that a first guess gives it."""


class Entry(NamedTuple):
    """Flights with the first one, their answer, and how that began (`HELD`, `ROCKING`, `LET_GO`: who knows)."""

    flights: Flights
    adjusted: Adjusted
    how: str


def with_entry(evidence: Evidence, flights: Flights, adjusted: Adjusted, rate: float) -> Entry | None:
    """Return the flights with the one before them; None where it has too few samples, or is none of this block.

    Parameters
    ----------
    evidence : Evidence
        The whole recording.
    flights, adjusted
        Without an entry.
    rate : float
        Angular velocity before the first impact, rad/s, as the samples around it say.
    """
    time, rotation, noise, _ = evidence
    impact = float(adjusted.x[0])
    size = -int(flights.side[0]) * (rotation - float(adjusted.x[-1]))
    begin, end = _window(time, size, impact, FAR * noise)
    if end - begin < LEAST_SAMPLES or not np.isfinite(rate):
        return None
    best: Entry | None = None
    for x in _starts(evidence, flights, adjusted, rate, median_of_three(size[begin:end])):
        for entry in _from(evidence, flights, begin, end, x):
            if best is None or _rank(entry) > _rank(best):
                best = entry
    return best


def _rank(entry: Entry) -> tuple[int, float]:
    """Return what makes one entry better than another: more samples explained, then smaller residuals."""
    return entry.flights.time.size, -entry.adjusted.squares


def _starts(
    evidence: Evidence, flights: Flights, adjusted: Adjusted, rate: float, size: FloatArray
) -> list[FloatArray]:
    """Return unknowns to begin with: peaks from the rate at the impact and from the highest samples.

    After one or two flights alone the slenderness may be far off: others are tried, with the frequency parameter by
    which the first flight still lasts as long.
    """
    highest = float(np.max(size))
    level = float(np.median(size[size > highest - FAR * evidence.noise]))
    place = flights.instants
    bodies = [adjusted.x[place : place + 2]]
    if flights.left.size <= FEW and not np.any(np.isfinite(evidence.known.spreads)):
        first = flights.rotation[flights.flight == 0] - adjusted.x[-1]
        rising = float(np.max(np.abs(first), initial=evidence.noise))
        for factor in SLENDERNESSES:
            alpha = min(factor * max(level, rising), LARGEST)
            long = float(half_duration(np.array([min(rising, 0.999 * alpha)]), alpha)[0])
            bodies.append(np.log([alpha, 2.0 * long / float(adjusted.x[1] - adjusted.x[0])]))
    starts: list[FloatArray] = []
    for body in bodies:
        alpha, p = (float(value) for value in np.exp(body))
        energy = min(0.5 * (rate / p) ** 2, NEAREST * (1.0 - np.cos(alpha)))
        for peak in (alpha - float(np.arccos(np.cos(alpha) + energy)), min(level, NEAREST * alpha)):
            start = float(adjusted.x[0]) - float(half_duration(np.array([peak]), alpha)[0]) / p
            starts.append(np.concatenate([[start], adjusted.x[:place], body, adjusted.x[-1:]]))
    return [x for x in starts if bool(np.all(np.isfinite(x))) and float(x[0]) < float(x[1])]


def _from(evidence: Evidence, flights: Flights, begin: int, end: int, x: FloatArray) -> list[Entry]:
    """Return the entries found from one start: the fall alone, and with what was before it."""
    time, rotation, noise, known = evidence
    side = -int(flights.side[0])
    found: list[Entry] = []
    fall = float(x[0]) + FALL * float(x[1] - x[0])
    first = max(int(np.searchsorted(time, fall)), begin)
    after = [x]
    falling = _joined(time[first:end], rotation[first:end], flights, side, held=False)
    if end - first >= LEAST_SAMPLES and possible(falling, x):
        answer = adjust(falling, x, noise, known)
        if _explained(answer, falling, noise):
            found.append(Entry(falling, answer, LET_GO))
            after.append(answer.x)
    for start in after:
        for held, how in ((True, HELD), (False, ROCKING)):
            if not possible(falling, start):
                continue
            earliest = _begin(time, rotation, begin, end, falling, start, noise, held=held)
            if earliest >= first or end - earliest < LEAST_SAMPLES:
                continue
            more = _joined(time[earliest:end], rotation[earliest:end], flights, side, held=held)
            answer = adjust(more, start, noise, known)
            if _explained(answer, more, noise):
                before = int(np.count_nonzero(more.time < answer.x[0]))
                found.append(Entry(more, answer, how if before >= BEFORE else LET_GO))
    return found


def _window(time: FloatArray, size: FloatArray, impact: float, band: float) -> tuple[int, int]:
    """Return the samples (begin, end) in which the block was up on that side until the impact."""
    end = int(np.searchsorted(time, impact))
    low = np.flatnonzero(median_of_three(size[:end]) <= band)
    high = np.flatnonzero(median_of_three(size[:end]) > band)
    if not high.size:
        return end, end
    # The last stay in the band is the fall's own end.
    low = low[low < high[-1]]
    return (int(low[-1]) + 1 if low.size else 0), end


def _joined(time: FloatArray, rotation: FloatArray, flights: Flights, side: int, *, held: bool) -> Flights:
    zeros = np.zeros(time.size, dtype=np.int64)
    return Flights(
        left=np.concatenate([[0], flights.left + 1]),
        right=np.concatenate([[1], flights.right + 1]),
        side=np.concatenate([[side], flights.side]),
        entry=True,
        held=held,
        instants=flights.instants + 1,
        flight=np.concatenate([zeros, flights.flight + 1]),
        time=np.concatenate([time, flights.time]),
        rotation=np.concatenate([rotation, flights.rotation]),
    )


def _explained(answer: Adjusted, flights: Flights, noise: float) -> bool:
    """Whether the entry's residuals are no larger than noise, and the others'."""
    mine = flights.flight == 0
    if not answer.converged and not np.all(np.isfinite(answer.x)):
        return False
    others = float(np.mean(answer.misfit[~mine] ** 2)) if np.any(~mine) else 0.0
    spread = 1.0 + 4.0 / np.sqrt(np.count_nonzero(mine))
    return float(np.mean(answer.misfit[mine] ** 2)) <= AGREES * spread * max(noise**2, others)


def _begin(
    time: FloatArray,
    rotation: FloatArray,
    begin: int,
    end: int,
    flights: Flights,
    x: FloatArray,
    noise: float,
    *,
    held: bool,
) -> int:
    """Return the first sample from which on the block did what it would have done so: stood still, or went up."""
    # A wild sample is no end of it: the median is looked at, in units that allow for the time of the fall's beginning.
    here = slice(begin, end)
    stretch = flights._replace(
        held=held,
        flight=np.zeros(end - begin, dtype=np.int64),
        time=time[here],
        rotation=rotation[here],
    )
    misfit = median_of_three(rotation[here] - course(stretch, x).rotation)
    half = float(x[1] - x[0])
    uncertain = np.abs(time[here] - x[0]) < 0.3 * half
    wrong = np.abs(misfit) > np.where(uncertain, 2.0 * FAR, FAR) * noise
    if not held:
        # Before that it was on the other side.
        wrong |= time[here] <= 2.0 * x[0] - x[1]
    off = np.flatnonzero(wrong)
    return begin + (int(off[-1]) + 1 if off.size else 0)
