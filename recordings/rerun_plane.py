"""Planes drawn in Rerun's 2D views: the phase plane of the block, and an overturning map with a run's point on it.

A 2D view has no axes: they are lines and labelled points, and its y axis points down.
"""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING, Any

import numpy as np
import rerun as rr

from recordings.rerun_blueprint import PREDICTED, TIMELINE
from twin.rocking.block import Block

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from recordings.geometry import Geometry
    from recordings.map_point import MapPicture

POINT_STEP = 5e-3
"""Least time between two points of the path, s."""
TRAIL = 4.0
"""How much of a path is kept while a run goes on, s."""
LARGEST = 1.6
"""Rotations and rates beyond this, in units of the axes, are not drawn: the block has fallen."""
MARK_STEP = 0.02
"""Least time between two places of the moving mark, s."""

_AXIS = (90, 94, 104)
_BALANCE = (220, 90, 90)
_LABEL = (200, 200, 205)
_CROSS = (20, 20, 20)
_PATH = (*PREDICTED, 130)


class PhasePlane:
    """Rotation over alpha against rate over p alpha, with the line beyond which a block on a still base falls.

    Parameters
    ----------
    stream : rerun.RecordingStream
    geometry : Geometry
    gravity : float
        m/s2.
    """

    def __init__(self, stream: rr.RecordingStream, geometry: Geometry, gravity: float) -> None:
        self._stream = stream
        block = Block(geometry.width, geometry.height, gravity=gravity)
        self._alpha, self._p = block.slenderness, block.frequency_parameter
        self._trail: deque[tuple[float, float, float]] = deque()
        self._last = -math.inf
        self._frame()

    def path(self, time: NDArray[np.float64], rotation: NDArray[np.float64], rate: NDArray[np.float64]) -> None:
        """Draw the whole path of a finished run, and the mark that moves along it."""
        kept = _thinned(time, POINT_STEP)
        points = self._points(rotation[kept], rate[kept])
        strips = _pieces(points)
        if strips:
            look = rr.LineStrips2D(strips, colors=[_PATH], radii=_points(0.5))
            self._stream.log("phase/path", look, static=True, strict=True)
        kept = _thinned(time, MARK_STEP)
        self._mark(time[kept], self._points(rotation[kept], rate[kept]))

    def extend(self, time: NDArray[np.float64], rotation: NDArray[np.float64], rate: NDArray[np.float64]) -> None:
        """Go on with the path of a run that is under way: its last `TRAIL` seconds are shown."""
        points = self._points(rotation, rate)
        for moment, (x, y) in zip(time.tolist(), points.tolist(), strict=True):
            if moment - self._last >= POINT_STEP:
                self._trail.append((moment, x, y))
                self._last = moment
        while self._trail and self._trail[0][0] < self._last - TRAIL:
            self._trail.popleft()
        if not time.size:
            return
        self._stream.set_time(TIMELINE, duration=float(time[-1]))
        strips = _pieces(np.array([place[1:] for place in self._trail]).reshape(-1, 2))
        look = rr.LineStrips2D(strips, colors=[_PATH], radii=_points(0.5))
        self._stream.log("phase/path", look, strict=True)
        self._stream.reset_time()
        self._mark(time[-1:], points[-1:])

    def _points(self, rotation: NDArray[np.float64], rate: NDArray[np.float64]) -> NDArray[np.float64]:
        points = np.stack((rotation / self._alpha, -rate / (self._p * self._alpha)), axis=1)
        return np.where(np.all(np.abs(points) <= LARGEST, axis=1)[:, None], points, np.nan)

    def _mark(self, time: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        seen = np.isfinite(time) & np.all(np.isfinite(points), axis=1)
        if not np.any(seen):
            return
        index = rr.TimeColumn(TIMELINE, duration=np.rint(time[seen] * 1e9).astype("timedelta64[ns]"))
        columns = rr.Points2D.columns(positions=points[seen])
        look = rr.Points2D.from_fields(colors=[(255, 255, 255)], radii=_points(5.0))
        self._stream.log("phase/now", look, static=True, strict=True)
        self._stream.send_columns("phase/now", indexes=[index], columns=columns, strict=True)

    def _frame(self) -> None:
        """Draw the axes and the balance lines."""
        log = self._stream.log
        reach = 1.3
        axes = rr.LineStrips2D(
            [[(-reach, 0.0), (reach, 0.0)], [(0.0, -reach), (0.0, reach)]],
            colors=[_AXIS],
            radii=_points(0.4),
        )
        log("phase/axes", axes, static=True, strict=True)
        ticks = [(x, 0.0) for x in (-1.0, -0.5, 0.5, 1.0)] + [(0.0, -y) for y in (-1.0, -0.5, 0.5, 1.0)]
        names = ["-1", "-0.5", "0.5", "1"] * 2
        log("phase/ticks", _labels(ticks, names), static=True, strict=True)
        # Energy of the balance: v^2 / 2 = 1 - cos(alpha - phi), v = rate / p (elementary, a still base).
        phi = np.linspace(0.0, reach * self._alpha, 120)
        v = np.sign(self._alpha - phi) * np.sqrt(2.0 * (1.0 - np.cos(self._alpha - phi))) / self._alpha
        one = np.stack((phi / self._alpha, -v), axis=1)
        balance = rr.LineStrips2D([one, -one], colors=[_BALANCE], radii=_points(0.5))
        log("phase/balance", balance, static=True, strict=True)
        falls = rr.Points2D([(0.8, -0.9), (-0.8, 0.9)], colors=[_BALANCE], radii=[0.0], labels=["falls"] * 2)
        log("phase/falls", falls, static=True, strict=True)


def draw_map(stream: rr.RecordingStream, picture: MapPicture) -> None:
    """Draw a map's outcomes with axes, where the run lies on it, and in a document what its colours mean."""
    height, width = picture.pixels.shape[:2]
    stream.log("map/outcomes", rr.Image(np.ascontiguousarray(picture.pixels[::-1])), static=True, strict=True)
    places: list[tuple[float, float]] = []
    names: list[str] = []
    for share in (0.0, 0.5, 1.0):
        places += [(0.5 + share * (width - 1), 1.04 * height), (-0.05 * width, height - 0.5 - share * (height - 1))]
        names += [picture.column_text(share), picture.row_text(share)]
    stream.log("map/axes", _labels(places, names), static=True, strict=True)
    colours = rr.TextDocument(picture.legend_text, media_type=rr.MediaType.MARKDOWN)
    stream.log("map_colours", colours, static=True, strict=True)
    if picture.point is None:
        return
    column, row = picture.point
    place = (column + 0.5, height - 0.5 - row)
    cross = rr.LineStrips2D(
        [[(place[0], 0.0), (place[0], float(height))], [(0.0, place[1]), (float(width), place[1])]],
        colors=[_CROSS],
        radii=_points(0.5),
    )
    stream.log("map/cross", cross, static=True, strict=True)
    mark = rr.Points2D([place], colors=[_CROSS], radii=_points(5.0), labels=["this run"], show_labels=True)
    stream.log("map/run", mark, static=True, strict=True)


def _points(size: float) -> Any:
    """Return a radius in points of the screen; its type in rerun is not the one its archetypes take."""
    return [rr.Radius.ui_points(size)]


def _labels(places: list[tuple[float, float]], names: list[str]) -> rr.Points2D:
    return rr.Points2D(places, colors=[_LABEL], radii=_points(1.5), labels=names, show_labels=True)


def _thinned(time: NDArray[np.float64], step: float) -> NDArray[np.int64]:
    """Return the first sample of each `step` s."""
    if not time.size:
        return np.zeros(0, dtype=np.int64)
    return np.unique(np.floor((time - time[0]) / step), return_index=True)[1]


def _pieces(points: NDArray[np.float64]) -> list[NDArray[np.float64]]:
    """Return the stretches without a NaN that have a line in them."""
    ends = np.flatnonzero(np.diff(np.concatenate(([False], np.all(np.isfinite(points), axis=1), [False])).astype(int)))
    pieces = [points[start:stop] for start, stop in ends.reshape(-1, 2)]
    return [piece for piece in pieces if len(piece) > 1 and float(np.ptp(piece)) > 0.0]
