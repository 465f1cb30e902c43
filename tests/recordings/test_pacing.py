"""The pace of a replay on a clock that never waits, steered by keys that somebody presses at given times."""

from __future__ import annotations

import pytest

from devices.clock import ManualClock
from recordings.pacing import FASTER, FASTEST, PAUSE, QUIT, SLOWER, SLOWEST, STEP, SteadyPace, SteeredPace, Unpaced


class Keys:
    """Presses keys at moments of a manual clock, s; waiting for a key lets the clock go on."""

    def __init__(self, clock: ManualClock, presses: dict[float, str]) -> None:
        self.clock = clock
        self.presses = sorted(presses.items())

    def __call__(self, limit: float) -> str | None:
        if self.presses and self.presses[0][0] <= self.clock.now() + limit:
            moment, meaning = self.presses.pop(0)
            self.clock.wait_until(moment)
            return meaning
        self.clock.advance(limit)
        return None


def played(presses: dict[float, str], speed: float = 1.0, count: int = 1000) -> tuple[list[float], SteeredPace]:
    """When each sample of a 1 kHz recording was played, s, from its beginning at 5 s."""
    clock = ManualClock()
    pace = SteeredPace(clock, speed, Keys(clock, presses))
    moments: list[float] = []
    for k in range(count):
        if not pace.wait(5.0 + k * 1e-3):
            break
        moments.append(clock.now())
    return moments, pace


@pytest.mark.parametrize("speed", [0.1, 1.0, 4.0])
def test_steady(speed: float) -> None:
    clock = ManualClock(100.0)
    pace = SteadyPace(clock, speed)
    for k in range(50):
        assert pace.wait(5.0 + k * 1e-3)
        assert clock.now() == pytest.approx(100.0 + k * 1e-3 / speed)


def test_a_late_sample_is_not_made_up_for_by_waiting_less() -> None:
    clock = ManualClock()
    pace = SteadyPace(clock, 1.0)
    pace.wait(0.0)
    clock.advance(0.5)
    pace.wait(0.1)
    assert clock.now() == 0.5
    pace.wait(0.7)
    assert clock.now() == pytest.approx(0.7)


def test_steered_is_steady_without_keys() -> None:
    moments, _ = played({}, speed=2.0)
    assert moments == pytest.approx([k * 0.5e-3 for k in range(1000)], abs=1e-9)


def test_pause_and_go_on() -> None:
    moments, pace = played({0.2: PAUSE, 3.2: PAUSE})
    assert not pace.paused
    # What was due before the pause came before it; the rest three seconds later.
    assert moments[150] == pytest.approx(0.150, abs=1e-6)
    assert moments[250] == pytest.approx(3.250, abs=0.021)
    assert moments[999] - moments[250] == pytest.approx(0.749, abs=1e-6)


def test_one_sample_at_a_time() -> None:
    moments, pace = played({0.2: STEP, 1.0: STEP, 2.0: STEP, 3.0: QUIT})
    assert pace.paused
    late = [moment for moment in moments if moment > 0.25]
    assert late == pytest.approx([1.0, 2.0], abs=1e-6)


def test_faster_and_slower() -> None:
    moments, pace = played({0.2: FASTER})
    assert pace.speed == 2.0
    assert moments[999] == pytest.approx(0.2 + 0.8 / 2.0, abs=0.02)
    moments, pace = played({0.2: SLOWER})
    assert pace.speed == 0.5
    assert moments[999] == pytest.approx(0.2 + 0.8 * 2.0, abs=0.02)


def test_the_speed_stays_inside_its_bounds() -> None:
    assert played({0.01 * k: FASTER for k in range(1, 20)}, count=2000)[1].speed == FASTEST
    assert played({0.01 * k: SLOWER for k in range(1, 20)}, count=100)[1].speed == SLOWEST


def test_quit() -> None:
    moments, _ = played({0.3: QUIT})
    assert 280 <= len(moments) <= 301


def test_unpaced() -> None:
    assert all(Unpaced().wait(time) for time in (0.0, 1e9))
