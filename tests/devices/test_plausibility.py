"""What is called impossible is impossible, and what a healthy table measures is not."""

from __future__ import annotations

import math
import re
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.plausibility import DISAGREEMENT, SHARE, SPAN, Plausibility
from excitation import Capacity

TABLE = Capacity(name="table", stroke=0.2, velocity=0.6, acceleration=10.0)
H = 1e-3
WINDOW = round(2 * SPAN / H)
Signal = Callable[[float], float]


def sine(amplitude: float, frequency: float) -> tuple[Signal, Signal]:
    """Position, m, and acceleration, m/s2, of a harmonic motion whose acceleration has this amplitude."""
    w = math.tau * frequency
    return (lambda t: -amplitude / w**2 * math.sin(w * t)), (lambda t: amplitude * math.sin(w * t))


def verdicts(
    position: Signal, acceleration: Signal, cycles: int = 500, h: float = H, command: Signal | None = None
) -> list[tuple[int, str]]:
    sensors = Plausibility(TABLE, h)
    found = []
    for k in range(cycles):
        words = sensors.judge(k, (command or position)(k * h), position(k * h), acceleration(k * h))
        if words is not None:
            found.append((k, words))
    return found


@pytest.mark.parametrize("h", [0.5e-3, 1e-3, 4e-3])
@pytest.mark.parametrize(("amplitude", "frequency"), [(0.5, 0.5), (3.0, 4.0), (9.8, 10.0), (9.8, 25.0)])
def test_a_healthy_table_is_believed(amplitude: float, frequency: float, h: float) -> None:
    """With the encoder, noise and bias of the placeholders."""
    rng = np.random.default_rng(1)
    x, a = sine(amplitude, frequency)
    step = 12.7e-3 / 8192

    def measured(t: float) -> float:
        return a(t) + 0.02 + 0.05 * rng.standard_normal()

    assert verdicts(lambda t: round(x(t) / step) * step, measured, 2000, h) == []


def test_sensors_that_are_some_milliseconds_apart_are_believed() -> None:
    x, a = sine(9.8, 10.0)
    assert verdicts(x, lambda t: a(t - 1.5e-3)) == []


@given(st.floats(-30.0, 30.0), st.integers(0, 400))
def test_a_constant_error_is_found_at_its_size_and_not_below(error: float, begin: int) -> None:
    """Whatever moves the table, a constant error e of the acceleration is a difference of e after one window."""
    x, a = sine(2.0, 4.0)
    found = verdicts(x, lambda t: a(t) + (error if t >= begin * H else 0.0), begin + 300)
    largest = 2.0 + abs(error)
    if abs(error) > DISAGREEMENT + SHARE * largest + 0.01:
        first, words = found[0]
        assert begin <= first <= begin + 2 * WINDOW + 1
        assert words.startswith("sensors: encoder and accelerometer differ by")
    # Late in the window the largest acceleration of late has been partly forgotten.
    elif abs(error) < DISAGREEMENT - 0.01:
        assert found == []


def test_stuck_while_the_table_accelerates() -> None:
    x, a = sine(3.0, 4.0)
    found = verdicts(x, lambda t: a(min(t, 0.1)))
    first, words = found[0]
    assert 100 < first < 200
    assert re.search(r"the accelerometer reads \S+ m/s2, the same for \d+ cycles$", words)


def test_stuck_at_rest_harms_nobody_yet() -> None:
    assert verdicts(lambda _: 0.0, lambda _: 0.01) == []


def test_frozen_while_the_command_goes_on() -> None:
    x, a = sine(3.0, 4.0)
    found = verdicts(lambda t: x(min(t, 0.1)), a, command=x)
    first, words = found[0]
    assert 102 <= first <= 110
    assert re.search(r"the encoder has been the same for \d readings$", words)


def test_frozen_is_told_by_the_command_alone() -> None:
    """A table that never moved: no acceleration tells of it."""
    found = verdicts(lambda _: 0.0, lambda _: 0.0, command=lambda t: 0.05 * t)
    # 20 cycles at 0.05 m/s are 1 mm
    assert found[0] == (20, "encoder: the same for 20 cycles, in which the command moved 1.00 mm")


def test_a_table_that_waits_for_its_command_is_not_frozen() -> None:
    assert verdicts(lambda _: 0.01, lambda _: 0.0, command=lambda t: 0.01 + 4e-4 * math.sin(5.0 * t)) == []


def test_jump() -> None:
    found = verdicts(lambda t: 0.002 if t > 0.0995 else 0.0, lambda _: 0.0)
    assert found[0] == (
        100,
        "encoder: the position jumps by 2.000 mm in one cycle; table moves 0.600 mm at most",
    )
    # over a gap the table may have gone further
    sensors = Plausibility(TABLE, H)
    assert sensors.judge(0, 0.0, 0.0, 0.0) is None
    assert sensors.judge(4, 0.0, 0.002, 0.0) is None
    words = sensors.judge(6, 0.0, 0.005, 0.0)
    assert words == "encoder: the position jumps by 3.000 mm in 2 cycles; table moves 1.200 mm at most"


@pytest.mark.parametrize("reading", [(math.nan, 0.0), (0.0, math.nan), (math.inf, 0.0)])
def test_no_number(reading: tuple[float, float]) -> None:
    words = Plausibility(TABLE, H).judge(0, 0.0, *reading)
    assert words is not None
    assert words.startswith("sensors: position")


def test_out_of_reach() -> None:
    assert Plausibility(TABLE, H).judge(0, 0.0, 0.119, 0.0) is None
    words = Plausibility(TABLE, H).judge(0, 0.0, -0.121, 0.0)
    assert words == "encoder: -121.0 mm from the centre are measured; table cannot get beyond 120.0 mm"


def test_a_blow_between_two_samples_is_no_disagreement() -> None:
    """A stopper takes 0.3 m/s in 1.3 ms: samples do not follow that. Afterwards they are judged again."""
    v, hit, blow = 0.3, 0.2003, 1.3e-3

    def a(t: float) -> float:
        return -v / blow if hit <= t < hit + blow else 0.0

    def x(t: float) -> float:
        during = min(max(t - hit, 0.0), blow)
        return v * min(t, hit) + v * during - 0.5 * v / blow * during**2

    assert verdicts(lambda t: x(t) - 0.05, a) == []
    found = verdicts(lambda t: x(t) - 0.05, lambda t: a(t) + (2.0 if t > 0.3 else 0.0))
    assert found
    assert found[0][0] > 300


def test_a_gap_begins_anew() -> None:
    x, a = sine(3.0, 4.0)
    sensors = Plausibility(TABLE, H)
    for k in [*range(200), *range(230, 500)]:
        assert sensors.judge(k, x(k * H), x(k * H), a(k * H)) is None
