"""Measurements of other systems as a recording: what they measured, and what the twin predicts of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from recordings.errors import RecordingError
from recordings.import_map import (
    BASE,
    FIXED,
    MOVING,
    RATE,
    Entry,
    column_of,
    number_of,
    points_of,
)
from twin.rocking_data.differentiation import LEAST_WINDOW, second_derivative
from twin.rocking_data.noise import noise_level, rest_offset
from twin.rocking_data.rigid import RigidMotion, rigid_motion

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.import_table import TextTable

BANDWIDTH = 20.0
"""Bandwidth of an acceleration that is made from a displacement, unless another is asked for, Hz."""
JITTER = 0.25
"""A time may be so many steps off the even grid: times are often printed with too few digits."""
LARGEST_ROTATION, LARGEST_ACCELERATION = np.pi, 1e4
"""Values beyond these, rad and m/s2, are no rocking block's: most often the unit is another."""
LONGEST_GAP = 10_000
"""Missing samples in a row that are still one recording."""


@dataclass(eq=False)
class Measured:
    """What was measured, on an even grid, in SI.

    Attributes
    ----------
    cycle : ndarray of int
        Place of each sample on the grid, from 0; places left out are samples that are missing.
    step : float
        s.
    position, acceleration, rotation : ndarray
        Base position, m, base acceleration, m/s2, rotation of the block, rad; NaN where there is none.
    words : list of str
        How each of them came about, a sentence each.
    """

    cycle: NDArray[np.int64]
    step: float
    position: NDArray[np.float64]
    acceleration: NDArray[np.float64]
    rotation: NDArray[np.float64]
    words: list[str] = field(default_factory=list[str])


def measured_in(
    table: TextTable, entries: dict[str, Entry], name: str, *, gravity: float, bandwidth: float = BANDWIDTH
) -> Measured:
    """Return what a table holds.

    Parameters
    ----------
    table : TextTable
    entries : dict
        Of `parse_map`.
    name : str
        What the file is called, for the sentences.
    gravity : float
        1 g, m/s2.
    bandwidth : float
        Of an acceleration made from a displacement, Hz.

    Raises
    ------
    RecordingError
        One sentence: a column that is not there, times that are not even, a value that is missing where it must not be,
        a map without anything to learn from.
    """
    if len(table.values) < LEAST_WINDOW:
        raise RecordingError(f"{name} has {len(table.values)} rows of numbers; it takes {LEAST_WINDOW}")
    cycle, step = _grid(table, entries, name)
    blank = np.full(cycle.size, np.nan)
    result = Measured(cycle, step, blank.copy(), blank.copy(), blank.copy())
    result.words.append(f"{cycle.size} samples at {1.0 / step:.6g} Hz")
    if missing := int(cycle[-1]) + 1 - cycle.size:
        result.words.append(f"{missing} samples are missing")
    base = _points(result, table, entries, name, gravity)
    if "rotation" in entries:
        if np.any(np.isfinite(result.rotation)):
            raise RecordingError("--map: the rotation is given by a column and by points: give one of them")
        result.rotation = column_of(entries["rotation"], table, name, gravity)
        result.words.append("rotation: as given")
    if "displacement" in entries:
        if base is not None:
            raise RecordingError("--map: the base's displacement is given by a column and by points: give one of them")
        result.position = column_of(entries["displacement"], table, name, gravity)
        result.words.append("displacement: as given")
    _acceleration(result, table, entries, name, gravity, bandwidth)
    _sensible(result.rotation, LARGEST_ROTATION, "rotation", "rad", table, name)
    _sensible(result.acceleration, LARGEST_ACCELERATION, "base acceleration", "m/s2", table, name)
    if not np.any(np.isfinite(result.rotation)) and "still" in result.words[-1]:
        raise RecordingError("--map gives neither a rotation nor a motion of the base: there is nothing to record")
    return result


def _grid(table: TextTable, entries: dict[str, Entry], name: str) -> tuple[NDArray[np.int64], float]:
    """Return each row's place on the even grid of times, and its step."""
    if RATE in entries:
        rate = number_of(entries[RATE])
        if not rate > 0.0:
            raise RecordingError(f"--map: rate is {rate:g} Hz; it must be above 0")
        return np.arange(len(table.values), dtype=np.int64), 1.0 / rate
    time = column_of(entries["time"], table, name, 0.0)
    wrong = np.flatnonzero(~np.isfinite(time))
    if wrong.size:
        raise RecordingError(f"{name}, line {table.lines[wrong[0]]}: the time is missing")
    apart = np.diff(time)
    wrong = np.flatnonzero(apart <= 0.0)
    if wrong.size:
        k = int(wrong[0])
        raise RecordingError(
            f"{name}, line {table.lines[k + 1]}: the time goes from {time[k]:.9g} to {time[k + 1]:.9g} s; it must rise"
        )
    ordinary = apart <= 1.5 * float(np.median(apart))
    # The mean of the steps without a gap: printed with few digits, not one of them need be right.
    step = float(np.mean(apart[ordinary]))
    place = np.zeros(0)
    for _ in range(3):
        place = np.concatenate(([0.0], np.cumsum(np.maximum(np.rint(apart / step), 1.0))))
        # The line through all times: each of them is rounded, their median step too.
        step = float(np.sum((place - place.mean()) * (time - time.mean())) / np.sum((place - place.mean()) ** 2))
    off = np.abs(time - time.mean() - (place - place.mean()) * step) / step
    wrong = np.flatnonzero(off > JITTER)
    if wrong.size:
        k = int(wrong[0])
        raise RecordingError(
            f"{name}, line {table.lines[k]}: the times are not evenly spaced; {time[k]:.9g} s is {off[k]:.2f} steps of "
            f"{step:.6g} s from its place; resample the file first"
        )
    longest = int(np.max(np.diff(place)))
    if longest > LONGEST_GAP:
        raise RecordingError(f"{name} misses {longest - 1} samples in a row; the limit is {LONGEST_GAP}")
    return place.astype(np.int64), step


def _points(
    result: Measured, table: TextTable, entries: dict[str, Entry], name: str, gravity: float
) -> RigidMotion | None:
    """Fill rotation and base position from the points; return the base's motion, None where no point is on it."""
    points = points_of(entries)
    on_base = {key: axes for key, axes in points.items() if key.startswith(BASE)}
    on_block = {key: axes for key, axes in points.items() if key not in on_base}
    base: RigidMotion | None = None
    turned = 0.0
    if on_base:
        base, turned_by = _base_motion(on_base, table, name, gravity)
        result.position = base.translation[:, 0] - float(base.translation[np.isfinite(base.translation[:, 0])][0, 0])
        result.words.append(f"base: mean displacement of {len(on_base)} points along x")
        if turned_by is not None:
            turned = turned_by
            result.words.append("base: its own rotation, of the same points, is subtracted from the block's")
    if on_block:
        if len(on_block) < 2:
            raise RecordingError(f"--map: one point on the block ({next(iter(on_block))}) has no rotation; give two")
        motion = _fit(on_block, table, name, gravity)
        result.rotation = motion.rotation - turned
        seen = result.rotation[np.isfinite(result.rotation)]
        if not seen.size:
            raise RecordingError(f"{name}: in no sample two points of the block are seen")
        offset = rest_offset(seen, noise_level(np.arange(seen.size, dtype=np.float64) * result.step, seen))
        result.rotation -= offset or 0.0
        zero = "the first sample" if offset is None else f"{offset:+.3g} rad of the first sample, the mean at rest"
        result.words.append(
            f"rotation: least-squares rigid rotation of {len(on_block)} points, zero at {zero}; the points are "
            f"{1e3 * float(np.sqrt(np.nanmean(motion.residual**2))):.3g} mm RMS off a rigid body"
        )
    return base


def _base_motion(
    points: dict[str, dict[str, Entry]], table: TextTable, name: str, gravity: float
) -> tuple[RigidMotion, NDArray[np.float64] | None]:
    if len(points) >= 2 and all({"x", "z"} <= set(axes) or "x0" in axes for axes in points.values()):
        motion = _fit(points, table, name, gravity)
        return motion, motion.rotation
    along = [column_of(axes.get("x") or axes["dx"], table, name, gravity) for axes in points.values()]
    moved = np.mean([values - values[np.isfinite(values)][:1] for values in along], axis=0)
    still = np.zeros_like(moved)
    return RigidMotion(still, np.stack((moved, still), axis=1), still), None


def _fit(points: dict[str, dict[str, Entry]], table: TextTable, name: str, gravity: float) -> RigidMotion:
    """Fit the rigid motion of points; the reference is `x0`, `z0`, or the first sample in which all are seen."""
    paths: list[NDArray[np.float64]] = []
    for axes in points.values():
        path = np.zeros((len(table.values), 2))
        for axis, entry in axes.items():
            if axis in MOVING:
                path[:, "xz".index(MOVING[axis][0])] += column_of(entry, table, name, gravity)
        for k, axis in enumerate(FIXED):
            if axis in axes:
                path[:, k] += number_of(axes[axis])
        paths.append(path)
    moving = np.stack(paths, axis=1)
    whole = np.flatnonzero(np.all(np.isfinite(moving), axis=(1, 2)))
    if not whole.size:
        raise RecordingError(f"{name}: the points {', '.join(points)} are never seen together")
    fixed = [[number_of(axes[axis]) for axis in FIXED] if "x0" in axes else None for axes in points.values()]
    first = moving[whole[0]]
    reference = np.array([first[k] if place is None else place for k, place in enumerate(fixed)])
    try:
        return rigid_motion(reference, moving)
    except ValueError as error:
        raise RecordingError(f"{name}: points {', '.join(points)}: {error}") from None


def _acceleration(
    result: Measured, table: TextTable, entries: dict[str, Entry], name: str, gravity: float, bandwidth: float
) -> None:
    if "acceleration" in entries:
        result.acceleration = column_of(entries["acceleration"], table, name, gravity)
        _whole(result.acceleration, table, name, "base acceleration")
        result.words.append("acceleration: as given")
    elif np.any(np.isfinite(result.position)):
        _whole(result.position, table, name, "base displacement")
        result.acceleration, said = _differentiated(result, bandwidth, name)
        result.words.append(said)
    else:
        result.acceleration = np.zeros(result.cycle.size)
        result.words.append("acceleration: none is given, the base is taken to stand still")


def _differentiated(result: Measured, bandwidth: float, name: str) -> tuple[NDArray[np.float64], str]:
    """Return the second derivative of the base position, piece by piece between missing samples, and what it is."""
    acceleration = np.empty(result.cycle.size)
    ends = [0, *(np.flatnonzero(np.diff(result.cycle) > 1) + 1).tolist(), result.cycle.size]
    noise = reached = signal = 0.0
    window = 0
    for start, stop in pairwise(ends):
        try:
            piece = second_derivative(result.position[start:stop], result.step, bandwidth)
        except ValueError:
            raise RecordingError(
                f"{name}: only {stop - start} samples between missing ones; its displacement cannot be differentiated"
            ) from None
        acceleration[start:stop] = piece.values
        if piece.window >= window:
            window, reached = piece.window, piece.bandwidth
        noise, signal = max(noise, piece.noise), max(signal, piece.signal_noise)
    return acceleration, (
        f"acceleration: second derivative of the displacement by sliding cubics over {window} samples, up to "
        f"{reached:.3g} Hz; noise {signal:.2g} m of the displacement makes {noise:.2g} m/s2"
    )


def _sensible(values: NDArray[np.float64], limit: float, what: str, unit: str, table: TextTable, name: str) -> None:
    wrong = np.flatnonzero(np.abs(values) > limit)
    if wrong.size:
        raise RecordingError(
            f"{name}, line {table.lines[wrong[0]]}: the {what} is {values[wrong[0]]:.6g} {unit}; the limit is "
            f"{limit:.5g} {unit}: is its unit the one in the map?"
        )


def _whole(values: NDArray[np.float64], table: TextTable, name: str, what: str) -> None:
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        raise RecordingError(f"{name}, line {table.lines[wrong[0]]}: the {what} is missing; the twin needs every one")
