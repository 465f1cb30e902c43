"""The rigid block and the numbers that follow from its size."""

from __future__ import annotations

import math
from typing import Annotated

from pydantic.dataclasses import dataclass

from excitation.quantity import VALUE, quantity


@dataclass(frozen=True, config=VALUE)
class Block:
    """A homogeneous rectangular block standing on its side `width`.

    Parameters
    ----------
    width, height : float
        Full width b and full height h, m, above 0.
    mass : float, optional
        kg, above 0. Rocking does not depend on it; the table's payload does.
    gravity : float
        g, m/s2.

    Raises
    ------
    pydantic.ValidationError
        A `ValueError`: where a number is not finite or not above zero.

    Examples
    --------
    >>> block = Block(0.06, 0.27)
    >>> round(block.frequency_parameter, 12)
    7.293983464474
    """

    width: Annotated[float, quantity("m", above=0.0)]
    height: Annotated[float, quantity("m", above=0.0)]
    mass: Annotated[float, quantity("kg", above=0.0)] | None = None
    gravity: Annotated[float, quantity("m/s2", above=0.0)] = 9.81

    @property
    def slenderness(self) -> float:
        """Angle alpha = atan(b / h) between the vertical side and the diagonal, rad."""
        return math.atan2(self.width, self.height)

    @property
    def half_diagonal(self) -> float:
        """R = sqrt(b2 + h2) / 2, from a corner to the centre of mass, m."""
        return 0.5 * math.hypot(self.width, self.height)

    @property
    def frequency_parameter(self) -> float:
        """p = sqrt(3 g / (4 R)), rad/s (Housner 1963)."""
        return math.sqrt(0.75 * self.gravity / self.half_diagonal)

    @property
    def housner_restitution(self) -> float:
        """eta = 1 - 3/2 sin2(alpha), ratio of angular velocities over an impact; 0 where negative (Housner 1963)."""
        return max(0.0, 1.0 - 1.5 * math.sin(self.slenderness) ** 2)

    @property
    def uplift_acceleration(self) -> float:
        """g tan(alpha) = g b / h: the block stands still under every smaller base acceleration, m/s2."""
        return self.gravity * self.width / self.height
