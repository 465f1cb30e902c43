"""The rotation of a block from the motion of points on it, as cameras see them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from twin.rocking_data.noise import FloatArray


class RigidMotion(NamedTuple):
    """Motion of a rigid body in the plane, from points on it; one value a sample, NaN where fewer points are seen.

    Attributes
    ----------
    rotation : ndarray, shape (n,)
        rad from the reference, positive when the top leans to +x; continuous, not wrapped.
    translation : ndarray, shape (n, 2)
        Of the points' centre, m, along x and z.
    residual : ndarray, shape (n,)
        Root mean square distance of the points from the rigid body, m: noise of the points, or a body that is not
        rigid.
    """

    rotation: FloatArray
    translation: FloatArray
    residual: FloatArray


def rigid_motion(reference: FloatArray, points: FloatArray) -> RigidMotion:
    """Fit a rigid motion to points.

    With X, Z the reference of a point from the centre of those seen, and x, z where it is now from theirs, the
    rotation that makes the sum of squared distances least is

        theta = atan2(sum(Z x - X z), sum(X x + Z z))

    (orthogonal Procrustes problem, Schoenemann, Psychometrika 31, 1966, in the plane; the sign is that of a lean to
    +x with z up).

    Parameters
    ----------
    reference : ndarray, shape (p, 2)
        x and z of each point at rest, m, p from 2.
    points : ndarray, shape (n, p, 2)
        x and z of each point in each sample, m; a point with a NaN is not seen. Two must be.

    Raises
    ------
    ValueError
        Fewer than two points, or all in one place.

    Examples
    --------
    >>> at_rest = np.array([[0.0, 0.1], [0.0, 0.3]])
    >>> lean = np.array([[0.1 * np.sin(0.2), 0.1 * np.cos(0.2)], [0.3 * np.sin(0.2), 0.3 * np.cos(0.2)]])
    >>> round(float(rigid_motion(at_rest, lean[None]).rotation[0]), 12)
    0.2
    """
    if reference.ndim != 2 or reference.shape[0] < 2:
        raise ValueError(f"a rotation takes two points or more; there are {reference.shape[0]}")
    if float(np.max(np.ptp(reference, axis=0))) == 0.0:
        raise ValueError("the points lie all in one place: they have no rotation")
    seen = np.all(np.isfinite(points), axis=2)
    number = np.sum(seen, axis=1)
    weight = seen / np.maximum(number, 1)[:, None]
    now = np.where(seen[:, :, None], points, 0.0)
    centre_now = np.einsum("np,npc->nc", weight, now)
    centre_then = np.einsum("np,pc->nc", weight, reference)
    x = np.where(seen, now[:, :, 0] - centre_now[:, :1], 0.0)
    z = np.where(seen, now[:, :, 1] - centre_now[:, 1:], 0.0)
    big_x = np.where(seen, reference[None, :, 0] - centre_then[:, :1], 0.0)
    big_z = np.where(seen, reference[None, :, 1] - centre_then[:, 1:], 0.0)
    sine, cosine = np.sum(big_z * x - big_x * z, axis=1), np.sum(big_x * x + big_z * z, axis=1)
    known = (number >= 2) & (np.hypot(sine, cosine) > 0.0)
    rotation = np.where(known, np.arctan2(sine, cosine), np.nan)
    rotation[known] = np.unwrap(rotation[known])
    s, c = np.sin(rotation), np.cos(rotation)
    off_x = x - (big_x * c[:, None] + big_z * s[:, None])
    off_z = z - (big_z * c[:, None] - big_x * s[:, None])
    squares = np.sum(np.where(seen, off_x**2 + off_z**2, 0.0), axis=1) / np.maximum(number, 1)
    translation = np.where(known[:, None], centre_now - centre_then, np.nan)
    return RigidMotion(rotation, translation, np.sqrt(squares))
