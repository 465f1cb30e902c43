"""Released machines from the scene to the replay: planned, performed on the emulator, stopped, run again."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.clock import ManualClock
from devices.roori1.capacity import CAPACITY as ROORI1
from excitation import ReleasedRun
from recordings.geometry import Geometry
from recordings.reader import read_run
from recordings.recorder import Recorder
from recordings.replay import replay
from tests.twin.conftest import Kept, chain, perform_on
from twin.commands.inputs import capacity_for
from twin.commands.replay import live_twin
from twin.cycle import Tee
from twin.errors import InputError
from twin.live import perform
from twin.live_loop import Ends, Watch
from twin.margin import find_margin
from twin.plan import plan_run
from twin.plan_data import as_data
from twin.plan_page.page import write_page
from twin.plan_report import sentences
from twin.provenance import processor, versions
from twin.rehearsal import planned_settings, rehearse
from twin.rocking.response import Outcome
from twin.scene import Scene, load_scene, parse_scene

AIR = """
[block]
width_mm = 60
height_mm = 270
mass_kg = 2.5692
{block}
[excitation]
kind = "constant"
acceleration_g = {acceleration}
duration_s = 0.12
[table]
device = "air_track"
coast_s = {coast}
settle_s = 0.1
{table}
[twin]
futures = 20
"""
OXFORD = """
[block]
width_mm = 60
height_mm = 270
mass_kg = 2.5692
[excitation]
kind = "double_pulse"
peak_velocity_m_s = {velocity}
stop_gap_mm = {gap}
[table]
device = "roori1"
settle_s = 0.1
{table}
[twin]
futures = 20
"""


def parsed(text: str) -> Scene:
    return parse_scene(text, name="released", folder=Path())


def air_track(acceleration: float = 0.3, coast: float = 1.0, table: str = "", block: str = "") -> Scene:
    return parsed(AIR.format(acceleration=acceleration, coast=coast, table=table, block=block))


def oxford(velocity: float = 0.15, gap: float = 20.0, table: str = "") -> Scene:
    return parsed(OXFORD.format(velocity=velocity, gap=gap, table=table))


def test_the_planned_motion_is_the_machines_own() -> None:
    rehearsal = rehearse(air_track(), AIR_TRACK)
    assert isinstance(rehearsal.motion, ReleasedRun)
    # No positioning, no brake, no return.
    assert [phase.name for phase in rehearsal.motion.phases] == ["wait", "pulse", "coast", "bumper", "rest"]
    assert rehearsal.settings is not None
    assert rehearsal.given == rehearsal.settings.pulse == rehearsal.motion.pulse
    assert rehearsal.clipped is not None
    assert rehearsal.clipped.given != rehearsal.given
    double = rehearse(oxford(), ROORI1)
    assert [phase.name for phase in double.motion.phases] == ["wait", "pulse", "slide", "stopper", "rest"]


def test_the_block_feels_the_bumper() -> None:
    # 0.41 m/s taken out in 0.05 s: more than the blow that topples B6L from rest, 0.3007 m/s.
    machine = AIR_TRACK.machine
    assert machine is not None
    hard = machine.model_copy(update={"end_stop": machine.end_stop.model_copy(update={"duration": 0.05})})
    scene = air_track(0.35, coast=2.0)
    soft_plan = rehearse(scene, AIR_TRACK)
    hard_plan = rehearse(scene, AIR_TRACK.model_copy(update={"machine": hard}))
    assert soft_plan.response.outcome is Outcome.ROCKED
    assert hard_plan.response.outcome is Outcome.OVERTURNED
    bumper = next(phase for phase in hard_plan.motion.phases if phase.name == "bumper")
    assert hard_plan.response.overturning_time is not None
    assert hard_plan.response.overturning_time > bumper.start


@pytest.mark.parametrize(("scene", "capacity"), [(air_track(), AIR_TRACK), (oxford(), ROORI1)])
def test_a_plan_says_what_to_set_and_what_it_makes(scene: Scene, capacity, tmp_path: Path) -> None:
    plan = plan_run(scene, capacity)
    assert plan.settings is not None
    text = "\n".join(sentences(plan))
    assert f"set        {plan.settings.sentence}" in text
    assert "makes      pulse" in text
    assert "machine    friction_m_s2" in text
    assert "steeper where the stroke left" not in text
    machine = capacity.machine
    assert f"stopping   {machine.stopping}" in text
    data = as_data(plan)
    assert isinstance(data["settings"], dict)
    assert data["settings"]["text"] == plan.settings.sentence
    write_page(plan, tmp_path / "plan.png")
    assert (tmp_path / "plan.png").stat().st_size > 10_000


def test_weights_come_in_steps_and_the_verdict_says_so() -> None:
    scene = air_track(0.2613)
    plan = plan_run(scene, AIR_TRACK)
    assert plan.feasible
    assert any("feasible, as near as the machine can be set" in line for line in sentences(plan))
    assert any("feasible as asked" in line for line in sentences(plan_run(oxford(), ROORI1)))


def test_the_margin_is_that_of_the_machines_run() -> None:
    scene = oxford(0.16, 30.0)
    rehearsal = rehearse(scene, ROORI1)
    assert rehearsal.given is not None
    margin = find_margin(rehearsal, rehearsal.given)
    assert margin.up is not None
    assert 0.02 < margin.up < 0.2
    for share, falls in ((1.0 + 0.99 * margin.up, False), (1.0 + 1.01 * margin.up, True)):
        outcome = rehearse(oxford(0.16 * share, 30.0), ROORI1).response.outcome
        assert (outcome is Outcome.OVERTURNED) is falls


def test_a_tilted_block_feels_the_whole_run() -> None:
    plan = plan_run(air_track(block="initial_rotation_deg = 3"), AIR_TRACK)
    assert plan.margin is not None
    assert plan.uncertain is not None
    assert plan.uncertain.start == 0.0
    assert plan.response is not None
    assert plan.response.uplift_time == 0.0


@pytest.mark.parametrize(
    ("scene", "capacity", "words"),
    [
        (air_track(table="brake_m_s2 = 1"), AIR_TRACK, "table.brake_m_s2: air_track is stopped by its bumper"),
        (oxford(table="brake_m_s2 = 1"), ROORI1, "table.brake_m_s2: roori1 is stopped by its stopper"),
        (oxford(table="coast_s = 1"), ROORI1, "table.coast_s: the stop gap decides how long roori1 slides"),
        (
            parsed(AIR.format(acceleration=0.3, coast=0, table="", block="").replace("mass_kg = 2.5692", "")),
            AIR_TRACK,
            "air_track draws the block along: its mass must be given",
        ),
        (oxford(gap=40.0), ROORI1, "double pulse asks a stop gap of 0.04 m; roori1 has 0.035 m at most"),
        (oxford(velocity=0.05), ROORI1, "double pulse asks 0.05 m/s; roori1 makes 0.076 m/s at least"),
        (load_scene("b6l_sine"), ROORI1, "roori1 makes pulses of kind double pulse only, no single sine"),
    ],
)
def test_what_the_machine_cannot_do_is_one_sentence(scene: Scene, capacity, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        rehearse(scene, capacity)
    assert "\n" not in str(caught.value)
    with pytest.raises(InputError, match=words):
        planned_settings(scene, capacity)


def test_too_fast_is_scaled_and_said() -> None:
    plan = plan_run(oxford(velocity=0.7), ROORI1)
    assert not plan.feasible
    assert plan.motion is not None
    assert plan.motion.peak_velocity == pytest.approx(0.617, rel=1e-9)
    assert any(
        line == "limit      double pulse asks 0.7 m/s of velocity; roori1 has 0.617 m/s" for line in sentences(plan)
    )


def test_nothing_is_set_where_nothing_shakes() -> None:
    still = parsed(
        OXFORD.format(velocity=0.15, gap=20, table="").split("[excitation]")[0]
        + ('[excitation]\nkind = "none"\nduration_s = 0.5\n[table]\ndevice = "roori1"\n')
    )
    assert planned_settings(still, ROORI1) is None
    report, kept = perform_on(still)
    assert report.tripped is None
    assert all(record.position == 0.0 for record in kept.cycles)


def test_a_mass_falls_with_the_scenes_gravity() -> None:
    scene = air_track(0.3, block="gravity_m_s2 = 1.62")
    capacity = capacity_for(scene)
    settings = planned_settings(scene, capacity)
    assert settings is not None
    # The same share of gravity takes the same weight, but for friction.
    assert settings.pulse.peak_acceleration == pytest.approx(0.3 * 1.62, rel=0.03)
    earthly = planned_settings(air_track(0.3), AIR_TRACK)
    assert earthly is not None
    assert settings.numbers["hanging_mass_kg"] == pytest.approx(earthly.numbers["hanging_mass_kg"], rel=0.1)


@pytest.mark.parametrize("scene", [air_track(coast=4.0), oxford()])
def test_a_run_from_the_scene_to_the_replay(scene: Scene, tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    told = {"scene": {"json": scene.model_dump_json()}, "versions": versions(), "processor": processor()}
    recorder = Recorder(path, told, Geometry(0.06, 0.27))
    kept = Kept()
    try:
        with chain(scene) as (table, release, rehearsal):
            table.enable(0.0)
            report = perform(
                table,
                rehearsal.motion,
                live_twin(scene),
                Tee(recorder, kept),
                ManualClock(),
                after=rehearsal.after,
                watch=Watch(release=release),
            )
            table.disable()
    finally:
        written = recorder.finish({})
    assert report.tripped is None
    assert report.missed == 0
    assert report.predicted_outcome == report.measured_outcome == rehearsal.response.outcome.value == "rocked"
    assert report.predicted_peak == pytest.approx(rehearsal.response.peak_rotation, rel=0.15)
    # The base did what was planned, but for the latch's 2 ms and the encoder's micrometre.
    late = [record.position - rehearsal.motion.displacement(max(record.time - 2e-3, 0.0)) for record in kept.cycles]
    assert np.abs(late).max() < 1e-6
    names = [event.message.split(" until")[0] for event in kept.events if event.name == "phase"]
    assert names == [phase.name for phase in rehearsal.motion.phases]
    # Whoever has the file alone gets the same prediction, to the last bit.
    assert written.complete
    again = replay(read_run(path), live_twin(scene))
    assert again.bits_checked
    assert again.identical


def test_an_operators_stop_before_the_release_disarms() -> None:
    asked = iter(range(10**6))
    report, kept = perform_on(oxford(), stopped=lambda: Ends("operator", "enough") if next(asked) > 50 else None)
    assert report.tripped == "operator: enough"
    assert all(record.position == 0.0 for record in kept.cycles)


def test_an_operators_stop_on_the_air_track_brakes_the_cart() -> None:
    asked = iter(range(10**6))
    report, kept = perform_on(
        air_track(coast=3.0), stopped=lambda: Ends("operator", "enough") if next(asked) > 500 else None
    )
    assert report.tripped == "operator: enough"
    assert report.stopping > 50
    # 0.35 m/s with 1.5 m/s2 takes 41 mm; the bumper would have been a metre away.
    way = [record.position for record in kept.cycles if math.isnan(record.lateness)]
    assert way[-1] - way[0] == pytest.approx(0.35**2 / 3.0, rel=0.1)
    assert way[-1] - way[-50] < 1e-5


def test_roori1_cannot_be_stopped_and_is_followed_to_rest() -> None:
    asked = iter(range(10**6))
    report, kept = perform_on(oxford(), stopped=lambda: Ends("operator", "enough") if next(asked) > 130 else None)
    assert report.tripped == "operator: enough"
    assert kept.cycles[-1].position == pytest.approx(0.02, abs=1e-3)
    assert any(event.name == "stopped" for event in kept.events)
