"""Compare two rotations: of two recordings, or prediction and measurement of one; impact by impact."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from recordings.errors import RecordingError
from twin.rocking_data.impacts import LYING, Impacts, find_impacts
from twin.rocking_data.matching import Matches, Rocking, Shift, estimate_shift, match
from twin.rocking_data.noise import noise_level, rest_offset, steps

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.run import Run

SignalName = Literal["measured", "predicted"]
LARGEST_GAP = 3.0
"""A sample between two of the other run that are further apart than so many of its steps is not compared."""


@dataclass(frozen=True, eq=False)
class Side:
    """One rotation of the two.

    Attributes
    ----------
    name : str
        What it is called: a file, "measured", "predicted".
    time, rotation : ndarray, shape (n,)
        s on the table's clock, and rad, as recorded; only samples with a rotation.
    offset : float
        What the sensor reads at rest, rad; impacts are looked for around it. 0 where the run does not say.
    impacts : Impacts
        Found in it, never taken from the recorded events: both sides are treated alike.
    overturned : bool
        Whether the block lies at the end.
    """

    name: str
    time: NDArray[np.float64]
    rotation: NDArray[np.float64]
    offset: float
    impacts: Impacts
    overturned: bool

    @property
    def peak(self) -> float:
        """Largest |rotation|, rad."""
        return float(np.max(np.abs(self.rotation)))

    @property
    def restitution(self) -> tuple[float, float]:
        """Mean restitution, each impact weighted by the inverse of its variance, and its standard deviation.

        NaN where no impact says it. The deviation is the noise's alone: it does not say that impacts are alike.
        """
        ratio, error = self.impacts.restitution, self.impacts.restitution_error
        known = np.isfinite(ratio) & np.isfinite(error) & (error > 0.0)
        if not np.any(known):
            return math.nan, math.nan
        weight = error[known] ** -2.0
        return float(np.sum(weight * ratio[known]) / np.sum(weight)), float(np.sum(weight) ** -0.5)


@dataclass(frozen=True, eq=False)
class Comparison:
    """What two rotations have in common.

    Attributes
    ----------
    first, second : Side
    shift : float
        Time of the second minus time of the first for the same instant, as used, s.
    estimated : Shift
        The same as the impacts say it.
    matches : Matches
        Impacts of both that are the same, with `shift`; and those without a partner.
    compared : int
        Samples of the first run with a counterpart, while neither block lay.
    rms, peak_difference, peak_time : float
        Root mean square and largest of |second - first|, rad, and when that is, s on the first run's clock; NaN where
        nothing could be compared.
    difference : ndarray, shape (n,)
        second - first at the times of the first, rad; NaN where there is no counterpart.
    """

    first: Side
    second: Side
    shift: float
    estimated: Shift
    matches: Matches
    compared: int
    rms: float
    peak_difference: float
    peak_time: float
    difference: NDArray[np.float64]


def has_rotation(run: Run, signal: SignalName) -> bool:
    """Whether `run` has a rotation of that kind at all."""
    return bool(np.any(np.isfinite(_rotation(run, signal))))


def side_of(run: Run, signal: SignalName, name: str) -> Side:
    """Return the rotation of a run with its impacts.

    Raises
    ------
    RecordingError
        It has too few samples with a rotation.
    """
    time, rotation = run.cycles.time, _rotation(run, signal)
    known = np.isfinite(time) & np.isfinite(rotation)
    time, rotation = time[known], rotation[known]
    # A damaged file may go back in time: what does is left out.
    forward = np.ones(time.size, dtype=np.bool_)
    forward[1:] = time[1:] > np.maximum.accumulate(time)[:-1]
    time, rotation = time[forward], rotation[forward]
    if time.size < 4:
        raise RecordingError(f"{run.path} has no {signal} rotation to compare ({time.size} samples)")
    offset = rest_offset(rotation, noise_level(time, rotation)) or 0.0
    impacts = find_impacts(time, rotation, offset=offset)
    return Side(name, time, rotation, offset, impacts, bool(abs(rotation[-1]) >= LYING))


def compare(first: Side, second: Side, *, shift: float | None = None) -> Comparison:
    """Compare two rotations.

    The clocks are set against each other by the impacts (`twin.rocking_data.matching.estimate_shift`), or by `shift`
    where one is given, s. The second rotation is then taken at the times of the first, linearly between its samples,
    and impacts are paired one by one (`match`).
    """
    one, two = _rocking(first), _rocking(second)
    estimated = estimate_shift(one, two)
    used = estimated.seconds if shift is None else shift
    matches = estimated.matches if shift is None else match(one, two, shift)
    difference = _difference(first, second, used)
    known = np.isfinite(difference)
    count = int(np.count_nonzero(known))
    if not count:
        return Comparison(first, second, used, estimated, matches, 0, math.nan, math.nan, math.nan, difference)
    peak = int(np.nanargmax(np.abs(difference)))
    return Comparison(
        first=first,
        second=second,
        shift=used,
        estimated=estimated,
        matches=matches,
        compared=count,
        rms=float(np.sqrt(np.mean(difference[known] ** 2))),
        peak_difference=float(abs(difference[peak])),
        peak_time=float(first.time[peak]),
        difference=difference,
    )


def _rotation(run: Run, signal: SignalName) -> NDArray[np.float64]:
    return run.cycles.rotation if signal == "measured" else run.cycles.predicted_rotation


def _rocking(side: Side) -> Rocking:
    impacts = side.impacts
    rate = np.abs(impacts.rate_before)
    # An impact whose rate nobody can tell counts as a slow one.
    slow = float(np.nanmin(rate)) if np.any(np.isfinite(rate)) else 1.0
    return Rocking(
        side.time, side.rotation, impacts.time, impacts.direction, np.maximum(np.nan_to_num(rate, nan=slow), 1e-12)
    )


def _difference(first: Side, second: Side, shift: float) -> NDArray[np.float64]:
    at = first.time + shift
    step, _ = steps(second.time)
    after = np.clip(np.searchsorted(second.time, at), 1, second.time.size - 1)
    apart = second.time[after] - second.time[after - 1]
    # To a rounding error of the times: an instant at the very end is inside.
    slack = 1e-6 * step
    inside = (at >= second.time[0] - slack) & (at <= second.time[-1] + slack) & (apart <= LARGEST_GAP * step)
    other = np.interp(at, second.time, second.rotation)
    lying = np.flatnonzero((np.abs(first.rotation) >= LYING) | (np.abs(other) >= LYING))
    if lying.size:
        inside[lying[0] :] = False
    return np.where(inside, other - first.rotation, np.nan)
