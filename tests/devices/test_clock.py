"""Clocks."""

from __future__ import annotations

import pytest

from devices.clock import ManualClock, WallClock


def test_manual_clock_never_waits() -> None:
    clock = ManualClock(10.0)
    assert clock.wait_until(1e9) == 0.0
    assert clock.now() == 1e9
    assert clock.wait_until(1.0) == 1e9 - 1.0
    assert clock.now() == 1e9


@pytest.mark.parametrize("duration", [-1.0, float("nan")])
def test_time_does_not_run_backwards(duration: float) -> None:
    with pytest.raises(ValueError, match="cannot be advanced"):
        ManualClock().advance(duration)


def test_wall_clock_is_never_early() -> None:
    clock = WallClock()
    for ahead in (0.0, 100e-6, 2e-3):
        moment = clock.now() + ahead
        lateness = clock.wait_until(moment)
        assert lateness >= 0.0
        assert clock.now() >= moment + lateness


def test_wall_clock_returns_at_once_when_late() -> None:
    clock = WallClock()
    assert clock.wait_until(clock.now() - 5.0) >= 5.0
