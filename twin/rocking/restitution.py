"""What an impact leaves of the angular velocity: Housner's ratio, the improved one, or a measured number."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TypeAlias

from twin.rocking.block import Block


@dataclass(frozen=True, slots=True)
class Improved:
    """Restitution of an impact whose impulse acts at `k` times the half width from the centre of the base.

    eta = (4 - 3 s (1 + k)) / (4 - 3 s (1 - k)), s = sin2(alpha): from angular momentum about the impulse's point,
    with both corners kept on the base. k = 1 is Housner's (the impulse at the new corner), k = 0 loses nothing. The
    form is linear in k; a published other form has k squared in its place.

    Parameters
    ----------
    k : float
        0 to 1.

    Raises
    ------
    ValueError
        Where k is outside 0 to 1, or not a number.

    Examples
    --------
    >>> Improved(0.0).ratio(Block(0.06, 0.27))
    1.0
    """

    k: float

    def __post_init__(self) -> None:
        if not 0.0 <= self.k <= 1.0:
            raise ValueError(f"k of the improved restitution is {self.k:g}; it is a share of the half width, 0 to 1")

    def ratio(self, block: Block) -> float:
        """Return eta of `block`, 0 where the form is negative: the block then stays on its new corner."""
        s = math.sin(block.slenderness) ** 2
        return max(0.0, (4.0 - 3.0 * s * (1.0 + self.k)) / (4.0 - 3.0 * s * (1.0 - self.k)))


Restitution: TypeAlias = float | Improved | None
"""None: Housner's; a float: a measured ratio of angular velocities, 0 to 1."""


def restitution_ratio(block: Block, restitution: Restitution) -> float:
    """Return eta, the ratio of angular velocities after and before an impact.

    Raises
    ------
    ValueError
        Where it is outside 0 to 1, or not a number.
    """
    if restitution is None:
        return block.housner_restitution
    if isinstance(restitution, Improved):
        return restitution.ratio(block)
    if not 0.0 <= restitution <= 1.0:
        raise ValueError(f"restitution is {restitution:g}; it is a ratio of angular velocities, from 0 to 1")
    return restitution
