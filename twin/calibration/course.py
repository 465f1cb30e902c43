"""The course of a free-rocking block by its unknowns: instants, slenderness, frequency parameter, the sensor's zero."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from twin.calibration.flight import Shape, growth, lean, shape_of, speed
from twin.rocking_data.noise import FloatArray

IntArray = NDArray[np.int64]
BoolArray = NDArray[np.bool_]

OTHERS = 3
"""Unknowns behind the instants: ln alpha, ln p, zero offset in rad."""
LOCAL = 5
"""Unknowns a sample depends on: the two instants of its flight, and the others."""
STEEPEST = 30.0
"""Half a flight lasts no longer than so many 1/p: it would have begun 1e-13 from the unstable equilibrium."""
SHORTEST = 1e-4
"""Nor any shorter."""
LARGEST_LOGARITHM = 20.0
"""Of alpha and p, whatever a step of the search would like."""


class Flights(NamedTuple):
    """Flights and the samples in them.

    Attributes
    ----------
    left, right : ndarray of int, shape (n,)
        Places of their two instants among the unknowns: contacts; `left` of the entry is the instant of its peak.
    side : ndarray of int
        Sign of the rotation.
    entry : bool
        Whether the first flight is one of which only the end is an impact.
    held : bool
        Whether the block stood still at that peak before (else it came up to it as it went down).
    instants : int
        Number of instants.
    flight : ndarray of int, shape (m,)
        Flight of each sample.
    time, rotation : ndarray, shape (m,)
        s; rad.
    """

    left: IntArray
    right: IntArray
    side: IntArray
    entry: bool
    held: bool
    instants: int
    flight: IntArray
    time: FloatArray
    rotation: FloatArray


class Modelled(NamedTuple):
    """What the unknowns say: shapes of the flights, rotation of each sample, and its derivatives, shape (m, LOCAL)."""

    shape: Shape
    rotation: FloatArray
    slope: FloatArray


def halves(flights: Flights, x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return half durations and instants of the peaks of the flights, s."""
    left, right = x[flights.left], x[flights.right]
    half, centre = 0.5 * (right - left), 0.5 * (left + right)
    if flights.entry:
        half[0], centre[0] = right[0] - left[0], left[0]
    return half, centre


def possible(flights: Flights, x: FloatArray) -> bool:
    """Whether flights last longer than nothing and not for ever, and slenderness is one of a block that can stand."""
    half, _ = halves(flights, x)
    logarithms = x[flights.instants : flights.instants + 2]
    if not np.all(np.isfinite(x)) or np.any(np.abs(logarithms) > LARGEST_LOGARITHM):
        return False
    alpha, p = np.exp(logarithms)
    # A flight far shorter than 1/p has no height that could be told from nothing.
    return bool(np.all(p * half > SHORTEST) and np.all(p * half < STEEPEST) and alpha < 0.5 * np.pi)


def course(flights: Flights, x: FloatArray) -> Modelled:
    """Return the rotations that the unknowns `x` say, and their derivatives.

    `x`: instants in s, then `OTHERS`; it must be `possible`.
    """
    alpha, p = (float(value) for value in np.exp(x[flights.instants : flights.instants + 2]))
    half, centre = halves(flights, x)
    long = p * half
    shape = shape_of(long, alpha)
    j = flights.flight
    late = flights.time - centre[j]
    if flights.held:
        late = np.where((j == 0) & (late < 0.0), 0.0, late)
    u = p * late
    valley = shape.valley[j]
    psi = lean(valley, u)
    rotation = flights.side[j] * (alpha - psi)
    # psi0 follows from psi(psi0, U) = alpha: d psi0 = (d alpha - v dU) / Y(U), with Y = d psi / d psi0
    ratio = growth(valley, u) / shape.growth[j]
    by_alpha = 1.0 - ratio
    by_half = ratio * shape.speed[j]
    by_u = -np.sign(u) * speed(valley, psi)
    # U = p (right - left) / 2 and u = p (t - (left + right) / 2); of the entry U = p (right - left), u = p (t - left)
    of_half = np.full(half.size, 0.5)
    at_left, at_right = np.full(half.size, 0.5), np.full(half.size, 0.5)
    if flights.entry:
        of_half[0], at_left[0], at_right[0] = 1.0, 1.0, 0.0
    slope = np.empty((u.size, LOCAL))
    slope[:, 0] = -p * (by_half * of_half[j] + by_u * at_left[j])
    slope[:, 1] = p * (by_half * of_half[j] - by_u * at_right[j])
    slope[:, 2] = alpha * by_alpha
    slope[:, 3] = by_half * long[j] + by_u * u
    slope[:, :4] *= flights.side[j][:, None]
    slope[:, 4] = 1.0
    return Modelled(shape, rotation + x[flights.instants + 2], slope)


def sorted_out(flights: Flights, x: FloatArray) -> Flights:
    """Return the flights with each sample in the one that the instants of `x` say, without those that are in none.

    Where flights were laid out by other instants, samples beside an impact are in the wrong one of two: a small error,
    but of one sign on each side.
    """
    edges = x[flights.right]
    shared = np.append(flights.right[:-1] == flights.left[1:], False)
    place = np.searchsorted(edges, flights.time, side="right")
    # From one flight to the next only where they meet; elsewhere it belongs to none.
    first = int(flights.entry)
    inside = (flights.time >= x[flights.left[np.minimum(place, edges.size - 1)]]) | ((place == 0) & bool(first))
    inside &= (place < edges.size) & (np.abs(place - flights.flight) <= 1)
    moved = np.minimum(place, flights.flight)
    inside &= (place == flights.flight) | shared[np.minimum(moved, edges.size - 1)]
    return flights._replace(
        flight=place[inside].astype(np.int64), time=flights.time[inside], rotation=flights.rotation[inside]
    )


def places(flights: Flights) -> IntArray:
    """Return the places among the unknowns of what each flight's samples depend on, shape (n, LOCAL)."""
    others = np.arange(flights.instants, flights.instants + OTHERS, dtype=np.int64)
    return np.concatenate(
        [flights.left[:, None], flights.right[:, None], np.tile(others, (flights.left.size, 1))], axis=1
    )


def normal_equations(
    flights: Flights, slope: FloatArray, misfit: FloatArray, kept: BoolArray
) -> tuple[FloatArray, FloatArray]:
    """Return J^T J and J^T r of the samples `kept`, flight by flight: a sample depends on five unknowns only."""
    count = flights.left.size
    size = flights.instants + OTHERS
    place = places(flights)
    local = np.where(kept[:, None], slope, 0.0)
    normal, right = np.zeros((size, size)), np.zeros(size)
    for a in range(LOCAL):
        np.add.at(right, place[:, a], np.bincount(flights.flight, local[:, a] * misfit, minlength=count))
        for b in range(LOCAL):
            sums = np.bincount(flights.flight, local[:, a] * local[:, b], minlength=count)
            np.add.at(normal, (place[:, a], place[:, b]), sums)
    return normal, right
