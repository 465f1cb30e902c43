"""What the drive follows when set-points stop coming."""

from __future__ import annotations

import itertools
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.cia402.interpolation import Interpolator
from excitation import Capacity

H, NM = 1e-3, 1e-9
CAPACITY = Capacity(name="bench", stroke=0.2, velocity=0.5, acceleration=10.0, provenance={})


def at(position: float, patience: int = 20, deceleration: float = 1.0) -> Interpolator:
    drive = Interpolator(CAPACITY, H, NM, deceleration, patience)
    drive.hold(position)
    drive.begin(-1, position)
    drive.step()
    return drive


def run_out(drive: Interpolator, cycles: int = 5000) -> list[float]:
    positions = [drive.position]
    while not drive.at_rest:
        positions.append(drive.step())
        assert len(positions) < cycles
    return positions


def test_follows_every_set_point() -> None:
    drive = at(0.0)
    for cycle in range(50):
        x = 2.0 * ((cycle + 1) * H) ** 2
        assert drive.offer(cycle, x) is None
        assert drive.step() == x


def test_bridges_missing_ones_with_velocity_and_acceleration() -> None:
    drive = at(0.0)
    for cycle in range(100):
        drive.offer(cycle, 2.0 * ((cycle + 1) * H) ** 2)
        drive.step()
    bridged = [drive.step() for _ in range(20)]
    truth = [2.0 * ((cycle + 1) * H) ** 2 for cycle in range(100, 120)]
    assert bridged == pytest.approx(truth, abs=2e-7)
    assert drive.missing == 20
    assert drive.following
    drive.step()
    assert not drive.following


def test_patience_of_none() -> None:
    drive = at(0.0, patience=0)
    drive.step()
    assert not drive.following


@given(
    start=st.floats(-0.1, 0.1),
    frequency=st.floats(0.3, 6.0),
    phase=st.floats(0.0, 1.0),
    stop_after=st.integers(1, 400),
    deceleration=st.floats(0.1, 50.0),
    by_silence=st.booleans(),
)
def test_any_stop_ends_inside_the_stroke_within_the_capacity(
    start: float, frequency: float, phase: float, stop_after: int, deceleration: float, by_silence: bool
) -> None:
    """Drive as hard as the limits let us, from anywhere, then stop anywhere."""
    start = round(start / NM) * NM
    drive = at(start, deceleration=deceleration)
    x = start
    velocity = 0.0
    for cycle in range(stop_after):
        push = math.copysign(9.99, math.sin(math.tau * (frequency * cycle * H + phase)))
        for a in (push, -push, -math.copysign(9.99, velocity)):
            v = max(-0.4999, min(0.4999, velocity + a * H))
            target = round((x + v * H) / NM) * NM
            if drive.offer(cycle, target) is None:
                velocity = (target - x) / H
                x = target
                break
        drive.step()
    previous = drive.velocity
    if not by_silence:
        drive.stop()
    positions = run_out(drive)
    assert max(abs(p) for p in positions) <= 0.1 + 2 * NM
    velocities = [previous] + [(b - a) / H for a, b in itertools.pairwise(positions)]
    steepest = max((abs(b - a) / H for a, b in itertools.pairwise(velocities)), default=0.0)
    assert steepest <= 10.0 + 0.01
    assert drive.velocity == 0.0


def test_ramp_takes_the_asked_deceleration_where_there_is_room() -> None:
    drive = at(-0.1, deceleration=2.0)
    for cycle in range(60):
        drive.offer(cycle, -0.1 + 2.5 * ((cycle + 1) * H) ** 2)
        drive.step()
    drive.stop()
    positions = run_out(drive)
    velocities = [(b - a) / H for a, b in itertools.pairwise(positions)]
    lost = [a - b for a, b in itertools.pairwise(velocities)][:-1]  # the last step loses what is left
    assert lost == pytest.approx([2.0 * H] * len(lost), rel=1e-6)


@pytest.mark.parametrize(("gap", "error"), [(5, 1e-7), (20, 2e-6), (50, 7e-5)])
def test_a_gap_is_bridged_between_what_is_known_on_both_sides(gap: int, error: float) -> None:
    def truth(cycle: int) -> float:
        return 0.01 * (1.0 - math.cos(math.tau * 2.0 * (cycle + 1) * H))

    drive = at(0.0)
    for cycle in range(100):
        assert drive.offer(cycle, truth(cycle)) is None
        if cycle < 99:
            drive.step()
    positions = drive.bridge(gap, truth(100 + gap))
    assert positions == pytest.approx([truth(100 + k) for k in range(gap)], abs=error)
    # and they are gone through one by one, after the last target
    assert drive.step() == truth(99)
    for x in positions:
        drive.go(x)
        assert drive.step() == x
    assert drive.missing == 0
    assert drive.offer(100 + gap, truth(100 + gap)) is None


def test_no_bridge_out_of_the_stroke_and_none_at_rest() -> None:
    drive = at(0.099)
    drive.offer(0, 0.099)
    assert drive.bridge(3, 0.2) == []
    drive.stop()
    assert drive.bridge(3, 0.099) == []
    drive.go(0.05)
    assert drive.step() == 0.099


@given(
    gaps=st.lists(st.integers(0, 20), min_size=1, max_size=30),
    frequency=st.floats(0.5, 8.0),
    amplitude=st.floats(0.5, 9.9),
    phase=st.floats(0.0, 1.0),
)
def test_after_a_gap_it_catches_up_and_never_jumps(
    gaps: list[int], frequency: float, amplitude: float, phase: float
) -> None:
    """Set-points of a hard sine, some of them lost: what is followed is within the capacity in every cycle."""
    drive = at(0.0)
    omega = math.tau * frequency
    peak = min(amplitude, 0.45 * omega, 0.09 * omega**2 / 2.0)

    def asked(t: float) -> float:
        """A sine that grows from rest."""
        return min(1.0, t / 0.2) ** 3 * peak / omega**2 * math.sin(omega * t + math.tau * phase)

    positions, cycle = [drive.position], 0
    for gap in gaps:
        for _ in range(gap):
            positions.append(drive.step())
        cycle += gap
        x = round(asked((cycle + 1) * H) / NM) * NM
        if drive.following and drive.limits.refusal(cycle, x) is None:
            assert drive.offer(cycle, x) is None
        positions.append(drive.step())
        cycle += 1
    velocities = [(b - a) / H for a, b in itertools.pairwise(positions)]
    assert max(map(abs, velocities)) <= CAPACITY.velocity + 2e-6
    accelerations = [(b - a) / H for a, b in itertools.pairwise(velocities)]
    assert max(map(abs, accelerations), default=0.0) <= CAPACITY.acceleration + 0.01


def test_it_is_back_on_the_hosts_line_soon() -> None:
    """Ten set-points lost as the pulse begins: 3 m/s2 unheard of, and then they come again."""
    drive = at(0.0)
    x = 0.0
    behind = []
    for cycle in range(100):
        x = round(1.5 * ((cycle + 1) * H) ** 2 / NM) * NM
        if cycle >= 10:
            assert drive.offer(cycle, x) is None
        behind.append(x - drive.step())
    assert behind[9] == pytest.approx(150e-6, rel=0.01)
    assert max(behind[10:]) < 250e-6
    assert behind[40:] == [0.0] * 60
