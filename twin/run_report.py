"""What a live run came to: peaks, outcomes, how late the cycles were."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from twin.trips import Trip

LYING = 0.5 * math.pi
SENSOR_FLOOR = 2e-3
"""A measured rotation up to here may be noise alone, rad."""
SENSOR_SLACK = 0.01
"""A measured rotation this close to pi/2 counts as lying, rad (quantisation and noise)."""


@dataclass(slots=True)
class Lateness:
    """How late the cycles began, how long they took, the twin's processor time in them, from SYNC to the answers; s."""

    starts: list[float] = field(default_factory=list[float])
    works: list[float] = field(default_factory=list[float])
    thoughts: list[float] = field(default_factory=list[float])
    answers: list[float] = field(default_factory=list[float])

    def percentiles(self) -> dict[str, float]:
        """Return p50, p99, p99.9 and the largest of lateness, work, twin and answer, in microseconds."""
        result: dict[str, float] = {}
        for name, values in (
            ("lateness", self.starts),
            ("work", self.works),
            ("twin", self.thoughts),
            ("answer", self.answers),
        ):
            known = [value for value in values if not math.isnan(value)]
            data = np.asarray(known if known else [0.0]) * 1e6
            for label, q in (("p50", 50.0), ("p99", 99.0), ("p999", 99.9), ("max", 100.0)):
                result[f"{name}_{label}_us"] = round(float(np.percentile(data, q)), 1)
        return result


@dataclass(slots=True)
class RunReport:
    """What a live run came to.

    `stopping` counts the cycles of the way down after a trip. `tripped` says why the run was stopped, None where it was
    performed to its end; `trips` are all that latched, `advice` what was advised from when on, s. Peaks are largest
    |rotation|, rad; `largest_difference` is that of |predicted - measured| while neither block lay on its side, rad.
    Cycles that were due are `executed` or `missed`; none is run twice.
    """

    tripped: str | None = None
    trips: list[Trip] = field(default_factory=list[Trip])
    advice: list[tuple[float, str]] = field(default_factory=list[tuple[float, str]])
    executed: int = 0
    missed: int = 0
    stopping: int = 0
    predicted_peak: float = 0.0
    measured_peak: float = math.nan
    largest_difference: float = math.nan
    predicted_overturned: bool = False
    measured_overturned: bool = False
    timing: Lateness = field(default_factory=Lateness)
    scheduling: str = "ordinary"

    @property
    def predicted_outcome(self) -> str:
        """overturned, rocked or stayed, as predicted."""
        return "overturned" if self.predicted_overturned else "rocked" if self.predicted_peak > 0.0 else "stayed"

    @property
    def measured_outcome(self) -> str:
        """overturned, rocked or stayed, as measured; "unknown" without a sensor."""
        if math.isnan(self.measured_peak):
            return "unknown"
        if self.measured_overturned:
            return "overturned"
        return "rocked" if self.measured_peak > SENSOR_FLOOR else "stayed"

    def see(self, predicted: float, measured: float) -> None:
        """Take one cycle's rotations, rad, into the peaks."""
        self.predicted_peak = max(self.predicted_peak, abs(predicted))
        self.predicted_overturned |= abs(predicted) >= LYING
        if not math.isnan(measured):
            self.measured_peak = max(abs(measured), 0.0 if math.isnan(self.measured_peak) else self.measured_peak)
            self.measured_overturned |= abs(measured) >= LYING - SENSOR_SLACK
            if not (self.predicted_overturned or self.measured_overturned):
                known = 0.0 if math.isnan(self.largest_difference) else self.largest_difference
                self.largest_difference = max(known, abs(predicted - measured))
