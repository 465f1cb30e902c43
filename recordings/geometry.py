"""Where the block stands on the table: the one place that turns a rotation into a pose.

Axes: x along the table's motion, y across it, z up. A block frame has its origin in the middle of the block's bottom
edge; at rest it coincides with the table frame, whose origin is on the table's surface.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from recordings.errors import RecordingError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

METADATA_NAME = "geometry"


@dataclass(frozen=True, slots=True)
class Geometry:
    """Size of the block, full width and full height, m.

    >>> Geometry(0.06, 0.27).to_metadata()
    {'width_m': '0.06', 'height_m': '0.27'}
    """

    width: float
    height: float

    def __post_init__(self) -> None:
        for name, value in (("width", self.width), ("height", self.height)):
            if not (math.isfinite(value) and value > 0.0):
                raise RecordingError(f"geometry asks a block {name} of {value} m; it must be finite and above 0 m")

    def to_metadata(self) -> dict[str, str]:
        """Key and value pairs of the metadata record `geometry`; `repr` keeps every bit of a double."""
        return {"width_m": repr(float(self.width)), "height_m": repr(float(self.height))}

    @classmethod
    def from_metadata(cls, values: Mapping[str, str]) -> Geometry:
        """Read what `to_metadata` wrote; RecordingError where a key is missing or is no number."""
        try:
            return cls(float(values["width_m"]), float(values["height_m"]))
        except KeyError as error:
            raise RecordingError(f"metadata 'geometry' has no key {error}") from None
        except ValueError as error:
            raise RecordingError(f"metadata 'geometry' cannot be used: {error}") from None


class Poses(NamedTuple):
    """Poses of a block frame in the table frame.

    `translation`: m, shape (n, 3). `quaternion`: unit, order x, y, z, w, shape (n, 4).
    """

    translation: NDArray[np.float64]
    quaternion: NDArray[np.float64]


def block_poses(rotation: ArrayLike, width: float) -> Poses:
    """Pose of a block of full width `width` (m), rotated by `rotation` (rad, shape (n,) or scalar) about its corner.

    Positive rotation leans the top toward +x and pivots on the +x corner, negative mirrors it. Leaning toward +x is a
    right-handed turn about +y. The pivot c = (s b/2, 0, 0), s = sign(theta), must stay where it is, so the frame's
    origin moves by c - R c = (s b/2 (1 - cos theta), 0, b/2 |sin theta|) (elementary; below |theta| = pi).

    >>> poses = block_poses([0.0, 0.1], 0.06)
    >>> poses.translation.shape, poses.quaternion.shape
    ((2, 3), (2, 4))
    >>> [float(value) for value in poses.translation[0]]
    [0.0, 0.0, 0.0]
    """
    theta = np.atleast_1d(np.asarray(rotation, dtype=np.float64))
    side = np.copysign(0.5 * width, theta)
    still = np.zeros_like(theta)
    # 1 - cos(theta) = 2 sin^2(theta/2): the difference of near-equal numbers would jitter for the smallest rotations.
    half_sine = np.sin(0.5 * theta)
    translation = np.stack((side * 2.0 * half_sine**2, still, side * np.sin(theta)), axis=1) + 0.0
    quaternion = np.stack((still, half_sine, still, np.cos(0.5 * theta)), axis=1)
    return Poses(translation, quaternion)
