"""The block's rotation from two displacement sensors: horizontal beams at two heights z1 < z2, fixed to the base.

Both see the block's -x face. Upright it is vertical; turned it is a straight line inclined by theta, whichever corner
the block pivots on, so a point of it at height z stands at x = c + z tan(theta), and

    theta = atan((x2 - x1) / (z2 - z1))          exactly, at every angle at which both beams meet the face;
    theta = (x2 - x1) / (z2 - z1)                for small angles: too large by theta^3 / 3, 0.34 % at 0.1 rad.

The exact formula is used. Displacements are counted from the upright block of width b and height h: for theta < 0 the
face turns about its own lower edge, c = 0, and reaches from 0 to h cos(theta); for theta > 0 it is lifted, c = b (1 - 1
/ cos(theta)), and reaches from b sin(theta) to b sin(theta) + h cos(theta).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from devices.sensors.measuring import DISPLACEMENT_INPUTS, MeasuringDevice

if TYPE_CHECKING:
    from collections.abc import Callable

    from devices.cia301.node import Send
    from devices.sensors.encoder import Encoder


def rotation_from(lower: float, upper: float, distance: float) -> float:
    """Return the rotation, rad, of a face seen at two heights.

    Parameters
    ----------
    lower, upper : float
        Displacements towards +x at the two heights, m, from those of the upright block; NaN where a beam misses.
    distance : float
        Between the heights, m, above 0.

    Examples
    --------
    >>> round(rotation_from(0.01, 0.03, 0.2), 12)
    0.099668652491
    """
    return math.atan((upper - lower) / distance)


class DisplacementPair:
    """Two beams on an emulated block.

    Parameters
    ----------
    rotation : callable
        Returns the block's true rotation, rad.
    block_width, block_height : float
        b and h, m.
    heights : tuple of float
        z1 and z2, m, with 0 < z1 < z2 < h.
    encoder : Encoder, optional
        Resolution of both; it may be replaced by a fault.

    Raises
    ------
    ValueError
        Heights that are not ordered so.
    """

    def __init__(
        self,
        rotation: Callable[[], float],
        block_width: float,
        block_height: float,
        heights: tuple[float, float],
        encoder: Encoder | None = None,
    ) -> None:
        lower, upper = heights
        if not 0.0 < lower < upper < block_height:
            raise ValueError(
                f"displacement sensors stand at {lower:g} m and {upper:g} m; they must rise within the block's "
                f"{block_height:g} m"
            )
        self.encoder = encoder
        self._rotation = rotation
        self._width, self._height = block_width, block_height
        self._heights = heights

    @property
    def distance(self) -> float:
        """Between the beams, m."""
        return self._heights[1] - self._heights[0]

    def read(self) -> tuple[float, float]:
        """Return what the lower and the upper sensor say, m; NaN where the beam misses the face."""
        theta = self._rotation()
        lift = self._width * max(math.sin(theta), 0.0)
        shift = self._width * (1.0 - 1.0 / math.cos(theta)) if theta > 0.0 else 0.0
        lower, upper = (self._seen(z, theta, lift, shift) for z in self._heights)
        return lower, upper

    def _seen(self, z: float, theta: float, lift: float, shift: float) -> float:
        if not lift <= z <= lift + self._height * math.cos(theta):
            return math.nan
        x = shift + z * math.tan(theta)
        return x if self.encoder is None else self.encoder.read(x)


def displacement_inputs(identifier: int, send: Send, pair: DisplacementPair) -> MeasuringDevice:
    """Return the node of both sensors (CiA 404, two analogue inputs)."""
    return MeasuringDevice(identifier, send, DISPLACEMENT_INPUTS, pair.read)
