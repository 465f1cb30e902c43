"""Where the impacts found are not all impacts, or not all of them are found: other flights that fit better."""

from __future__ import annotations

import numpy as np

from twin.calibration.course import Flights, IntArray
from twin.calibration.flights_seen import Seen, flights_seen, laid_out
from twin.calibration.least_squares import Adjusted
from twin.calibration.whole_flights import Evidence, fit_whole, misfits
from twin.rocking_data.impacts import find_impacts
from twin.rocking_data.noise import rest_offset

REPAIRS = 8
ZERO_MOVED = 1.0
"""Impacts are looked for again where the zero is further off than so many deviations of the noise."""
ZEROS = 4
"""Zeros tried."""


def zero_of(evidence: Evidence) -> float:
    """Return the sensor's zero about which impacts are best looked for: that with which most flights fit.

    What is read at rest is tried, none, and what the fits of those say themselves.
    """
    tried: dict[float, bool | None] = dict.fromkeys([rest_offset(evidence.rotation, evidence.noise) or 0.0, 0.0])
    best = (-1, next(iter(tried)))
    for _ in range(ZEROS):
        offset = next((value for value, done in tried.items() if done is None), None)
        if offset is None:
            break
        tried[offset] = True
        impacts = find_impacts(evidence.time, evidence.rotation, offset=offset)
        seen = flights_seen(evidence.time, evidence.rotation - offset, impacts, bridge=True)
        if not laid_out(evidence.time, evidence.rotation, seen)[1].size:
            continue
        flights, adjusted = fit_whole(evidence, seen, offset)
        good = int(np.count_nonzero(~misfits(flights, adjusted, evidence.noise)))
        if good > best[0]:
            best = (good, offset)
        found = float(adjusted.x[-1])
        if adjusted.converged and min(abs(found - value) for value in tried) > ZERO_MOVED * evidence.noise:
            tried[found] = None
    return best[1]


def repaired(evidence: Evidence, seen: Seen, offset: float) -> tuple[Flights, Adjusted, Seen, list[str]]:
    """Return the fit of the whole flights, after merging what was split and leaving out the end where it does not fit.

    Each change is taken only where it fits better: a merge where the misfit of the three flights it joins is gone, a
    cut where nothing else helps and what is left fits.
    """
    repairs: list[str] = []
    flights, adjusted = fit_whole(evidence, seen, offset)
    for _ in range(REPAIRS):
        bad = misfits(flights, adjusted, evidence.noise)
        if not np.any(bad):
            break
        rows = laid_out(evidence.time, evidence.rotation, seen)[1]
        for change, words in _changes(seen, rows[bad]):
            if not laid_out(evidence.time, evidence.rotation, change)[1].size:
                continue
            others, answer = fit_whole(evidence, change, offset)
            if np.count_nonzero(misfits(others, answer, evidence.noise)) < np.count_nonzero(bad):
                seen, flights, adjusted = change, others, answer
                repairs.append(words)
                break
        else:
            break
    return flights, adjusted, seen, repairs


def _changes(seen: Seen, bad: IntArray) -> list[tuple[Seen, str]]:
    """Return what may help flights that do not fit, the least change first."""
    changes: list[tuple[Seen, str]] = []
    lasting = np.diff(seen.time)
    near = sorted(
        {k for j in bad.tolist() for k in (j - 1, j, j + 1) if 0 <= k < seen.whole.size}, key=lambda k: lasting[k]
    )
    for k in near[:3]:
        beside = [lasting[m] for m in (k - 1, k + 1) if 0 <= m < lasting.size]
        if lasting[k] < 0.5 * max(beside, default=0.0):
            changes.append((seen.without(k), f"impacts at {seen.time[k]:.3f} and {seen.time[k + 1]:.3f} s are none"))
    first, last = int(bad[0]), int(bad[-1])
    if last > 0 and last >= seen.whole.size // 2:
        end = int(bad[bad >= seen.whole.size // 2][0])
        if end > 0:
            changes.append(
                (seen.at(0, end + 1), f"flights from {seen.time[end]:.3f} s on are left out: they do not fit")
            )
    if first == 0 and seen.whole.size > 1:
        changes.append((seen.at(1, seen.time.size), f"the flight at {seen.time[0]:.3f} s is left out: it does not fit"))
    return changes
