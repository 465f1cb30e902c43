"""How uncertain the run's point is on a map: the spreads of block and table as an ellipse on the map's axes.

A map is of one block; another block has the same answer elsewhere on it. With the slenderness changed by the share d at
the same diagonal, the size by r and the table's gain by g, to first order

    amplitude a0 / (g tan alpha)                 g - k d               k = alpha / (sin(alpha) cos(alpha))
    frequency omega / p,  duration p t           r / 2,  -r / 2
    peak velocity v p / (g tan alpha)            g - k d - r / 2
    stop gap x p^2 / (g tan alpha)               -k d - r

Restitution and tilt move nothing on these axes; beside an amplitude the restitution may itself be an axis.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from twin.rocking.compiled import FloatArray

AROUND = 181
"""Points of an ellipse."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Standard deviations: slenderness, size and gain as shares, restitution as it is."""

    slenderness: float = 0.0
    size: float = 0.0
    gain: float = 0.0
    restitution: float = 0.0


@dataclass(frozen=True, slots=True)
class Ellipse:
    """Covariance of a point (column value, row value) of a map, in the axes' units, and the point itself."""

    column: float
    row: float
    covariance: FloatArray

    @property
    def deviations(self) -> tuple[float, float]:
        """Standard deviations along the axes: column, row."""
        return math.sqrt(float(self.covariance[0, 0])), math.sqrt(float(self.covariance[1, 1]))

    def outline(self, sigmas: float) -> tuple[FloatArray, FloatArray]:
        """Return columns and rows around the ellipse `sigmas` standard deviations wide; a line where one is 0."""
        values, vectors = np.linalg.eigh(self.covariance)
        turn = np.linspace(0.0, 2.0 * math.pi, AROUND)
        circle = np.stack([np.cos(turn), np.sin(turn)])
        points = vectors @ (np.sqrt(np.maximum(values, 0.0))[:, None] * circle)
        return self.column + sigmas * points[0], self.row + sigmas * points[1]


def ellipse_of(kind: str, alpha: float, column: float, row: float, spread: Spread) -> Ellipse:
    """Return the ellipse of a point on a map of `kind`; see `twin.map.grid.KINDS`, and "restitution" for that column.

    Examples
    --------
    >>> e = ellipse_of("sine", 0.2, 2.0, 1.0, Spread(gain=0.01, size=0.02))
    >>> [round(value, 9) for value in e.deviations]
    [0.02, 0.01]
    """
    k = alpha / (math.sin(alpha) * math.cos(alpha))
    # Of slenderness, size and gain.
    amplitude = (-k, 0.0, 1.0)
    columns = {"constant": (0.0, -0.5, 0.0), "double pulse": (-k, -1.0, 0.0), "restitution": (0.0, 0.0, 0.0)}
    rows = {"double pulse": (-k, -0.5, 1.0)}
    jacobian = np.array([columns.get(kind, (0.0, 0.5, 0.0)), rows.get(kind, amplitude)])
    jacobian *= np.array([[column], [row]])
    variances = np.diag([spread.slenderness**2, spread.size**2, spread.gain**2])
    covariance = jacobian @ variances @ jacobian.T
    if kind == "restitution":
        covariance[0, 0] += spread.restitution**2
    return Ellipse(column, row, covariance)
