"""Rotation from two beams, against the block's corners turned by hand."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from devices.cia301 import frames
from devices.cia301.frames import NmtCommand
from devices.sensors.displacements import DisplacementPair, displacement_inputs, rotation_from
from devices.sensors.encoder import Encoder
from devices.sensors.reading import rotation_by_displacements

B, H = 0.06, 0.27
LOW, HIGH = 0.05, 0.2


def face(theta: float) -> tuple[tuple[float, float], tuple[float, float]]:
    """Lower and upper end of the -x face, turned about the corner the block pivots on; +x corner at (b, 0)."""
    pivot = B if theta > 0.0 else 0.0

    def turned(x: float, z: float) -> tuple[float, float]:
        # Leaning to +x is clockwise.
        return (
            pivot + (x - pivot) * math.cos(theta) + z * math.sin(theta),
            -(x - pivot) * math.sin(theta) + z * math.cos(theta),
        )

    return turned(0.0, 0.0), turned(0.0, H)


def seen(theta: float, z: float) -> float:
    """Where a beam at height z meets the face, as displacement from upright; NaN where it misses."""
    (x0, z0), (x1, z1) = face(theta)
    if not z0 <= z <= z1:
        return math.nan
    return x0 + (x1 - x0) * (z - z0) / (z1 - z0)


def pair(theta: float, encoder: Encoder | None = None) -> DisplacementPair:
    return DisplacementPair(lambda: theta, B, H, (LOW, HIGH), encoder)


@given(st.floats(-1.4, 1.4))
def test_the_beams_see_the_turned_face(theta: float) -> None:
    expected = [seen(theta, z) for z in (LOW, HIGH)]
    for k, reading in enumerate(pair(theta).read()):
        # At the very edge rounding decides.
        z = (LOW, HIGH)[k]
        (_, z0), (_, z1) = face(theta)
        assume(min(abs(z - z0), abs(z - z1)) > 1e-12)
        assert reading == pytest.approx(expected[k], abs=1e-12, nan_ok=True)


@given(st.floats(-0.7, 0.7))
def test_the_formula_is_exact_at_every_angle(theta: float) -> None:
    lower, upper = pair(theta).read()
    assume(not math.isnan(lower + upper))
    assert rotation_from(lower, upper, HIGH - LOW) == pytest.approx(theta, abs=1e-13)


@pytest.mark.parametrize("theta", [0.01, 0.05, 0.1, 0.2])
def test_the_small_angle_formula_is_too_large_by_a_third_of_the_cube(theta: float) -> None:
    lower, upper = pair(theta).read()
    small = (upper - lower) / (HIGH - LOW)
    assert small - theta == pytest.approx(theta**3 / 3.0, rel=0.5 * theta**2)


def test_a_fallen_block_is_not_seen() -> None:
    assert all(math.isnan(x) for x in pair(0.5 * math.pi).read())
    # The upper beam first: h cos(theta) < z2.
    angle = math.acos(HIGH / H)
    lower, upper = pair(-angle - 1e-6).read()
    assert math.isfinite(lower)
    assert math.isnan(upper)
    assert math.isfinite(pair(-angle + 1e-6).read()[1])
    assert math.isnan(rotation_from(lower, upper, HIGH - LOW))


@pytest.mark.parametrize("theta", [-0.15, 0.0, 0.123456, math.pi / 2])
def test_through_the_bus(theta: float) -> None:
    sent: list[tuple[int, bytes]] = []
    node = displacement_inputs(4, lambda identifier, data: sent.append((identifier, data)), pair(theta))
    node.receive(frames.NMT, frames.pack_nmt(NmtCommand.START, 4))
    node.receive(frames.SYNC, frames.pack_sync(1))
    ((identifier, data),) = sent
    assert (identifier, len(data)) == (0x184, 8)
    reading = rotation_by_displacements(4, HIGH - LOW).value(data)
    if theta == math.pi / 2:
        assert math.isnan(reading)
    else:
        # Two displacements to 1 nm over 0.15 m.
        assert reading == pytest.approx(theta, abs=1e-8)


def test_a_coarse_pair_reads_in_steps() -> None:
    assert [x / 1e-3 for x in pair(0.1, Encoder(1e-3)).read()] == pytest.approx([5.0, 20.0])


@pytest.mark.parametrize("heights", [(0.0, 0.2), (0.2, 0.1), (0.1, 0.1), (0.1, 0.27)])
def test_heights_must_rise_within_the_block(heights: tuple[float, float]) -> None:
    with pytest.raises(ValueError, match="displacement sensors stand at"):
        DisplacementPair(lambda: 0.0, B, H, heights)
