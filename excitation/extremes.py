"""Exact extremes of a piece table, from the roots of its pieces and not from samples.

Between zeros of a' the acceleration is monotone, so each zero of a lies in a bracket; between those the velocity is
monotone, and so on: every extreme is found, and one located to delta is in error by delta^2 only.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, Literal, TypeAlias

import numpy as np

from excitation.pieces import Array, Indices, PieceTable

if TYPE_CHECKING:
    from collections.abc import Sequence

# Points of a table, in order: piece numbers and local times, s.
Points: TypeAlias = tuple[Indices, Array]

# A step of the acceleration below this share of its peak, or of 1 m/s2 if that is more, is no jump but rounding: of
# sin(2 pi n), or of the length of a ramp, which at 10 s into a run is known to 2e-15 s.
JUMP_TOLERANCE: Final = 1e-9

# Halvings after which a bracket is narrower than the spacing of doubles in it.
_HALVINGS: Final = 60


@dataclass(frozen=True, slots=True)
class Extremes:
    """Extremes within [0, duration].

    Attributes
    ----------
    acceleration, displacement : tuple of float
        min and max of a, m/s2, and of x, m.
    velocity : float
        max |v|, m/s.
    jerk : float
        max |da/dt| inside the pieces, m/s3.
    jump : float
        Largest step of a between pieces and at both ends, m/s2; 0 where every step is rounding (`JUMP_TOLERANCE`).
    """

    acceleration: tuple[float, float]
    velocity: float
    displacement: tuple[float, float]
    jerk: float
    jump: float


def extremes(table: PieceTable) -> Extremes:
    """Return the extremes of `table`."""
    points = turning_points(table)
    acceleration = table.acceleration_in(*points)
    points = with_crossings(table, points, "acceleration")
    velocity = float(np.abs(table.velocity_in(*points)).max())
    displacement = table.displacement_in(*with_crossings(table, points, "velocity"))
    jump = float(np.abs(jumps(table)).max())
    return Extremes(
        acceleration=(float(acceleration.min()), float(acceleration.max())),
        velocity=velocity,
        displacement=(float(displacement.min()), float(displacement.max())),
        jerk=_jerk(table),
        jump=jump,
    )


def steps(table: PieceTable) -> Array:
    """Return how much a jumps at each boundary, m/s2, shape (n + 1,), rounding included."""
    piece, zero, tau = _ends(table)
    before = np.append(0.0, table.acceleration_in(piece, tau))
    return np.append(table.acceleration_in(piece, zero), 0.0) - before


def jumps(table: PieceTable) -> Array:
    """Return `steps` with those of rounding (`JUMP_TOLERANCE`) made 0."""
    step = steps(table)
    peak = float(np.abs(table.acceleration_in(*turning_points(table))).max())
    return np.where(np.abs(step) > JUMP_TOLERANCE * max(peak, 1.0), step, 0.0)


def turning_points(table: PieceTable) -> Points:
    """Return both ends of every piece and the extremes of a between them: a is monotone from point to point."""
    piece, zero, tau = _ends(table)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        # a' = c1 + A omega cos(q + psi) = 0
        angle = np.arccos(-table.rows[:, 3] / (table.rows[:, 4] * table.rows[:, 5]))
    return _in_order([(piece, zero), _phases(table, angle), _phases(table, -angle), (piece, tau)])


def with_crossings(
    table: PieceTable, points: Points, quantity: Literal["acceleration", "velocity"], level: float = 0.0
) -> Points:
    """Return `points` with those where `quantity` (m/s2, m/s) crosses `level` put in between.

    The quantity must be monotone from point to point, so that two neighbours bracket every crossing.
    """
    value = table.acceleration_in if quantity == "acceleration" else table.velocity_in
    piece, s = points
    neighbours = piece[1:] == piece[:-1]
    piece, lower, upper = piece[:-1][neighbours], s[:-1][neighbours], s[1:][neighbours]
    sign = np.sign(value(piece, lower) - level)
    crossed = sign * np.sign(value(piece, upper) - level) < 0.0
    piece, lower, upper, sign = piece[crossed], lower[crossed], upper[crossed], sign[crossed]
    for _ in range(_HALVINGS if len(piece) else 0):
        middle = 0.5 * (lower + upper)
        before = np.sign(value(piece, middle) - level) == sign
        lower, upper = np.where(before, middle, lower), np.where(before, upper, middle)
    return _in_order([points, (piece, 0.5 * (lower + upper))])


def _ends(table: PieceTable) -> tuple[Indices, Array, Array]:
    n = len(table.rows)
    return np.arange(n), np.zeros(n), table.rows[:, 1] - table.rows[:, 0]


def _jerk(table: PieceTable) -> float:
    piece, zero, tau = _ends(table)
    # a'' = -A omega^2 sin(q + psi) = 0
    flat = [_phases(table, np.full(len(piece), angle)) for angle in (0.0, np.pi)]
    piece, s = _in_order([(piece, zero), *flat, (piece, tau)])
    _, _, _, c1, a, omega, psi = table.rows[piece].T
    return float(np.abs(c1 + a * omega * np.cos(omega * s + psi)).max())


def _phases(table: PieceTable, angle: Array) -> Points:
    """Return where q + psi = angle + 2 pi k in each sinusoidal piece; nowhere where its angle is NaN."""
    piece, _, tau = _ends(table)
    piece = piece[(table.rows[:, 4] != 0.0) & np.isfinite(angle)]
    _, _, _, _, _, omega, psi = table.rows[piece].T
    turn, angle, tau = 2.0 * np.pi, angle[piece], tau[piece]
    first = np.ceil((psi - angle) / turn)
    last = np.floor((psi + omega * tau - angle) / turn)
    count = np.maximum(last - first + 1.0, 0.0).astype(np.intp)
    row = np.repeat(np.arange(len(piece)), count)
    turns = first[row] + (np.arange(len(row)) - (np.cumsum(count) - count)[row])
    s = (angle[row] + turn * turns - psi[row]) / omega[row]
    return piece[row], np.clip(s, 0.0, tau[row])


def _in_order(groups: Sequence[Points]) -> Points:
    piece = np.concatenate([group[0] for group in groups])
    s = np.concatenate([group[1] for group in groups])
    order = np.lexsort((s, piece))
    return piece[order], s[order]
