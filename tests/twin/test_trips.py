"""Every trip: not at its limit, latched just beyond it, once, with its scene's action."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from pydantic import ValidationError

from excitation import Capacity
from twin.scene_trips import TripsPart
from twin.trips import Seen, Trip, Trips

CAPACITY = Capacity(name="table", stroke=0.2, velocity=0.5, acceleration=5.0)
ALPHA, H = 0.2, 1e-3
QUIET = Seen(rotation=0.0, estimate=0.0, probability=0.0, probability_if_stopped=0.0)


def trips(**levels: object) -> Trips:
    return Trips(TripsPart.model_validate(levels), ALPHA, CAPACITY, H)


def show(watch: Trips, seen: Seen, cycles: int = 1, first: int = 0) -> list[Trip]:
    found: list[Trip] = []
    for k in range(first, first + cycles):
        found += watch.judge(replace(seen, cycle=k, time=k * H))
    return found


@pytest.mark.parametrize(
    ("name", "inside", "beyond"),
    [
        ("following_error", {"command": 0.02, "position": 0.0}, {"command": 0.02 + 1e-9, "position": 0.0}),
        ("following_error", {"command": -0.02, "position": 0.0}, {"command": -0.02 - 1e-9, "position": 0.0}),
        ("rotation", {"rotation": 0.24}, {"rotation": 0.24 + 1e-9, "estimate": 0.24}),
        ("rotation", {"rotation": -0.24}, {"rotation": -0.24 - 1e-9, "estimate": -0.24}),
        ("capacity", {"position": 0.101, "command": 0.101}, {"position": -0.1010001, "command": -0.1010001}),
    ],
)
def test_a_level(name: str, inside: dict[str, float], beyond: dict[str, float]) -> None:
    settled = {"estimate": inside.get("rotation", 0.0)}
    watch = trips()
    assert show(watch, replace(QUIET, **(settled | inside)), 300) == []
    (trip,) = show(watch, replace(QUIET, **beyond), 1, first=300)
    assert trip.name == name
    assert trip.time == pytest.approx(0.3)
    assert show(watch, replace(QUIET, **beyond), 100, first=301) == [], "a latched trip is said once"
    assert [kept.name for kept in watch.latched] == [name]


def test_a_condition_that_must_last_does() -> None:
    watch = trips(prediction_error={"limit_rad": 0.05, "lasting_s": 0.02})
    apart = replace(QUIET, rotation=0.1, estimate=0.0)
    assert show(watch, apart, 20) == []
    assert show(watch, QUIET, 1, first=20) == [], "a break begins the count anew"
    assert show(watch, apart, 20, first=21) == []
    (trip,) = show(watch, apart, 1, first=41)
    assert trip.name == "prediction_error"


def test_forecast_waits_and_is_silent_once_the_block_lies() -> None:
    falls = replace(QUIET, probability=1.0, probability_if_stopped=0.0)
    (trip,) = show(trips(), falls, 100)
    assert trip.name == "forecast"
    assert trip.time == pytest.approx(0.02)
    assert not trip.stops, "indicated unless the scene asks for more"
    assert show(trips(), replace(falls, lying=True), 100) == []


def test_forecast_stops_only_where_stopping_is_the_better_half() -> None:
    levels = {"action": "ramp_down"}
    worse = replace(QUIET, probability=0.95, probability_if_stopped=1.0)
    assert show(trips(forecast=levels), worse, 100) == []
    (trip,) = show(trips(forecast=levels), replace(worse, probability_if_stopped=0.1), 100)
    assert trip.stops


def test_velocity_is_a_mean_over_several_steps_of_the_encoder() -> None:
    watch = trips()
    for k in range(100):  # steps of one count every other cycle are no speed
        assert watch.judge(replace(QUIET, time=k * H, position=1.55e-6 * (k % 2), command=0.0)) == []
    found: list[Trip] = []
    for k in range(100, 120):
        x = 0.56 * (k - 100) * H
        found += watch.judge(replace(QUIET, time=k * H, position=x, command=x))
    assert [trip.name for trip in found] == ["capacity"]
    assert "0.560 m/s" in found[0].reason or "m/s; table has 0.5 m/s" in found[0].reason


def test_overruns_in_a_row_and_as_a_share() -> None:
    watch = trips(overrun={"in_a_row": 10, "share_percent": 5.0})
    assert watch.missed(0, 9, 0.01) is None
    trip = watch.missed(100, 110, 0.11)
    assert trip is not None
    assert "11 cycles in a row" in trip.reason
    watch = trips(overrun={"in_a_row": 10, "share_percent": 5.0})
    shares = [watch.missed(k, k + 1, k * H) for k in range(0, 1000, 39)]
    assert [trip is not None for trip in shares].index(True) == 25, "51 or more of a second's 1000"


def test_gaps_are_forgotten_after_a_second() -> None:
    watch = trips(overrun={"in_a_row": 10, "share_percent": 5.0})
    assert all(watch.missed(k, k + 4, k * H) is None for k in range(0, 20_000, 200))


def test_off_never_latches_and_what_cannot_be_off_says_so() -> None:
    watch = trips(following_error={"action": "off"})
    assert show(watch, replace(QUIET, command=0.05), 5) == []
    for name in ("capacity", "connection", "operator"):
        with pytest.raises(ValidationError):
            TripsPart.model_validate({name: {"action": "off"}})


def test_the_hardest_action_wins() -> None:
    watch = trips(sensor={"action": "cut_power"})
    watch.report("operator", 0.1, "Ctrl-C")
    assert watch.stopping is not None
    assert not watch.stopping.cuts_power
    watch.report("sensor", 0.2, "stuck")
    assert watch.stopping.name == "sensor"
    assert watch.stopping.cuts_power
    assert watch.report("drive", 0.3, "fault 8611") is not None


def test_nothing_measured_trips_nothing() -> None:
    assert show(trips(), Seen(rotation=math.nan), 50) == []
