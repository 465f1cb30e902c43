"""The block turns about the corner that touches the table, and that corner stays."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from recordings import Geometry, RecordingError
from recordings.geometry import block_poses

WIDTH, HEIGHT = 0.06, 0.27


def _placed(rotation: float, point: tuple[float, float, float]) -> np.ndarray:
    """Apply a pose to a point of the block by the quaternion's own matrix."""
    poses = block_poses(rotation, WIDTH)
    x, y, z, w = poses.quaternion[0]
    matrix = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
        ]
    )
    return matrix @ np.array(point) + poses.translation[0]


@given(st.floats(-math.pi / 2, math.pi / 2))
def test_the_corner_stays_and_nothing_sinks(rotation: float) -> None:
    corner = math.copysign(0.5 * WIDTH, rotation)
    np.testing.assert_allclose(_placed(rotation, (corner, 0.0, 0.0)), (corner, 0.0, 0.0), atol=1e-16)
    for x in (-0.5 * WIDTH, 0.5 * WIDTH):
        for z in (0.0, HEIGHT):
            assert _placed(rotation, (x, 0.0, z))[2] >= -1e-15


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_positive_rotation_leans_the_top_toward_positive_x(sign: float) -> None:
    top = _placed(sign * 0.1, (0.0, 0.0, HEIGHT))
    assert sign * top[0] > 0.02
    lifted = _placed(sign * 0.1, (-sign * 0.5 * WIDTH, 0.0, 0.0))
    assert lifted[2] == pytest.approx(WIDTH * math.sin(0.1), rel=1e-12)


def test_on_its_side_the_block_lies_on_the_table() -> None:
    # Its right face, x = +b/2, is now on the table.
    for z in (0.0, HEIGHT):
        assert _placed(math.pi / 2, (0.5 * WIDTH, 0.0, z))[2] == pytest.approx(0.0, abs=1e-15)


def test_mirror_symmetry() -> None:
    right, left = block_poses(0.2, WIDTH), block_poses(-0.2, WIDTH)
    np.testing.assert_array_equal(right.translation * (-1, 1, 1), left.translation)
    np.testing.assert_array_equal(right.quaternion * (1, -1, 1, 1), left.quaternion)


@given(st.floats(1e-6, 1e3), st.floats(1e-6, 1e3))
def test_metadata_keeps_every_bit(width: float, height: float) -> None:
    assert Geometry.from_metadata(Geometry(width, height).to_metadata()) == Geometry(width, height)


@pytest.mark.parametrize("width", [0.0, -1.0, math.nan, math.inf])
def test_a_size_that_is_none_is_refused(width: float) -> None:
    with pytest.raises(RecordingError, match=r"block width of .* m; it must be finite and above 0 m"):
        Geometry(width, HEIGHT)


@pytest.mark.parametrize("values", [{}, {"width_m": "0.06"}, {"width_m": "wide", "height_m": "1"}])
def test_metadata_that_is_no_geometry_is_one_sentence(values: dict[str, str]) -> None:
    with pytest.raises(RecordingError, match="metadata 'geometry'"):
        Geometry.from_metadata(values)
