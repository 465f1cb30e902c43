"""The limits every table shares, at, just below and just above each."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.setpoints import SetpointLimits
from excitation import Capacity

H, NM = 1e-3, 1e-9
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})


def limits() -> SetpointLimits:
    return SetpointLimits(CAPACITY, H, NM)


def nm(position: float) -> float:
    return round(position / NM) * NM


def play(judge: SetpointLimits, positions: list[float], first: int = 0) -> str | None:
    for cycle, position in enumerate(positions, first):
        if (refusal := judge.refusal(cycle, nm(position))) is not None:
            return refusal.limit
        judge.accept(cycle, nm(position))
    return None


def speeding_up(acceleration: float, cycles: int) -> list[float]:
    return [0.5 * acceleration * ((k + 1) * H) ** 2 for k in range(cycles)]


def test_acceleration() -> None:
    for sign in (1, -1):
        assert play(limits(), speeding_up(sign * 9.999, 40)) is None
        assert play(limits(), speeding_up(sign * 10.0, 40)) is None
        assert play(limits(), speeding_up(sign * 10.005, 40)) == "acceleration"


def test_velocity() -> None:
    approach = speeding_up(9.0, 55)  # 0.495 m/s
    for top, expected in ((0.4999, None), (0.5, None), (0.500003, "velocity")):
        steps = [approach[-1] + top * H * k for k in range(1, 5)]
        assert play(limits(), approach + steps) == expected


@pytest.mark.parametrize("sign", [1, -1])
def test_stroke(sign: int) -> None:
    for end, expected in ((0.1 - 1e-6, None), (0.1, None), (0.1 + 2e-9, "stroke")):
        judge = limits()
        judge.start(0, sign * 0.0999999)
        assert play(judge, [sign * end], first=1) == expected


def test_a_set_point_that_leaves_no_room_to_stop() -> None:
    judge = limits()
    judge.start(-1, 0.08)
    refused = play(judge, [0.08 + x for x in speeding_up(10.0, 100)])
    assert refused == "braking"
    # v^2 / (2 A) of what was accepted still fits
    assert (judge.velocity - 0.5 * 10.0 * H) ** 2 / 20.0 <= 0.1 - judge.position


def test_sentence() -> None:
    refusal = limits().refusal(0, 0.101)
    assert refusal is not None
    assert refusal.sentence == "set-point asks 0.101000000 m from the centre; bench has 0.1 m"


@given(
    frequency=st.floats(0.2, 8.0),
    share=st.floats(0.1, 1.0),
    gaps=st.lists(st.sampled_from([1, 1, 1, 2, 3, 7, 19]), min_size=20, max_size=60),
)
def test_a_motion_inside_the_capacity_passes_whatever_cycles_are_missed(
    frequency: float, share: float, gaps: list[int]
) -> None:
    # x = X (1 - cos w t) / 2 from one end: at the limit in stroke, velocity or acceleration, whichever binds
    w = math.tau * frequency
    span = share * min(0.2, 2.0 * 0.5 / w, 2.0 * 10.0 / w**2)
    judge = limits()
    start = -0.5 * span
    judge.start(-1, nm(start))
    cycle = 0
    for gap in gaps:
        position = nm(start + 0.5 * span * (1.0 - math.cos(w * (cycle + 1) * H)))
        assert judge.refusal(cycle, position) is None
        judge.accept(cycle, position)
        cycle += gap
