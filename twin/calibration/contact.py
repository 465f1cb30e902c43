"""Edge contact against full contact: what of the restitution is the material's, and what the base's shape.

A block that touches its base at its two edges only takes every impulse at the new corner, as Housner assumed: what its
restitution is off Housner's is lost in the material (N. Ceh, thesis 2018, section 4.4). The same material under a full
base then says where the impulse acts:

    material = eta_edge / (1 - 3/2 sin2(alpha_edge))        eta_full = material * improved(k)
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.calibration.calibrate import RESTITUTION, SLENDERNESS, Calibration, K, improved_k
from twin.calibration.estimate import Estimate


@dataclass(frozen=True, eq=False)
class Contact:
    """The comparison.

    Attributes
    ----------
    edge : Calibration
        Of the block on its edges.
    material : Estimate
        Ratio of the edge's restitution to Housner's.
    shape : Estimate
        What is left of the full contact's restitution: divided by `material`.
    k : Estimate
        Of the improved formula, from `shape`.
    """

    edge: Calibration
    material: Estimate
    shape: Estimate
    k: Estimate


def compare_contact(full: Calibration, edge: Calibration) -> Contact:
    """Compare a block on its full base with one of the same material on its edges; errors of the two are independent.

    What slenderness does to both of a calibration's numbers is taken along: its restitution and its Housner's.
    """
    eta, housner = edge.estimates[RESTITUTION], edge.housner
    part = math.hypot(eta.error / eta.value, housner.error / housner.value)
    material = Estimate.positive(eta.value / housner.value, part, edge.overall.quantile)
    measured = full.estimates[RESTITUTION]
    both = math.hypot(measured.error / measured.value, part)
    quantile = max(full.overall.quantile, edge.overall.quantile)
    shape = Estimate.positive(measured.value / material.value, both, quantile)
    alpha = full.estimates[SLENDERNESS].value
    # dk/d eta of the improved formula at `shape`, by a difference; what its slenderness adds is that of k itself.
    step = 1e-6
    slope = (improved_k(shape.value + step, alpha) - improved_k(shape.value - step, alpha)) / (2.0 * step)
    own = full.estimates[K]
    direct = (improved_k(measured.value + step, alpha) - improved_k(measured.value - step, alpha)) / (2.0 * step)
    geometry = max(own.error**2 - (direct * measured.error) ** 2, 0.0)
    k = Estimate.plain(improved_k(shape.value, alpha), math.sqrt((slope * shape.error) ** 2 + geometry), quantile)
    return Contact(edge, material, shape, k)
