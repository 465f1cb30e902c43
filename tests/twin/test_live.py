"""The live cycle on a manual clock, through real frames on a virtual bus."""

from __future__ import annotations

import math

import numpy as np
import pytest

from devices.clock import ManualClock
from tests.twin.conftest import FREE, Kept, chain, perform_on, short_scene
from twin.commands.replay import live_twin
from twin.live import perform
from twin.live_loop import Ends, Status, Watch
from twin.rocking.response import Outcome
from twin.run_report import RunReport
from twin.scene import Scene
from twin.simulation import simulate

Performed = tuple[Scene, RunReport, Kept]


def test_every_cycle_is_executed_once(performed: Performed) -> None:
    _, report, kept = performed
    assert report.tripped is None
    assert report.missed == 0
    assert kept.numbers() == list(range(report.executed))
    assert report.executed == len(kept.cycles)


def test_the_prediction_is_made_from_the_measured_acceleration(performed: Performed) -> None:
    scene, _, kept = performed
    twin = live_twin(scene)
    for record in kept.cycles:
        assert twin.measure(record.time, record.acceleration) == record.predicted_rotation
        assert twin.block.angular_velocity == record.predicted_angular_velocity


def test_the_command_is_not_what_drives_it(performed: Performed) -> None:
    """The table lags its command and its accelerometer is noisy: the ideal answer is another one."""
    scene, report, kept = performed
    ideal = simulate(scene.block.block(), scene.pulse())
    assert ideal.outcome is Outcome.ROCKED
    assert report.predicted_peak != pytest.approx(ideal.peak_rotation, rel=1e-3)
    assert report.predicted_peak == pytest.approx(ideal.peak_rotation, rel=0.3)
    assert np.std([record.acceleration for record in kept.cycles[:50]]) > 1e-3


def test_prediction_and_measurement_differ_honestly(performed: Performed) -> None:
    _, report, _ = performed
    assert report.predicted_outcome == report.measured_outcome == "rocked"
    assert 1e-4 < report.largest_difference < report.predicted_peak
    assert report.measured_peak == pytest.approx(report.predicted_peak, rel=0.3)


def test_what_happened_is_said(performed: Performed) -> None:
    _, _, kept = performed
    names = [event.name for event in kept.events]
    assert names.count("phase") >= 5
    assert names.count("uplift") >= 1
    assert names.count("impact") > 10
    lift = next(event for event in kept.events if event.name == "uplift")
    pulse = next(event for event in kept.events if event.message.startswith("pulse"))
    assert lift.time > pulse.time
    impacts = [event.time for event in kept.events if event.name == "impact"]
    assert impacts == sorted(impacts)
    # Between the samples, not on them.
    assert np.ptp(np.mod(np.array(impacts), 1e-3)) > 1e-4


class StallingClock(ManualClock):
    """A clock whose host stalls once, for `length` s at `moment` s after the first wait."""

    def __init__(self, moment: float, length: float) -> None:
        super().__init__()
        self._moment, self._length = moment, length

    def wait_until(self, moment: float) -> float:
        lateness = super().wait_until(moment)
        if self._length and moment >= self._moment:
            self.advance(self._length)
            lateness, self._length = lateness + self._length, 0.0
        return lateness


@pytest.mark.parametrize(("length", "gone"), [(0.0009, 0), (0.0011, 1), (0.0053, 5)])
def test_a_stall_is_recorded_as_missed_cycles_and_never_made_up_for(length: float, gone: int) -> None:
    scene = short_scene(FREE, "initial_rotation_deg = 5")
    report, kept = perform_on(scene, StallingClock(0.2, length))
    assert report.tripped is None
    assert report.missed == gone
    assert kept.numbers() == list(range(report.executed + report.missed))
    assert sum(gap.last - gap.first + 1 for gap in kept.gaps) == gone
    # The twin goes across the gap on the table's clock.
    assert kept.cycles[-1].time == pytest.approx(kept.cycles[-1].cycle * 1e-3, abs=1e-12)
    assert report.measured_peak == pytest.approx(math.radians(5), abs=2e-3)


def test_free_rocking_starts_with_the_first_cycle() -> None:
    scene = short_scene(FREE, "initial_rotation_deg = 8")
    _, kept = perform_on(scene)
    assert kept.cycles[0].predicted_rotation == math.radians(8)
    assert kept.cycles[0].rotation == pytest.approx(math.radians(8), abs=1.5e-3)
    free = simulate(scene.block.block(), initial_rotation=math.radians(8))
    first = next(event.time for event in kept.events if event.name == "impact")
    # The accelerometer's bias of 2 mg and its noise move it a little.
    assert first == pytest.approx(free.impact_times[0], abs=5e-3)


def test_the_operator_stops_it() -> None:
    asked = iter([None] * 900 + [Ends("operator", "stop was asked")] * 10_000)
    report, kept = perform_on(short_scene(), stopped=lambda: next(asked))
    assert report.tripped == "operator: stop was asked"
    assert [event.name for event in kept.events][-1] == "stopped"
    trip = next(event for event in kept.events if event.name == "trip")
    assert trip.level == "error"
    after = [record for record in kept.cycles if record.cycle > 900]
    assert after
    assert abs(after[-1].position - after[-2].position) < 5e-6


def test_a_table_that_does_not_follow_trips() -> None:
    report, kept = perform_on(short_scene(), limit=1e-4)
    assert report.tripped is not None
    assert report.tripped.startswith("following_error: the table is")
    assert "the limit is 0.1 mm" in report.tripped
    assert [event.name for event in kept.events][-2:] == ["trip", "stopped"]


def test_a_silent_table_trips_and_says_that_it_could_not_be_stopped() -> None:
    scene = short_scene()
    kept = Kept()
    with chain(scene) as (table, release, rehearsal):
        table.enable(0.0)
        link = table._link  # pyright: ignore[reportPrivateUsage]
        serviced = link._idle  # pyright: ignore[reportPrivateUsage]

        def progress(status: Status) -> None:
            link._idle = (lambda: None) if status.time > 0.1 else serviced  # pyright: ignore[reportPrivateUsage]

        report = perform(
            table,
            rehearsal.motion,
            live_twin(scene),
            kept,
            ManualClock(),
            watch=Watch(release=release, progress=progress),
        )
        link._idle = serviced  # pyright: ignore[reportPrivateUsage]
    assert report.tripped is not None
    assert report.tripped.startswith("connection: DeviceTimeout")
    assert "trip" in [event.name for event in kept.events]


def test_an_overturning_block_is_seen_to_overturn() -> None:
    scene = short_scene('kind = "sine"\namplitude_g = 0.45\nfrequency_hz = 3')
    report, kept = perform_on(scene)
    assert report.predicted_outcome == report.measured_outcome == "overturned"
    assert "overturned" in [event.name for event in kept.events]
    assert kept.cycles[-1].predicted_rotation == pytest.approx(math.copysign(math.pi / 2, kept.cycles[-1].rotation))


def test_equal_seeds_give_equal_runs(performed: Performed) -> None:
    _, _, kept = performed
    _, again = perform_on(short_scene())
    assert [record.rotation for record in again.cycles] == [record.rotation for record in kept.cycles]
    assert [record.acceleration for record in again.cycles] == [record.acceleration for record in kept.cycles]


def test_percentiles_are_of_the_cycles(performed: Performed) -> None:
    _, report, _ = performed
    numbers = report.timing.percentiles()
    assert set(numbers) == {
        f"{what}_{q}_us" for what in ("lateness", "work", "twin", "answer") for q in ("p50", "p99", "p999", "max")
    }
    assert numbers["lateness_max_us"] == 0.0
