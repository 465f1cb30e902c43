"""Planning: clip, prediction, margin, futures, and how they are said."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from devices.air_track.capacity import CAPACITY as AIR_TRACK
from devices.catalogue import find_device
from devices.quanser_st3.capacity import CAPACITY as ST3
from excitation import SineWave
from tests.facts import B6L, BOUNDARIES, LIMIT, P
from tests.twin.conftest import FREE, short_scene
from twin.errors import InputError
from twin.margin import shaking_of
from twin.plan import plan_run
from twin.plan_data import as_data
from twin.plan_page.page import write_page
from twin.plan_report import sentences
from twin.rehearsal import rehearse
from twin.rocking.response import Outcome
from twin.scene import load_scene, parse_scene, shipped_scenes

KOBE = Path(__file__).resolve().parents[3] / "shared" / "data" / "kobe1995_nishi_akashi_090.at2"


STILL = """
        restitution_spread = 0
        slenderness_spread_percent = 0
        initial_tilt_spread_deg = 0
        [uncertainty]
        size_percent = { spread = 0 }
        table.gain_percent = { spread = 0 }
"""


def sine_scene(amplitude: float, frequency: float, extra: str = "") -> str:
    """Return the text of a scene with a sine of dimensionless A and W on B6L."""
    return f"""
        [block]
        width_mm = 60
        height_mm = 270
        [excitation]
        kind = "sine"
        amplitude_m_s2 = {amplitude * LIMIT!r}
        frequency_hz = {frequency * P / (2 * math.pi)!r}
        [table]
        device = "quanser_st3"
        [twin]
        futures = 20
        {extra}
    """


def scene_of(text: str):
    return parse_scene(text, name="mine", folder=Path())


@pytest.mark.parametrize("name", sorted(shipped_scenes()))
def test_every_shipped_scene_can_be_run_as_asked_and_stays_up(name: str) -> None:
    scene = load_scene(name)
    plan = plan_run(scene, find_device(scene.table.device).capacity)
    assert plan.feasible
    assert plan.stays_up
    assert plan.uncertain is not None
    assert plan.uncertain.probability.count == 10_000


@pytest.mark.parametrize("frequency", [2, 4])
def test_the_margin_is_the_distance_to_the_known_boundary(frequency: int) -> None:
    boundary = min(a for w, a, _ in BOUNDARIES if w == frequency)
    amplitude = 0.9 * boundary
    plan = plan_run(scene_of(sine_scene(amplitude, frequency)), ST3)
    assert plan.response is not None
    assert plan.response.outcome is Outcome.ROCKED
    assert plan.margin is not None
    assert plan.margin.up == pytest.approx(boundary / amplitude - 1.0, abs=2e-9)
    assert plan.margin.smallest == plan.margin.up


def test_the_margin_of_a_fall_is_the_way_back_up() -> None:
    boundary = min(a for w, a, _ in BOUNDARIES if w == 2)
    amplitude = 1.05 * boundary
    plan = plan_run(scene_of(sine_scene(amplitude, 2)), ST3)
    assert not plan.stays_up
    assert plan.margin is not None
    assert plan.margin.down == pytest.approx(boundary / amplitude - 1.0, abs=2e-9)
    assert any("OVERTURNS" in line for line in sentences(plan))


def test_a_pulse_beyond_the_table_is_clipped_and_said() -> None:
    plan = plan_run(short_scene('kind = "sine"\namplitude_g = 0.9\nfrequency_hz = 3'), ST3)
    assert not plan.feasible
    assert plan.clipped is not None
    assert isinstance(plan.clipped.given, SineWave)
    assert plan.clipped.given.peak_velocity == pytest.approx(ST3.velocity, rel=1e-9)
    text = "\n".join(sentences(plan))
    assert "0.664 m/s" in text
    assert "not feasible as asked" in text


def test_what_the_table_cannot_make_at_all_is_a_plan_without_a_motion() -> None:
    scene = load_scene("b6l_sine")
    plan = plan_run(scene, AIR_TRACK)
    assert plan.motion is None
    assert not plan.feasible
    assert not plan.stays_up
    assert any(line.startswith("suggestion constant pulse") for line in sentences(plan))
    json.dumps(as_data(plan), allow_nan=False)
    with pytest.raises(InputError, match="air_track"):
        rehearse(scene, AIR_TRACK)


def test_the_table_returns_when_the_block_rests() -> None:
    rehearsal = rehearse(load_scene("b6l_sine"), ST3)
    back = next(phase for phase in rehearsal.motion.phases if phase.name == "return")
    assert rehearsal.response.rest_time is not None
    assert rehearsal.response.rest_time < back.start
    # Neither the way there nor the way back reaches half of g tan(alpha).
    for phase in rehearsal.motion.phases:
        if phase.name in ("approach", "return"):
            middle = phase.start + 0.25 * (phase.end - phase.start)
            assert abs(rehearsal.motion.acceleration(middle)) <= 0.5 * LIMIT * (1 + 1e-9)


def test_the_margin_of_a_double_pulse_ends_where_its_gap_does() -> None:
    # Clipped to 9.81 m/s2 the run-up to 0.35 m/s takes 6.2 of the 6.5 mm of the gap: 2 % more speed has no room.
    scene = short_scene('kind = "double_pulse"\npeak_velocity_m_s = 0.35\nstop_gap_mm = 6.5')
    plan = plan_run(scene, ST3)
    assert plan.clipped is not None
    assert plan.clipped.given is not None
    assert plan.margin is not None
    assert plan.margin.up is None or plan.margin.up < 0.03


def test_a_tilted_block_is_let_go_at_the_same_time_in_every_part_of_the_plan() -> None:
    text = sine_scene(1.35, 3.4, STILL).replace("height_mm = 270", "height_mm = 270\ninitial_rotation_deg = 5")
    plan = plan_run(scene_of(text), ST3)
    assert plan.response is not None
    assert plan.uncertain is not None
    assert plan.margin is not None
    fell = plan.response.outcome is Outcome.OVERTURNED
    assert plan.uncertain.probability.overturned == (20 if fell else 0)
    peaks = [response.peak_rotation for response in plan.uncertain.responses]
    assert peaks == pytest.approx([plan.response.peak_rotation] * 20, rel=1e-9)
    # Just beyond the margin the outcome is the other one.
    change = plan.margin.smallest
    assert change is not None
    other = text.replace(repr(1.35 * LIMIT), repr(1.35 * LIMIT * (1.0 + change * (1.0 + 1e-6))))
    assert plan_run(scene_of(other), ST3).stays_up is fell


@pytest.mark.parametrize("amplitude", [0.24, 0.28, 0.32])
def test_the_margin_brakes_like_the_run_where_the_jerk_is_limited(amplitude: float) -> None:
    scene = parse_scene(
        f"""
        [block]
        width_mm = 60
        height_mm = 270
        [excitation]
        kind = "constant"
        acceleration_g = {amplitude}
        duration_s = 0.15
        [table]
        device = "quanser_st3"
        brake_m_s2 = 6
        """,
        name="jerky",
        folder=Path(),
    )
    rehearsal = rehearse(scene, ST3.model_copy(update={"jerk": 20.0, "stroke": 1.0}))
    assert rehearsal.given is not None
    made = rehearsal.motion.shaking
    laid = shaking_of(rehearsal)(rehearsal.given)
    t = np.linspace(0.0, made.duration, 1000)[1:-1]
    rows = np.searchsorted(laid[:, 0], t, side="right") - 1
    assert laid[-1, 1] == pytest.approx(made.duration, abs=1e-9)
    linear = laid[rows, 2] + laid[rows, 3] * (t - laid[rows, 0])
    assert linear == pytest.approx(made.acceleration(t), abs=1e-6)


def test_futures_repeat_with_their_seed() -> None:
    # Almost on the boundary: some fall, some do not.
    text = sine_scene(1.2, 2)
    first, again = plan_run(scene_of(text), ST3), plan_run(scene_of(text), ST3)
    other = plan_run(scene_of(text.replace("futures = 20", "futures = 20\nseed = 7")), ST3)
    assert first.uncertain is not None
    assert again.uncertain is not None
    assert other.uncertain is not None
    assert first.uncertain.probability.overturned == again.uncertain.probability.overturned
    peaks = [[response.peak_rotation for response in plan.uncertain.responses] for plan in (first, again, other)]
    assert peaks[0] == peaks[1] != peaks[2]


def test_no_spread_no_difference() -> None:
    plan = plan_run(scene_of(sine_scene(1.2, 2, STILL)), ST3)
    assert plan.uncertain is not None
    assert plan.response is not None
    peaks = [response.peak_rotation for response in plan.uncertain.responses]
    assert peaks == pytest.approx([plan.response.peak_rotation] * 20, rel=1e-6)


def test_free_rocking_has_no_margin() -> None:
    plan = plan_run(short_scene(FREE, "initial_rotation_deg = 5"), ST3)
    assert plan.margin is None
    assert plan.feasible
    assert any("nothing shakes" in line for line in sentences(plan))


def test_a_mass_beyond_the_payload_is_refused() -> None:
    plan = plan_run(short_scene(block="mass_kg = 150"), ST3)
    assert plan.motion is None
    assert any("payload" in line for line in sentences(plan))


@pytest.mark.parametrize("ending", ["png", "svg", "pdf"])
def test_pictures(ending: str, tmp_path: Path) -> None:
    plan = plan_run(short_scene(), ST3)
    path = tmp_path / f"plan.{ending}"
    write_page(plan, path)
    assert path.stat().st_size > 10_000
    with pytest.raises(InputError, match="ends in"):
        write_page(plan, tmp_path / "plan.xyz")


def test_a_picture_of_what_cannot_be_made(tmp_path: Path) -> None:
    write_page(plan_run(load_scene("b6l_sine"), AIR_TRACK), tmp_path / "plan.png")
    assert (tmp_path / "plan.png").exists()


def test_the_real_earthquake() -> None:
    if not KOBE.exists():
        pytest.skip("the third-party record lies in ../shared, which is not here")
    plan = plan_run(load_scene("b6l_sine").with_record(KOBE, 0.5), ST3)
    assert plan.clipped is not None
    assert plan.clipped.asked.duration == pytest.approx(40.95)
    assert plan.clipped.asked.peak_acceleration == pytest.approx(0.5 * 0.5027 * 9.81, rel=1e-3)
    assert plan.feasible
    assert plan.response is not None
    assert plan.response.outcome is Outcome.ROCKED
    assert plan.response.peak_rotation < B6L.slenderness
