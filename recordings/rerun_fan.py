"""The futures of a run in Rerun: 32 courses of the rotation from now on, and a ghost of the block as it will be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import rerun as rr

from recordings.geometry import block_poses
from recordings.rerun_blueprint import ESTIMATED, FUTURES_SPAN, STOPPED, TIMELINE

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from twin.foresight import Foresight

INTERVAL = 0.05
"""Least table time between two drawings, s: 20 a second."""
GHOST_AHEAD = 0.25
"""How far ahead the ghost is, s."""
CLIPPED = 1.55
"""Rotations beyond are not drawn, rad: a future that reaches the ground stays there."""
_FUTURE, _NOW = (*ESTIMATED, 70), (*ESTIMATED, 255)
_LIMIT = (*STOPPED, 160)


class Fan:
    """Follows a run's samples in the viewer's process and draws what may come of them.

    Parameters
    ----------
    stream : rerun.RecordingStream
    foresight : Foresight
        Of the run, before its first sample.
    geometry : Geometry
        Size of the block.
    """

    def __init__(self, stream: rr.RecordingStream, foresight: Foresight, geometry: Geometry) -> None:
        self._stream = stream
        self._foresight = foresight
        self._alpha = math.atan2(geometry.width, geometry.height)
        self._width = geometry.width
        self._drawn = -math.inf
        barrier = [[(0.0, side), (FUTURES_SPAN, side)] for side in (-1.0, 0.0, 1.0)]
        stream.log("futures/barrier", rr.LineStrips2D(barrier, colors=[_LIMIT, (90, 90, 90), _LIMIT]), static=True)
        height = geometry.height
        ghost = rr.Boxes3D(
            centers=[(0.0, 0.0, 0.5 * height)],
            half_sizes=[(0.5 * self._width, 0.6 * self._width, 0.5 * height)],
            colors=[(*ESTIMATED, 60)],
            fill_mode=rr.components.FillMode.TransparentFillMajorWireframe,
        )
        stream.log("world/table/future", ghost, static=True)

    def follow(self, time: float, acceleration: float, rotation: float) -> None:
        """Take a sample: table's clock s, base acceleration m/s2, measured rotation rad or NaN."""
        self._foresight.follow(time, acceleration, rotation)
        if time - self._drawn >= INTERVAL:
            self._drawn = time
            self._draw(time)

    def follow_all(
        self, times: NDArray[np.float64], accelerations: NDArray[np.float64], rotations: NDArray[np.float64]
    ) -> None:
        """Take many samples; those whose time or acceleration is not finite are left out."""
        for time, acceleration, rotation in zip(
            times.tolist(), accelerations.tolist(), rotations.tolist(), strict=True
        ):
            if math.isfinite(time) and math.isfinite(acceleration):
                self.follow(time, acceleration, rotation)

    def _draw(self, time: float) -> None:
        ahead, rotations = self._foresight.fan(FUTURES_SPAN)
        x = ahead - time
        strips = [np.column_stack((x, -np.clip(row, -CLIPPED, CLIPPED) / self._alpha)) for row in rotations]
        colours = [_NOW] + [_FUTURE] * (len(strips) - 1)
        self._stream.set_time(TIMELINE, duration=time)
        # The estimate last, so that it lies above the others.
        self._stream.log("futures/courses", rr.LineStrips2D(strips[::-1], colors=colours[::-1]))
        there = float(np.interp(GHOST_AHEAD, x, rotations[0]))  # pyright: ignore[reportUnknownArgumentType]
        pose = block_poses(min(max(there, -CLIPPED), CLIPPED), self._width)
        turn = rr.Quaternion(xyzw=pose.quaternion[0])
        self._stream.log("world/table/future", rr.Transform3D(translation=pose.translation[0], quaternion=turn))
