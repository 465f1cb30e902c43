"""The study's machinery: what it makes is what the emulator does, and what it counts is what happened."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from tests.benchmarks.chain_run import CAN_COPY, Performed, performed, repeated, short
from tests.benchmarks.chain_scenes import KINDS, draw, synthetic
from tests.benchmarks.chain_tables import advice_row, first_cases, outcome_row, random_cases, whole_row
from tests.benchmarks.forecast_chain import COLUMNS, study
from tests.twin.conftest import perform_on
from twin.rehearsal import Rehearsal
from twin.scene import parse_scene

SCENE = """
[block]
width_mm = 60
height_mm = 270
[excitation]
kind = "sine"
amplitude_g = 0.36
frequency_hz = 3
[table]
device = "quanser_st3"
settle_s = 0.1
[table.specimen]
restitution_change_percent = -5
slenderness_change_percent = 1
tilt_at_pulse_deg = 0.2
rotation_noise_rad = 1e-3
"""


@pytest.fixture(scope="module")
def run() -> Rehearsal:
    """A run that falls."""
    return short(parse_scene(SCENE, name="falls", folder=Path()))


@pytest.fixture(scope="module")
def asked(run: Rehearsal) -> list[int]:
    """Cycles before the pulse, in it and after it."""
    motion = run.motion
    return [round(1e3 * t) for t in (motion.pulse_start - 0.1, motion.pulse_start + 0.12, motion.shaking_end + 0.02)]


@pytest.fixture(scope="module")
def observed(run: Rehearsal, asked: list[int]) -> Performed:
    """The run with the observer, stops tried."""
    return performed(run, observed=True, asked=asked)


def test_it_falls_as_the_emulated_block_does(run: Rehearsal, observed: Performed) -> None:
    _, kept = perform_on(run.scene)
    lies = next(record.time for record in kept.cycles if abs(record.rotation) > 1.56)
    assert observed.fell is not None
    assert observed.fell == pytest.approx(lies, abs=0.01)


def test_a_stop_is_the_same_from_the_beginning(run: Rehearsal, observed: Performed, asked: list[int]) -> None:
    assert observed.stops[asked[0]] is False, "nothing shakes before the pulse"
    assert observed.stops[asked[2]] is True, "after the shaking there is nothing to stop"
    assert [repeated(run, k) for k in asked] == [observed.stops[k] for k in asked]


@pytest.mark.skipif(not CAN_COPY, reason="the process cannot be copied here")
def test_without_copies_the_answers_are_the_same(
    run: Rehearsal, observed: Performed, asked: list[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.benchmarks.chain_run.CAN_COPY", False)
    again = performed(run, observed=True, asked=asked[1:2], first=False)
    assert again.stops == {asked[1]: observed.stops[asked[1]]}
    assert again.fell == observed.fell


def test_the_alarm_is_the_trip_and_the_advice_is_the_runs(run: Rehearsal, observed: Performed) -> None:
    assert observed.alarm is not None
    assert observed.alarm_in_pulse is not None
    assert observed.fell is not None
    assert run.motion.pulse_start < observed.alarm_in_pulse < observed.fell
    assert round(1e3 * observed.alarm_in_pulse) in observed.stops
    assert {round(1e3 * t) for t in observed.advised.values()} <= set(observed.stops)
    assert 0 < observed.right <= observed.instants == round(1e3 * (run.motion.shaking_end - run.motion.pulse_start))


def test_without_its_sensor_the_run_is_the_same_and_its_forecast_another(run: Rehearsal, observed: Performed) -> None:
    free = performed(run, observed=False, asked=[round(1e3 * run.motion.shaking_end)], first=False)
    assert free.fell == observed.fell
    assert free.cycles == observed.cycles
    assert len(free.stops) == 1


@pytest.mark.parametrize("kind", KINDS)
def test_scenes_are_drawn_again_alike_and_performed_as_asked(kind: str, tmp_path: Path) -> None:
    drawn = draw(kind, 3, 7, tmp_path)
    assert draw(kind, 3, 7, tmp_path).scene.model_dump() == drawn.scene.model_dump()
    rehearsal = short(drawn.scene)
    assert rehearsal.clipped is not None
    assert not rehearsal.clipped.limits
    assert rehearsal.motion.duration + rehearsal.after > rehearsal.motion.shaking_end + 1.0


def test_a_synthetic_record_ends_where_it_began() -> None:
    samples, step = synthetic(np.random.default_rng(5))
    velocity = np.cumsum(samples) * step
    assert np.max(np.abs(samples)) == 1.0
    assert abs(velocity[-1]) < 0.02 * np.max(np.abs(velocity))


def test_a_study_has_a_row_for_each_forecast(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tests.benchmarks.forecast_chain.GRID", 0.05)
    rows = study(KINDS.index("double pulse, ROORI1"), 2, None, repeat=True)
    assert [row["forecast"] for row in rows] == ["with", "without"]
    assert all(set(row) == set(COLUMNS) for row in rows)
    again = json.loads(rows[0]["repeated"])
    assert again[1] == again[2]


def row(fell: str, alarm: str, no_return: str = "", **more: str) -> dict[str, str]:
    said = {"right": "9", "instants": "10", "first": "[]", "random": "[]", "alarm_stop": "null", "pulse_s": "0.5"}
    return said | {"fell_s": fell, "alarm_in_pulse_s": alarm, "alarm_s": alarm, "no_return_s": no_return} | more


def test_alarms_are_counted() -> None:
    rows = [
        row("2.0", "1.0", "1.2"),
        row("2.0", "1.5", "1.2"),
        row("2.0", ""),
        row("", "1.0"),
        row("", "", alarm_s="0.1"),
    ]
    assert outcome_row("sine", "with", rows) == (
        "| sine | with | 5 | 3 | 2 | 1 | 1 | 0.75 (0.55) | -0.05 (-0.25) | 1 | 90.0 % |"
    )
    assert whole_row("with", rows) == "| with | 3 | 2 | 2 | 1 |"


def test_both_answers_to_an_advice_are_counted() -> None:
    first = '[["stopping helps", 1.0, false], ["too late", 1.2, true]]'
    rows = [
        row("2.0", "1.0", first=first, random='[["continue", 0.1, true]]'),
        row("", "1.0", first=first, random='[["continue", 0.1, true]]'),
    ]
    assert advice_row("stopping helps", "with", rows, first_cases) == (
        "| stopping helps | with | 2 | 1 | 0 | 0 | 1 | 50 % |"
    )
    assert advice_row("too late", "with", rows, first_cases) == "| too late | with | 2 | 0 | 1 | 1 | 0 | 50 % |"
    assert advice_row("continue", "with", rows, random_cases) == "| continue | with | 2 | 0 | 1 | 1 | 0 | 50 % |"
    assert advice_row("undecided", "with", rows, random_cases) == "| undecided | with | 0 | 0 | 0 | 0 | 0 | - |"
