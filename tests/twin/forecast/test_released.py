"""Forecasts on a machine that is released: blows of milliseconds, and a base that nothing stops."""

from __future__ import annotations

import dataclasses

import pytest

from devices.quanser_st3.capacity import CAPACITY as ST3
from devices.roori1.capacity import CAPACITY
from tests.facts import B6L
from tests.twin.conftest import perform_on, short_scene
from tests.twin.test_released_runs import oxford
from twin.commands.outlook import stoppable_until, twin_of_run
from twin.forecast.forecast import Forecast, Forecaster
from twin.forecast.observer import Observer
from twin.forecast.ramp import RampDown
from twin.rehearsal import Rehearsal, rehearse
from twin.rocking.response import Outcome
from twin.simulation import simulate


@pytest.fixture(scope="module")
def rehearsal() -> Rehearsal:
    """A run that overturns, above the amplitude from which one does."""
    return rehearse(oxford(0.22, 31.0), CAPACITY)


def forecast(rehearsal: Rehearsal, time: float) -> Forecast:
    """Return what is foreseen, from rest, at `time`."""
    twin = twin_of_run(rehearsal)
    twin.measure(time, 0.0, 0.0)
    assert twin.foresight is not None
    assert twin.foresight.latest is not None
    return twin.foresight.latest


@pytest.mark.parametrize("share", [0.5, 0.7, 0.9, 0.95, 1.0, 1.05, 1.1])
def test_a_blow_acts_when_it_acts(rehearsal: Rehearsal, share: float) -> None:
    """Joined to the pause before it, it was foreseen 20 ms too early: the block then stood in the forecast."""
    motion = rehearsal.motion.scaled(share)
    scaled = dataclasses.replace(rehearsal, motion=motion)
    exact = simulate(rehearsal.block, motion, restitution=rehearsal.restitution)
    assert forecast(scaled, 0.0).going_on.outcome is exact.outcome
    if exact.overturning_time is not None:
        assert forecast(scaled, 0.0).going_on.overturning == pytest.approx(exact.overturning_time, abs=1e-3)


def test_a_stop_before_the_release_keeps_the_base_where_it_is(rehearsal: Rehearsal) -> None:
    start = rehearsal.motion.pulse_start
    assert stoppable_until(rehearsal) == start
    before = forecast(rehearsal, start - 0.001)
    assert before.going_on.outcome is Outcome.OVERTURNED
    assert before.stopping.outcome is Outcome.STAYED
    assert before.advice == "stopping helps"


def test_nothing_stops_it_after_the_release(rehearsal: Rehearsal) -> None:
    twin = twin_of_run(rehearsal)
    assert twin.foresight is not None
    start = rehearsal.motion.pulse_start
    for k in range(100):
        t = start + 1e-3 * k
        twin.measure(t, rehearsal.motion.acceleration(t), 0.0 if k == 0 else float("nan"))
        latest = twin.foresight.latest
        assert latest is not None
        assert latest.stopping.probability == latest.going_on.probability
        assert latest.stopping.margin == pytest.approx(latest.going_on.margin, abs=1e-12)
        assert latest.advice in ("continue", "too late", "undecided")


def test_a_stop_that_is_decided_too_late_is_not_the_plan(rehearsal: Rehearsal) -> None:
    start = rehearsal.motion.pulse_start
    stop = RampDown(1.0, 0.02, until=start)

    def margin(ramped_at: float | None) -> float:
        observer, forecaster = Observer(B6L), Forecaster(B6L, rehearsal.motion.pieces, stop)
        observer.update(start - 0.01, 0.0, 0.0)
        if ramped_at is not None:
            forecaster.ramp_down(ramped_at)
        found = forecaster.update(observer)
        assert found is not None
        return found.going_on.margin

    assert margin(start) == margin(None) < 0.0
    assert margin(start - 0.01) == 1.0


def test_a_servo_table_can_always_be_stopped() -> None:
    assert stoppable_until(rehearse(short_scene(), ST3)) is None


def test_a_run_is_foreseen_before_it_is_released() -> None:
    _, kept = perform_on(oxford(0.22, 31.0))
    waiting = kept.cycles[50].forecast
    assert waiting is not None
    assert waiting.continue_outcome == "overturned"
    assert waiting.stop_outcome == "stayed"
    sliding = kept.cycles[180].forecast
    assert sliding is not None
    assert sliding.stop_probability == sliding.continue_probability
